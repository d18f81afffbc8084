#include "actors/session/link_pace.hpp"

#include <algorithm>
#include <utility>

namespace darm::session {
namespace {

constexpr std::size_t kMostPings = 16;          // under way
constexpr Microseconds kWorthKnowing = 20'000;  // what the link needs longer for is pinged
constexpr std::uint64_t kTellingBytes = 32u << 10;
constexpr double kLearned = 0.3;  // weight of the newest
constexpr double kMostGain = 4;   // of what is known: one measure may be anything
constexpr double kFastest = 1e9;  // bytes a second
constexpr Microseconds kProbeEvery = 10'000'000;
constexpr Microseconds kRoundTripFor = 30'000'000;  // after so long a round trip may have become longer

}  // namespace

Microseconds LinkPace::expected(std::uint64_t bytes) const {
  return rate_ > 0 ? static_cast<Microseconds>(static_cast<double>(bytes) / rate_ * 1e6) : 0;
}

bool LinkPace::ping_due(std::size_t bytes, Microseconds now) const {
  if (deaf(now) || pings_.size() >= kMostPings) return false;
  if (!pinged_at_ || now - *pinged_at_ >= kPingEvery) return true;
  if (bytes < kTellingBytes / 8) return false;
  if (rate_ <= 0) return pings_.empty() || bytes >= kTellingBytes;
  const auto unanswered = (pings_.empty() ? 0 : written_ - arrived_) + bytes;
  return expected(unanswered) >= kWorthKnowing;
}

// Not in the very first write, because clients expect their welcome first.
bool LinkPace::probe_due(std::size_t bytes, Microseconds now) const {
  if (!pinged_at_ || !pings_.empty() || bytes < kTellingBytes / 8) return false;
  return !probed_at_ || now - *probed_at_ >= kProbeEvery;
}

std::int64_t LinkPace::ping(Microseconds now) {
  Ping ping;
  ping.number = std::max(now, pinged_at_ ? *pinged_at_ + 1 : now);
  ping.upto = pinged_upto_ = written_;
  ping.began = began_;
  ping.sent = now;
  pinged_at_ = ping.number;
  pings_.push_back(ping);
  return ping.number;
}

LinkPace::Pings LinkPace::write(std::size_t bytes, Microseconds now) {
  Pings out;
  const bool due = ping_due(bytes, now);
  if (pings_.empty()) arrived_ = pinged_upto_ = written_;  // what was not worth a ping is gone
  if (pinged_upto_ == written_) began_ = now;
  if (due && probe_due(bytes, now)) {
    probed_at_ = now;
    out.in_front = ping(now);
  }
  written_ += bytes;
  under_way_since_ = now;
  if (due) out.behind = ping(now);
  return out;
}

void LinkPace::pong(std::int64_t number, Microseconds now) {
  const auto it = std::ranges::find(pings_, number, &Ping::number);
  if (it == pings_.end()) return;
  const bool first = !std::exchange(answers_, true);
  const auto ping = *it;
  const auto began = pings_.front().began;
  pings_.erase(pings_.begin(), it + 1);
  note_round_trip(now - ping.sent, now);
  // The line began with these bytes when they had come to it, or when it was done with those before.
  // The first says how far it is at most, and that alone.
  if (!first)
    learn(ping.upto - arrived_, now - std::max(began + round_trip(), arrived_at_), began + round_trip() >= arrived_at_);
  arrived_ = ping.upto;
  arrived_at_ = now;
}

// The shortest of this while and of the one before.
void LinkPace::note_round_trip(Microseconds took, Microseconds now) {
  if (now - round_trip_since_ >= kRoundTripFor) {
    round_trip_before_ = std::exchange(round_trip_now_, std::nullopt);
    round_trip_since_ = now;
  }
  round_trip_now_ = std::min(round_trip_now_.value_or(took), took);
}

Microseconds LinkPace::round_trip() const {
  if (!round_trip_now_) return round_trip_before_.value_or(0);
  return std::min(*round_trip_now_, round_trip_before_.value_or(*round_trip_now_));
}

// A lost packet holds up what comes behind it for a round trip: small bytes that took long say nothing, nor do those
// that arrived at once behind others that were held up.
void LinkPace::learn(std::uint64_t bytes, Microseconds took, bool alone) {
  const bool measured = took >= kMeasurable + 2 * round_trip();
  const bool telling = bytes >= kTellingBytes && alone;
  if (!measured && !telling) return;
  const auto seconds = static_cast<double>(std::max<Microseconds>(took, 1'000)) * 1e-6;
  const double seen = std::min(static_cast<double>(bytes) / seconds, kFastest);
  if (rate_ <= 0) {
    rate_ = seen;
  } else if (measured || seen > rate_) {
    rate_ += kLearned * (std::min(seen, rate_ * kMostGain) - rate_);
  }
}

bool LinkPace::full(std::size_t waiting, Microseconds now) const {
  const bool unknown = pings_.empty() || deaf(now);
  const auto unanswered = (unknown ? 0 : written_ - arrived_) + waiting;
  if (under_way_since_ && now - *under_way_since_ > kOverdue + expected(unanswered)) return true;
  if (expected(unanswered) > kQueue + round_trip()) return true;
  return !unknown && now - pings_.front().sent > kOverdue + round_trip() + expected(pings_.front().upto - arrived_);
}

}  // namespace darm::session

#include "actors/tile_scheduler/member_link.hpp"

#include <algorithm>
#include <array>

namespace darm::tile_scheduler {
namespace {

// Between the rates that lines are sold with (1, 2, 5, 10 Mbit/s), so that a lane holds one of them.
constexpr std::array kLaneEnds{50e3, 180e3, 400e3, 900e3};  // bytes a second
constexpr double kClearly = 1.5;                            // beyond the end of a lane

}  // namespace

std::uint8_t lane_of(double bytes_per_second) {
  const auto end = std::ranges::upper_bound(kLaneEnds, bytes_per_second);
  return static_cast<std::uint8_t>(1 + (end - kLaneEnds.begin()));
}

void MemberLink::changed(LinkState state, double bytes_per_second, Microseconds now) {
  if (state != LinkState::kFull) full_since_.reset();
  if (state == LinkState::kFull && !full_since_) full_since_ = now;
  state_ = state;
  rate_ = bytes_per_second;
}

void MemberLink::lost_pictures(Microseconds now) {
  if (!lost_at_ || now - *lost_at_ >= options_.keeps_up) lost_since_ = now;
  lost_at_ = now;
}

void MemberLink::sent(std::size_t bytes, Microseconds now) {
  if (rate_ <= 0) return;
  const double takes = static_cast<double>(bytes) / (rate_ * options_.share) * 1e6;
  const auto from = std::max(busy_until_, now);
  busy_until_ = std::min(from + static_cast<Microseconds>(std::min(takes, 1e9)), now + options_.longest);
}

bool MemberLink::keeps_up(double key_bytes, Microseconds now) {
  if (!(rate_ > 0 && key_bytes > rate_ * options_.key_seconds))
    slow_since_.reset();
  else if (!slow_since_)
    slow_since_ = now;
  const bool slow = slow_since_ && now - *slow_since_ >= options_.slow_for;
  const bool loses = lost_since_ && *lost_at_ - *lost_since_ >= options_.behind;
  const bool fast = rate_ * options_.key_seconds > key_bytes * options_.clearly_fast;
  if (!slow && !loses && (fast || !stands(now))) return true;
  trouble_at_ = now;
  return false;
}

bool MemberLink::settle(double key_bytes, Microseconds now) {
  const auto before = lane_;
  if (lane_ == 0) {
    if (keeps_up(key_bytes, now)) return false;
    lane_ = lane_of(rate_);
    return true;
  }
  if (stands(now) || (lost_at_ && *lost_at_ > trouble_at_)) trouble_at_ = now;
  const bool fast = rate_ <= 0 || rate_ * options_.key_seconds >= key_bytes * options_.room;
  if (fast && now - trouble_at_ >= (options_.keeps_up << doublings_)) {
    lane_ = 0;
    doublings_ = std::min(doublings_ + 1, options_.most_doublings);
    lost_since_ = lost_at_ = slow_since_ = other_since_ = std::nullopt;
  } else {
    choose_lane(now);
  }
  return lane_ != before;
}

void MemberLink::choose_lane(Microseconds now) {
  const bool slower = lane_of(rate_ * kClearly) < lane_;
  const bool faster = lane_of(rate_ / kClearly) > lane_;
  if (!(slower || faster) || rate_ <= 0 || stands(now)) {
    other_since_.reset();
    return;
  }
  if (!other_since_) other_since_ = now;
  if (now - *other_since_ < (slower ? options_.slower_after : options_.faster_after)) return;
  lane_ = lane_of(rate_);
  other_since_.reset();
}

bool MemberLink::worth_waiting_for(Microseconds now) const {
  if (state_ == LinkState::kLoading) return false;
  return !full_since_ || now - *full_since_ < options_.patience;
}

std::size_t MemberLink::most_bytes(bool key) const {
  if (rate_ <= 0) return 0;
  const double bytes = rate_ * (key ? options_.key_budget : options_.frame_budget);
  return std::max(options_.least_bytes, static_cast<std::size_t>(bytes));
}

}  // namespace darm::tile_scheduler

#include "client/desktop/reunion.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

namespace darm::client::desktop {
namespace {

// With one mark at its end, whatever it has.
std::string sentence(const std::string& text) {
  return text.ends_with('?') || text.ends_with('!') || text.ends_with('.') ? text : text + ".";
}

constexpr double kFirstRetryMs = 300, kLongestRetryMs = 5000, kFullRetryMs = 10'000;

}  // namespace

double retry_delay_ms(unsigned n, double random) {
  return std::min(kLongestRetryMs, std::ldexp(kFirstRetryMs, static_cast<int>(std::min(n, 10u)))) *
         (0.9 + 0.2 * random);
}

void Reunion::joined(double now) {
  tries_ = 0;
  words_ = {};
  if (!pictured_) words_.quiet = kWalkingIn;
  if (joins_++ > 0 && !std::exchange(left_, false)) say("Connected again.", now, 3);
}

void Reunion::left() {
  words_ = {};
  left_ = true;
}

void Reunion::pictured() {
  pictured_ = true;
  if (words_.quiet == kWalkingIn) words_.quiet.clear();
}

std::optional<double> Reunion::lost(const Error& reason, double random) {
  words_ = {};
  passing_until_ = 0;
  switch (reason.cause) {
    case Cause::kFull: {
      const std::string text = "The server has as many visitors as it may have. It is tried again in 10 s.";
      (pictured_ ? words_.quiet : words_.alert) = text;
      return kFullRetryMs;
    }
    case Cause::kVersion:
      words_.alert = sentence(reason.message) + " Please use the darm-view that came with that server.";
      return std::nullopt;
    case Cause::kRefused:
    case Cause::kProtocol:
      words_.alert = sentence(reason.message) + " Please start darm-view again.";
      return std::nullopt;
    case Cause::kOther:
      break;
  }
  words_.quiet =
      pictured_ ? "Connection lost; the picture stays. Trying again..." : sentence(reason.message) + " Trying again...";
  return retry_delay_ms(tries_++, random);
}

void Reunion::say(std::string text, double now, double seconds) {
  passing_ = std::move(text);
  passing_until_ = now + seconds * 1000;
}

Notice Reunion::words(double now) const {
  Notice out = words_;
  if (now < passing_until_) out.quiet = passing_;
  return out;
}

double Reunion::next_change() const {
  return passing_until_ > 0 ? passing_until_ : std::numeric_limits<double>::infinity();
}

}  // namespace darm::client::desktop

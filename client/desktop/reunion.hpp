// What to do and to say when the network or the server is gone, and when it is back. Pure; the rules are the web
// client's (client/web/src/worker/stream_socket.ts).
#pragma once

#include <optional>
#include <string>

#include "client/core/result.hpp"

namespace darm::client::desktop {

/// Milliseconds until try number `n` (0, 1, ...): twice as long each time, up to 5 s; a tenth each way by `random` in
/// [0, 1], so that clients spread.
[[nodiscard]] double retry_delay_ms(unsigned n, double random);

/// The words at the edge of the picture, and the loud ones without which nothing goes on.
struct Notice {
  std::string quiet;
  std::string alert;
};

/// How one visit goes, from loss to loss. Times are milliseconds of any steady clock, given by the caller.
class Reunion {
 public:
  /// The session is agreed on.
  void joined(double now);
  /// The session was given up because nobody looked: the next one comes without words.
  void left();
  /// Something is shown, and stays when the session ends.
  void pictured();
  /// It ended, or did not come about, by `reason`. Gives the milliseconds until the next try; nothing: for good.
  [[nodiscard]] std::optional<double> lost(const Error& reason, double random);
  /// A line that leaves by itself after `seconds`.
  void say(std::string text, double now, double seconds);
  /// What is to be read at `now`.
  [[nodiscard]] Notice words(double now) const;
  /// When words() changes by itself; infinite: never.
  [[nodiscard]] double next_change() const;
  [[nodiscard]] unsigned joins() const { return joins_; }

 private:
  static constexpr const char* kWalkingIn = "Walking in...";

  Notice words_{kWalkingIn, ""};
  std::string passing_;
  double passing_until_ = 0;
  unsigned joins_ = 0, tries_ = 0;
  bool pictured_ = false, left_ = false;
};

}  // namespace darm::client::desktop

// When a picture is due: at once for a hand that moves, as often as it is cheap for news of a still view, never for
// nothing. Pure.
#pragma once

#include <limits>

namespace darm::client::desktop {

/// Times are milliseconds of any steady clock, given by the caller.
class RedrawPace {
 public:
  /// The camera, the window or something else that the hand sees at once has changed.
  void moved(double now) {
    moved_at_ = now;
    due_ = true;
  }
  /// The stream has brought something.
  void news() { news_ = true; }
  /// The picture begun at `begin` was done at `end`.
  void drawn(double begin, double end);

  /// Until a little after the last move.
  [[nodiscard]] bool moving(double now) const;
  [[nodiscard]] bool due(double now) const { return wait(now) <= 0; }
  /// Milliseconds until a picture is due, if nothing more happens; infinite: none is.
  [[nodiscard]] double wait(double now) const;

 private:
  double moved_at_ = -std::numeric_limits<double>::infinity();
  double drew_until_ = -std::numeric_limits<double>::infinity();
  double draw_ms_ = 0;
  bool due_ = true;
  bool news_ = false;
};

}  // namespace darm::client::desktop

// Mouse, keyboard and gamepad of the window, turned into moves of the rig and into actions.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "client/desktop/rig.hpp"
#include "client/desktop/steering.hpp"
#include "client/desktop/window.hpp"

namespace darm::client::desktop {

enum class Action : std::uint8_t {
  kPanel,
  kMode,
  kBare,
  kStart,
  kLink,
  kScreenshot,
  kHelp,
  kCloseHelp,
  kFullScreen,
  kQuit
};

/// Lives as long as the window, on its thread. Made before the overlay, which passes events on.
class Controls {
 public:
  /// An orbit begins at (x, y), shares of the window's height from its middle, y up: the point there, if there is one.
  using PointUnder = std::function<std::optional<glm::dvec3>(double x, double y)>;

  Controls(GLFWwindow* window, Rig& rig, PointUnder point_under);
  ~Controls();
  Controls(const Controls&) = delete;
  Controls& operator=(const Controls&) = delete;

  /// Moves the rig by what is held for `seconds`; true if it moved since the last call, by whatever hand.
  /// `mouse_taken`: the overlay has the mouse.
  [[nodiscard]] bool advance(double seconds, bool mouse_taken);
  /// What was asked for since the last call.
  [[nodiscard]] std::vector<Action> take_actions();
  /// Anything happened since the last call: the overlay may look different.
  [[nodiscard]] bool take_events();
  /// Something is held or rolls out: do not wait for events. A gamepad has none, and must be asked.
  [[nodiscard]] bool restless() const;
  /// Turns the rig around its pivot in the middle of the window, or walks again.
  void toggle_mode();

 private:
  void on_key(int key, int action, int mods);
  void on_character(unsigned code_point);
  void on_button(int button, int action, int mods);
  void on_move(double x, double y);
  void on_scroll(double steps);
  static Controls& of(GLFWwindow* window);
  [[nodiscard]] HeldKeys held_keys() const;
  [[nodiscard]] bool down(int key) const;

  GLFWwindow* window_;
  Rig& rig_;
  PointUnder point_under_;
  std::vector<Action> actions_;
  double x_ = 0, y_ = 0;
  bool dragging_ = false, second_ = false, moved_ = false, mouse_taken_ = false;
  bool events_ = true;
};

}  // namespace darm::client::desktop

// What is written over the picture: a few buttons, the panel of measurements, the notice, the help. The only place that
// sees Dear ImGui.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "client/core/result.hpp"
#include "client/desktop/controls.hpp"
#include "client/desktop/figures.hpp"
#include "client/desktop/reunion.hpp"

namespace darm::client::desktop {

struct OverlayShow {
  bool bare = false;  ///< nothing but what must be said
  bool panel = false;
  bool help = false;
  Mode mode = Mode::kWalk;
  PanelLines lines, brief;  ///< brief: where the window is too small for all
  Notice notice;
};

/// Made after the controls, whose events it passes on. Needs the window's GL context current at every call, destruction
/// included. Leaves no GL error behind, and GL's state as it was.
class Overlay {
 public:
  [[nodiscard]] static Result<std::unique_ptr<Overlay>> create(Window& window);
  ~Overlay();
  Overlay(const Overlay&) = delete;
  Overlay& operator=(const Overlay&) = delete;

  /// Draws over what the window's framebuffer holds; gives what was clicked.
  [[nodiscard]] std::vector<Action> draw(const OverlayShow& show);
  /// The mouse is on a button or the panel.
  [[nodiscard]] bool takes_mouse() const;

 private:
  Overlay() = default;
  static void lay_out(const OverlayShow& show, std::vector<Action>& clicked);
  bool glfw_ = false, gl_ = false;
};

}  // namespace darm::client::desktop

// One visit: ties the stream, the picture, the camera and what is written over it together.
#pragma once

#include <filesystem>
#include <optional>

#include "client/core/connection.hpp"
#include "client/desktop/upright_view.hpp"
#include "client/desktop/window.hpp"

namespace darm::client::desktop {

struct VisitPlan {
  ConnectOptions server;
  WindowPlan window;
  std::optional<UprightView> view;   ///< where to begin; nothing: where the scene says
  bool panel = false;                ///< measurements shown from the start
  bool bare = false;                 ///< nothing over the picture
  bool finest = false;               ///< no frame-rate guard: each picture has all the window's pixels
  double turn = 0;                   ///< degrees a second by which the view turns by itself
  std::optional<double> seconds;     ///< leave after so long
  std::filesystem::path screenshot;  ///< PNG written on leaving after `seconds`; empty: none
  std::filesystem::path report;      ///< JSON of the figures, written on leaving; "-": standard output; empty: none
};

/// Runs until the window is closed or the time is over. Error: no window, the GL refuses, a file cannot be written, or
/// there was no whole picture for the screenshot. A server that is away is no error: it is waited for.
[[nodiscard]] Result<void> visit(const VisitPlan& plan);

}  // namespace darm::client::desktop

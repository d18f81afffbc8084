// How much may be written over a window before nothing is left of the scene. Pure.
#pragma once

#include <cstdint>

namespace darm::client::desktop {

struct Extent {
  float width = 0, height = 0;
};

enum class PanelForm : std::uint8_t { kWhole, kBrief, kNone };

/// The fullest form of the panel that lies within `room` and covers no more than a third of it.
[[nodiscard]] PanelForm panel_form(Extent room, Extent whole, Extent brief);

/// By what a sheet of this size is to be shrunk, so that it lies within `room`: 1 if it does as it is. Never less than
/// a half, under which nothing can be read.
[[nodiscard]] float shrunk(Extent room, Extent sheet);

/// Two sheets in opposite corners of `room` do not lie over each other, `gap` between them.
[[nodiscard]] bool apart(Extent room, Extent a, Extent b, float gap);

}  // namespace darm::client::desktop

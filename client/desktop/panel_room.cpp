#include "client/desktop/panel_room.hpp"

#include <algorithm>

namespace darm::client::desktop {
namespace {

constexpr float kMostCovered = 1.0f / 3;
constexpr float kLeastScale = 0.5f;

bool fits(Extent room, Extent sheet) {
  return sheet.width <= room.width && sheet.height <= room.height &&
         sheet.width * sheet.height <= kMostCovered * room.width * room.height;
}

}  // namespace

PanelForm panel_form(Extent room, Extent whole, Extent brief) {
  if (fits(room, whole)) return PanelForm::kWhole;
  return fits(room, brief) ? PanelForm::kBrief : PanelForm::kNone;
}

float shrunk(Extent room, Extent sheet) {
  if (sheet.width <= 0 || sheet.height <= 0) return 1;
  return std::clamp(std::min(room.width / sheet.width, room.height / sheet.height), kLeastScale, 1.0f);
}

bool apart(Extent room, Extent a, Extent b, float gap) {
  return a.width + b.width + gap <= room.width || a.height + b.height + gap <= room.height;
}

}  // namespace darm::client::desktop

// A view as text, so that it can be shared. Pure. The text is the end of a link to the web client:
// "#view=x,y,z,yaw,pitch,fovy" (metres, degrees).
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "client/core/result.hpp"
#include "client/desktop/upright_view.hpp"

namespace darm::client::desktop {

/// Nine digits of a position: micrometres in a scene of a few metres, a millimetre in one of hundreds of kilometres.
[[nodiscard]] std::string to_link(const UprightView& view);
/// `text` ends in "#view=..." or is it (a whole link will do). Nothing: there is no view in it, or one that cannot be
/// drawn.
[[nodiscard]] std::optional<UprightView> from_link(std::string_view text);
/// A link, or a camera as the other commands take it: "px,py,pz tx,ty,tz fovy_degrees".
[[nodiscard]] Result<UprightView> read_view(std::string_view text);

}  // namespace darm::client::desktop

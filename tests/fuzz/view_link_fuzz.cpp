// links: darm_client_desktop
// Views as they stand in links and on the command line: any text gives a view that can be drawn, or none.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "client/desktop/view_link.hpp"

namespace {

void check(const darm::client::desktop::UprightView& v) {
  const double sum = v.position.x + v.position.y + v.position.z + v.yaw + v.pitch;
  if (!std::isfinite(sum) || !(v.fovy > 0 && v.fovy < darm::client::desktop::kPi)) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 1u << 16) return 0;
  const std::string_view text(reinterpret_cast<const char*>(data), size);
  if (const auto view = darm::client::desktop::from_link(text)) check(*view);
  const auto view = darm::client::desktop::read_view(text);
  if (view) check(*view);
  if (!view && view.error().message.empty()) std::abort();
  return 0;
}

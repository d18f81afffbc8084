// links: darm_config
// Camera SPEC of the command line: any text gives a valid camera or an error.
#include <cstdint>
#include <cstdlib>
#include <string_view>
#include <vector>

#include "daemon/config/camera_spec.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const std::vector<darm::config::Pose> poses{{"door", {1, 2, 3}, {4, 5, 6}, 50}};
  const auto camera = darm::config::parse_camera_spec({reinterpret_cast<const char*>(data), size}, poses, {});
  if (camera ? !darm::is_valid(*camera) : camera.error().message.empty()) std::abort();
  return 0;
}

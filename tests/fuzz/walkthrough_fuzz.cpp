// links: darm_config
// Walkthrough JSON: any bytes give a path whose cameras are all valid, or an error.
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/config/walkthrough.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 1u << 16) return 0;
  const auto path = darm::config::Walkthrough::parse({reinterpret_cast<const char*>(data), size}, "fuzz.json");
  if (!path) {
    if (path.error().message.empty()) std::abort();
    return 0;
  }
  const double length = path->end() - path->start();
  for (int i = -1; i <= 11; ++i)
    if (!darm::is_valid(path->camera_at(path->start() + length * i / 10))) std::abort();
  return 0;
}

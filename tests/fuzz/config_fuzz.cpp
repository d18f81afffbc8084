// links: darm_config
// TOML configuration: any bytes give a Config in range or faults that name their line; never a crash.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/config/load.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 1u << 16) return 0;
  const auto loaded = darm::config::parse({reinterpret_cast<const char*>(data), size}, "fuzz.toml");
  if (!loaded) {
    if (loaded.error().empty() || darm::config::to_string(loaded.error()).empty()) std::abort();
    return 0;
  }
  for (const auto& pose : loaded->cameras)
    if (!std::isfinite(pose.position.x + pose.position.y + pose.position.z) || pose.fovy_degrees < 1) std::abort();
  if (loaded->stream.crf > 51 || loaded->listen.tcp_port < 0) std::abort();
  return 0;
}

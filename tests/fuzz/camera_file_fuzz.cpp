// links: darm_client_core
// A client's own readers of set-ups and walkthroughs: any bytes give cameras that can be drawn, or an error that says
// something.
#include <cmath>
#include <cstdint>
#include <cstdlib>

#include "client/core/camera_path.hpp"
#include "tests/fuzz/file_of_bytes.hpp"

namespace {

void check(const darm::client::CameraKey& key) {
  const auto p = key.position;
  if (!std::isfinite(key.t + p.x + p.y + p.z) || !(key.fovy > 0 && key.fovy < 180) || key.position == key.target)
    std::abort();
}

template <class Cameras>
void check(const darm::client::Result<Cameras>& cameras) {
  if (!cameras) {
    if (cameras.error().message.empty()) std::abort();
  } else if constexpr (requires { cameras->begin(); }) {
    for (const auto& key : *cameras) check(key);
  } else {
    check(*cameras);
  }
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size > 1u << 16) return 0;
  const darm::fuzz::FileOfBytes file({reinterpret_cast<const char*>(data), size});
  check(darm::client::read_camera("door", file.path()));
  check(darm::client::read_load_groups(file.path()));
  check(darm::client::read_load_cameras(file.path()));
  check(darm::client::read_walkthrough(file.path()));
  return 0;
}

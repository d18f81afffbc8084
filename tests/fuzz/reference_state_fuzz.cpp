// links: darm_renderer
// The kept sums of an unfinished reference picture, with foreign bytes over them: what is read is what was written, or
// is refused.
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <iterator>

#include "actors/renderer/reference_state.hpp"
#include "tests/fuzz/file_of_bytes.hpp"

namespace {

using namespace darm::renderer;

ReferenceState some_state() {
  ReferenceState state(7, 3, 2);
  state.passes = 4;
  state.seconds = 1;
  for (auto& half : state.halves)
    for (auto& q : half) q.add(glm::vec3(0.5f));
  return state;
}

std::string sound_file() {
  const auto path = std::filesystem::temp_directory_path() / ("darm_state_fuzz_" + std::to_string(::getpid()));
  if (!save_state(path, some_state())) std::abort();
  std::ifstream in(path, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(in), std::istreambuf_iterator<char>()};
  std::filesystem::remove(path);
  return bytes;
}

void read(const std::string& bytes) {
  ReferenceState state(7, 3, 2);
  const auto read = load_state(darm::fuzz::FileOfBytes(bytes).path(), state);
  if (read ? state.passes != 4 || state.halves[1][5].mean.y != 0.5f : state.passes != 0 || read.error().message.empty())
    std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static const std::string sound = sound_file();
  if (size > 1u << 16) return 0;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  read(bytes);
  read(darm::fuzz::written_over(sound, bytes));
  return 0;
}

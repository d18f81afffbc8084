// links: darm_atlas
// Any bytes: the decoder answers with a layout whose every index is in range, or with an error.
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <span>
#include <vector>

#define XXH_INLINE_ALL
#include <xxhash.h>

#include "actors/atlas/layout_cache.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  const auto bytes = std::as_bytes(std::span(data, size));
  (void)darm::atlas::decode_layout(bytes);
  // The same bytes behind a valid header, so that the tables are reached.
  std::vector<std::byte> whole(32 + size);
  const std::uint64_t head[] = {0x31594c4d52414400ull, 1, size, XXH3_64bits(data, size)};
  std::memcpy(whole.data(), head, sizeof head);
  if (size > 0) std::memcpy(whole.data() + 32, data, size);
  if (const auto layout = darm::atlas::decode_layout(whole)) {
    for (std::uint32_t i = 0; i < (*layout)->instances.size(); ++i) {
      const auto& chart = (*layout)->charts[(*layout)->instances[i].chart];
      for (std::uint32_t t = 0; t < chart.uv.size(); ++t) {
        const auto patch = (*layout)->patch_of(i, t, true);
        if (patch == darm::kNoPatch) continue;
        const auto at = (*layout)->texel_at(patch, 0, (*layout)->patch_uv(i, t, 0.3f, 0.3f));
        (void)(*layout)->tile_at(0, at);
      }
    }
  }
  return 0;
}

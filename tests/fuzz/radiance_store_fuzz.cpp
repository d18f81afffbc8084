// links: darm_atlas
// Foreign bytes over the header, directory and first blocks of a radiance store: opening and reading never crash, and
// what is read is finite.
#include <unistd.h>

#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <string>

#include "actors/atlas/radiance_store.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace darm::atlas;
  static const auto dir = std::filesystem::temp_directory_path() / ("darm_store_fuzz_" + std::to_string(::getpid()));
  static const std::vector<std::uint32_t> tiles{6, 2};
  const StoreKey key{1, 2, 3};
  if (size < 2) return 0;
  std::filesystem::remove_all(dir);
  {
    auto store = RadianceStore::open(dir, key, tiles);
    if (!store) return 0;
    auto update = (*store)->begin_update(darm::TileId(0, 1));
    TexelBatch b;
    if (update && b.add(glm::vec3(1.0f))) update->merge(3, Layer::kSoft, b);
  }
  {
    // The first two bytes choose where the rest goes, in steps of four bytes: header, directory or block.
    std::fstream f(dir / RadianceStore::file_name(key), std::ios::in | std::ios::out | std::ios::binary);
    f.seekp((data[0] | data[1] << 8) % 3000 * 4);
    f.write(reinterpret_cast<const char*>(data + 2), static_cast<std::streamsize>(size - 2));
  }
  auto store = RadianceStore::open(dir, key, tiles);
  if (store) {
    for (std::uint32_t i = 0; i < 8; ++i) {
      const darm::TileId tile(i < 6 ? 0 : 1, i < 6 ? i : i - 6);
      const auto view = (*store)->read(tile);
      for (int t = 0; view && t < darm::kTileTexels; ++t)
        if (!std::isfinite(view->mean(Layer::kSoft, t).x)) std::abort();
      auto update = (*store)->begin_update(tile);
      TexelBatch b;
      if (update && b.add(glm::vec3(2.0f))) update->merge(0, Layer::kSharp, b);
    }
  }
  store = {};
  std::filesystem::remove_all(dir);
  return 0;
}

// Walls between the texels of a tile are found where they stand, and nowhere else.
#include "actors/renderer/tile_walls.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>
#include <vector>

#include "tests/unit/renderer_light/hand_tiles.hpp"

namespace darm::renderer {
namespace {

TEST(SearchLine, finds_every_wall_and_looks_no_more_than_it_must) {
  for (const std::vector<int>& walls : {std::vector<int>{}, {0}, {30}, {13}, {4, 5, 22}}) {
    int looks = 0;
    std::vector<int> found;
    search_line(
        0, 31,
        [&](int a, int b) {
          ++looks;
          return std::ranges::none_of(walls, [&](int w) { return a <= w && w < b; });
        },
        [&](int k) { found.push_back(k); });
    EXPECT_EQ(found, walls);
    EXPECT_LE(looks, 1 + 10 * static_cast<int>(walls.size()));
  }
  search_line(3, 3, [](int, int) { return false; }, [](int) { FAIL() << "a line of one point"; });
}

// The floor's texels in the atlas: where each lies, and what the tiles say stands between them.
class Floor {
 public:
  Floor(float wall, float q) : hand_(parted_floor(wall)), tiles_(hand_, q), wall_(wall) {
    const auto& level = tiles_.layout->levels[0];
    width_ = static_cast<int>(level.tiles_x) * kTileSize;
    height_ = static_cast<int>(level.tiles_y) * kTileSize;
    across_.resize(static_cast<std::size_t>(width_ * height_));
    tiles_.each_tile(0, [&](std::uint32_t tile, const TileSurface& surface) {
      walls_.push_back(surface.walls());
      const auto texels = tiles_.mapper->tile(TileId(0, tile));
      for (int t = 0; t < kTileTexels; ++t) {
        const int x = t % kTileSize, y = t / kTileSize;
        const auto middle = texels->center(x, y);
        if (!middle || middle->instance != 0 || !middle->front || texels->is_gutter(x, y)) continue;
        across_[static_cast<std::size_t>(place(tile, x, y))] =
            trace::make_unbent_surface(*tiles_.rays, *middle).position.x - wall_;
      }
    });
  }
  // Of all pairs of neighbours, in rows and in columns: those that say wrongly that something stands between them, or
  // that nothing does. Texels with the wall in their middle see nothing, and may say either.
  void judge(int& right, int& missed, int& made_up) const {
    for (int y = 0; y + 1 < height_; ++y)
      for (int x = 0; x + 1 < width_; ++x)
        for (const bool row : {true, false}) {
          const auto& a = across_[static_cast<std::size_t>(y * width_ + x)];
          const auto& b = across_[static_cast<std::size_t>((row ? y : y + 1) * width_ + (row ? x + 1 : x))];
          if (!a || !b || std::abs(*a) < 0.01f || std::abs(*b) < 0.01f) continue;
          const bool stands = (*a < 0) != (*b < 0);
          const bool said = row ? parted_at(walls_[tile_of(x, y)].rows, walls_[tile_of(x + 1, y)].rows, y, x)
                                : parted_at(walls_[tile_of(x, y)].columns, walls_[tile_of(x, y + 1)].columns, x, y);
          (stands == said ? right : stands ? missed : made_up) += 1;
          stands_ += stands ? 1 : 0;
        }
  }
  [[nodiscard]] int stands() const { return stands_; }

 private:
  [[nodiscard]] int place(std::uint32_t tile, int x, int y) const {
    const auto in_row = static_cast<std::uint32_t>(width_ / kTileSize);
    return (static_cast<int>(tile / in_row) * kTileSize + y) * width_ + static_cast<int>(tile % in_row) * kTileSize + x;
  }
  [[nodiscard]] std::size_t tile_of(int x, int y) const {
    return static_cast<std::size_t>(y / kTileSize * (width_ / kTileSize) + x / kTileSize);
  }
  // Between texel `along` of a line and the next, which may be another tile's.
  static bool parted_at(const std::array<std::uint32_t, kTileSize>& first,
                        const std::array<std::uint32_t, kTileSize>& second, int line, int along) {
    const auto of = static_cast<std::size_t>(line % kTileSize);
    const int bit = along % kTileSize + 1;
    const bool before = (first[of] >> bit & 1u) != 0;
    return before || (bit == kTileSize && (second[of] & 1u) != 0);
  }

  test::HandScene hand_;
  HandTiles tiles_;
  float wall_;
  int width_ = 0, height_ = 0;
  std::vector<std::optional<float>> across_;
  std::vector<TileWalls> walls_;
  mutable int stands_ = 0;
};

// 64 places of the wall beside the borders of tiles and texels.
TEST(TileWalls, stand_between_the_texels_that_a_wall_parts_wherever_it_stands) {
  int right = 0, missed = 0, made_up = 0, stand = 0;
  for (int i = 0; i < 64; ++i) {
    const Floor floor(-1.5f + 0.047f * static_cast<float>(i), 16);
    floor.judge(right, missed, made_up);
    stand += floor.stands();
  }
  EXPECT_EQ(missed, 0);
  EXPECT_EQ(made_up, 0);
  EXPECT_GT(right, 100'000);
  EXPECT_GT(stand, 2'000);
}

TEST(TileWalls, a_curved_surface_is_no_wall_to_itself) {
  auto hand = round_column();
  const HandTiles column(hand, 24);
  int looked = 0;
  column.each_tile(0, [&](std::uint32_t tile, const TileSurface& surface) {
    EXPECT_EQ(surface.walls(), TileWalls{}) << tile;
    ++looked;
  });
  EXPECT_GT(looked, 2);
}

}  // namespace
}  // namespace darm::renderer

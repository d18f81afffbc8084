// Texels and the surface are two names for the same points.
#include "actors/atlas/texel_map.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>
#include <thread>

#include "actors/atlas/build_layout.hpp"
#include "actors/atlas/shelf_pack.hpp"
#include "actors/atlas/working_set.hpp"
#include "tests/unit/atlas/hand_made_scenes.hpp"

namespace darm::atlas {
namespace {

using namespace testing;

struct World {
  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const Layout> layout;
};

World world(std::vector<scene::Mesh> meshes, float q, bool double_sided = false) {
  World w;
  w.scene = std::make_shared<scene::Scene>(scene_of(std::move(meshes), double_sided));
  auto made = build_layout(*w.scene, {.q = q});
  EXPECT_TRUE(made.has_value());
  if (made) w.layout = *made;
  return w;
}

glm::vec2 texel_of(const Layout& l, const SurfacePoint& p, int level) {
  return l.texel_at(l.patch_of(p.instance, p.triangle, p.front), level, l.patch_uv(p.instance, p.triangle, p.u, p.v));
}

template <class Visit>
void for_each_texel(const TexelMapper& mapper, const Visit& visit) {
  const auto& l = mapper.layout();
  for (int level = 0; level < static_cast<int>(l.levels.size()); ++level) {
    const auto& v = l.levels[static_cast<std::size_t>(level)];
    for (std::uint32_t i = 0; i < v.tiles_x * v.tiles_y; ++i) {
      const auto tile = mapper.tile(TileId(level, i));
      const glm::vec2 corner(static_cast<float>(i % v.tiles_x * kTileSize),
                             static_cast<float>(i / v.tiles_x * kTileSize));
      for (int y = 0; y < kTileSize; ++y)
        for (int x = 0; x < kTileSize; ++x) visit(*tile, level, x, y, corner);
    }
  }
}

TEST(TexelMap, ATexelsCentreLeadsToTheSurfaceAndBack) {
  const auto w = world({sphere(1, 16), box({3, 0, 0}, {4, 1, 2}), helix(3, 0.05f)}, 24);
  const TexelMapper mapper(w.scene, w.layout);
  std::uint64_t inside = 0;
  for_each_texel(mapper, [&](const TileTexels& t, int level, int x, int y, glm::vec2 corner) {
    const auto patch = t.patch_at(x, y);
    const auto point = t.center(x, y);
    ASSERT_EQ(point.has_value(), patch != kNoPatch);
    if (!point) return;
    EXPECT_EQ(w.layout->patch_of(point->instance, point->triangle, point->front), patch);
    const auto back = texel_of(*w.layout, *point, level);
    const glm::vec2 centre = corner + glm::vec2(static_cast<float>(x), static_cast<float>(y)) + 0.5f;
    const auto off = glm::abs(back - centre);
    if (t.is_gutter(x, y)) {
      EXPECT_LT(glm::length(off), 1.415f);  // the corner of the ring is the farthest
    } else {
      ++inside;
      EXPECT_LT(glm::length(off), 0.708f);  // the corner of the texel is the farthest
    }
  });
  EXPECT_GT(inside, 1000u);
}

TEST(TexelMap, JitteredSamplesStayInTheirTexelWhereTheSurfaceFillsIt) {
  const auto w = world({box({0, 0, 0}, {3, 3, 3})}, 16);
  const TexelMapper mapper(w.scene, w.layout);
  const glm::vec2 xi(0.83f, 0.21f);
  std::uint64_t exact = 0;
  for_each_texel(mapper, [&](const TileTexels& t, int level, int x, int y, glm::vec2 corner) {
    const auto point = t.sample(x, y, xi);
    if (!point || t.is_gutter(x, y)) return;
    const auto back = texel_of(*w.layout, *point, level);
    const glm::vec2 wanted = corner + glm::vec2(static_cast<float>(x), static_cast<float>(y)) + xi;
    exact += glm::length(back - wanted) < 0.01f;
  });
  EXPECT_GT(exact, 6u * 45 * 45);
}

TEST(TexelMap, EveryBilinearTapOfTheSurfaceReadsATexelOfItsPatch) {
  const auto w = world({triangle_soup(3, 200)}, 20, true);
  const TexelMapper mapper(w.scene, w.layout);
  std::mt19937 random(5);
  const auto roll = [&] { return static_cast<float>(random() >> 8) / 16777216.0f; };
  for (int i = 0; i < 20000; ++i) {
    const auto triangle = static_cast<std::uint32_t>(random() % 200);
    float u = roll(), v = roll();
    if (u + v > 1) u = 1 - u, v = 1 - v;
    const bool front = random() % 2;
    const auto patch = w.layout->patch_of(0, triangle, front);
    if (patch == kNoPatch) continue;
    const int level = static_cast<int>(random() % w.layout->levels.size());
    const auto& l = w.layout->levels[static_cast<std::size_t>(level)];
    const auto at = w.layout->texel_at(patch, level, w.layout->patch_uv(0, triangle, u, v)) - 0.5f;
    for (int k = 0; k < 4; ++k) {
      // A tap that weighs less than a thousandth is rounding.
      const auto x = static_cast<std::uint32_t>(std::floor(at.x + (k & 1 ? 0.999f : 0.001f)));
      const auto y = static_cast<std::uint32_t>(std::floor(at.y + (k & 2 ? 0.999f : 0.001f)));
      ASSERT_LT(x, l.width);
      ASSERT_LT(y, l.height);
      const auto tile = mapper.tile(TileId(level, y / kTileSize * l.tiles_x + x / kTileSize));
      EXPECT_EQ(tile->patch_at(static_cast<int>(x % kTileSize), static_cast<int>(y % kTileSize)), patch);
    }
  }
}

TEST(TexelMap, APatchOfOneTexelIsSampledAllOver) {
  // Nine quads bent a little, 0.9 texel wide: one texel, eighteen triangles of equal size.
  const auto w = world({sheet(3, 3, [](float u, float v) { return glm::vec3(0.09f * u, 0, -0.09f * v); })}, 10);
  ASSERT_EQ(w.layout->patch_count, 1u);
  ASSERT_EQ(w.layout->levels[0].placements[0].scale, 0);
  const TexelMapper mapper(w.scene, w.layout);
  const auto tile = mapper.tile(TileId(0, 0));
  std::vector<int> hits(18);
  for (int i = 0; i < 1800; ++i) {
    const auto p = tile->sample(0, 0, {(static_cast<float>(i) + 0.5f) / 1800.0f, 0.3f});
    ASSERT_TRUE(p);
    ++hits[p->triangle];
  }
  for (const int h : hits) EXPECT_NEAR(h, 100, 3);
  EXPECT_TRUE(tile->center(0, 0));
  EXPECT_EQ(tile->patch_at(1, 0), kNoPatch);
}

TEST(TexelMap, KeepsNoMoreThanItsBytes) {
  const auto w = world({box({0, 0, 0}, {10, 10, 10})}, 24);
  const TexelMapper mapper(w.scene, w.layout, 200'000);
  const auto& l = w.layout->levels[0];
  std::vector<std::jthread> crew;
  for (int k = 0; k < 2; ++k)
    crew.emplace_back([&] {
      for (std::uint32_t i = 0; i < l.tiles_x * l.tiles_y; ++i) EXPECT_NE(mapper.tile(TileId(0, i)), nullptr);
    });
  crew.clear();
  EXPECT_LE(mapper.cached_bytes(), 200'000u);
  EXPECT_GT(mapper.cached_bytes(), 0u);
}

TEST(TexelMap, TilesThatAreNotThereAreEmpty) {
  const auto w = world({box({0, 0, 0}, {1, 1, 1})}, 8);
  const TexelMapper mapper(w.scene, w.layout);
  EXPECT_EQ(mapper.tile(TileId(0, 1'000'000))->patch_at(0, 0), kNoPatch);
  EXPECT_EQ(mapper.tile(TileId(15, 0))->patch_at(29, 29), kNoPatch);
  EXPECT_FALSE(mapper.tile(TileId(15, 0))->center(3, 3));
}

TEST(WorkingSet, ATapReadsTheTexelsItsWeightsName) {
  const auto w = world({box({0, 0, 0}, {1, 1, 1})}, 8);
  WorkingSetCounter counter(*w.layout);
  EXPECT_EQ(counter.efficiency(), 0);
  counter.add(PatchId{0}, 0, {0.5f / 8, 0.5f / 8});
  EXPECT_EQ(counter.texels(), 4u);
  counter.add(PatchId{0}, 0, {0, 0});  // exactly on a texel that is already there
  EXPECT_EQ(counter.texels(), 4u);
  EXPECT_GE(counter.tiles(), 1u);
}

TEST(ShelfPack, BoxesOfThePaperDoNotOverlap) {
  const auto w = world({triangle_soup(11, 300)}, 20);
  const auto paper = shelf_pack(*w.layout);
  EXPECT_EQ(paper.width & (paper.width - 1), 0u);
  std::vector<std::uint32_t> owner(static_cast<std::size_t>(paper.width) * paper.height, index_of(kNoPatch));
  const auto& chart = w.layout->charts[0];
  for (std::uint32_t p = 0; p < w.layout->patch_count; ++p) {
    const auto& place = paper.placements[p];
    const auto size = chart.patch_size[p] * (place.scale * paper.density);
    for (auto y = place.y; y <= place.y + static_cast<std::uint32_t>(std::ceil(size.y)); ++y)
      for (auto x = place.x; x <= place.x + static_cast<std::uint32_t>(std::ceil(size.x)); ++x) {
        ASSERT_LT(x, paper.width);
        ASSERT_LT(y, paper.height);
        auto& o = owner[static_cast<std::size_t>(y) * paper.width + x];
        ASSERT_EQ(o, index_of(kNoPatch));
        o = p;
      }
  }
}

}  // namespace
}  // namespace darm::atlas

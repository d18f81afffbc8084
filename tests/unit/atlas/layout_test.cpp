// What every layout must hold, whatever the scene.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <glm/geometric.hpp>
#include <map>

#include "actors/atlas/build_layout.hpp"
#include "actors/atlas/footprint.hpp"
#include "actors/atlas/layout_cache.hpp"
#include "actors/scene/gltf_loader.hpp"
#include "tests/unit/atlas/hand_made_scenes.hpp"

namespace darm::atlas {
namespace {

using namespace testing;

std::shared_ptr<const Layout> built(const scene::Scene& s, float q, unsigned threads = 1) {
  auto layout = build_layout(s, {.q = q, .threads = threads});
  EXPECT_TRUE(layout.has_value()) << (layout ? "" : layout.error().message);
  return layout ? *layout : nullptr;
}

/// Own texels by their definition, from the triangles: the distance of a centre to the surface is under one texel.
void expect_no_texel_claimed_twice(const Layout& l) {
  for (std::size_t level = 0; level < l.levels.size(); ++level) {
    const auto& v = l.levels[level];
    std::vector<std::uint32_t> owner(static_cast<std::size_t>(v.width) * v.height, index_of(kNoPatch));
    std::uint64_t doubled = 0, outside = 0;
    for (std::uint32_t i = 0; i < l.instances.size(); ++i) {
      const auto& chart = l.charts[l.instances[i].chart];
      for (std::uint32_t t = 0; t < chart.uv.size(); ++t) {
        for (const bool front : {true, false}) {
          const auto patch = l.patch_of(i, t, front);
          if (patch == kNoPatch) continue;
          const auto& place = v.placements[index_of(patch)];
          std::array<glm::vec2, 3> c;
          for (std::size_t k = 0; k < 3; ++k) c[k] = chart.uv[t][k] * (place.scale * v.density);
          const auto y1 = static_cast<int>(std::ceil(std::max({c[0].y, c[1].y, c[2].y}) + 1)) - 1;
          for (int y = std::max(0, static_cast<int>(std::floor(std::min({c[0].y, c[1].y, c[2].y}) - 1)) + 1); y <= y1;
               ++y) {
            float lo = 0, hi = 0;
            const auto fy = static_cast<float>(y);
            if (!extent_in_slab(c, fy - 0.9999f, fy + 0.9999f, lo, hi)) continue;
            for (int x = std::max(0, static_cast<int>(std::floor(lo - 0.9999f)) + 1);
                 static_cast<float>(x) < hi + 0.9999f; ++x) {
              const auto ax = place.x + static_cast<std::uint32_t>(x), ay = place.y + static_cast<std::uint32_t>(y);
              if (ax >= v.width || ay >= v.height) {
                ++outside;
                continue;
              }
              auto& o = owner[static_cast<std::size_t>(ay) * v.width + ax];
              doubled += o != index_of(kNoPatch) && o != index_of(patch);
              o = index_of(patch);
            }
          }
        }
      }
    }
    EXPECT_EQ(doubled, 0u) << "level " << level;
    EXPECT_EQ(outside, 0u) << "level " << level;
  }
}

double twice_area(const std::array<glm::vec2, 3>& t) {
  const glm::dvec2 a(t[1] - t[0]), b(t[2] - t[0]);
  return a.x * b.y - a.y * b.x;
}

void expect_sound_charts(const scene::Scene& s, const Layout& l) {
  for (const auto& chart : l.charts) {
    const auto& mesh = s.meshes[chart.mesh];
    std::vector<double> flat(chart.patch_count), space(chart.patch_count);
    for (std::size_t t = 0; t < chart.uv.size(); ++t) {
      const auto p = chart.local_patch[t];
      if (p == kDroppedTriangle) continue;
      EXPECT_GT(twice_area(chart.uv[t]), -1e-7) << "flipped triangle " << t;
      flat[p] += twice_area(chart.uv[t]);
      const auto& k = mesh.triangles[t];
      const glm::dvec3 a(mesh.positions[k.x]), b(mesh.positions[k.y]), c(mesh.positions[k.z]);
      space[p] += glm::length(glm::cross(b - a, c - a));
      for (const auto& q : chart.uv[t]) {
        EXPECT_GE(q.x, 0);
        EXPECT_GE(q.y, 0);
        EXPECT_LE(q.x, chart.patch_size[p].x * 1.00001f);
        EXPECT_LE(q.y, chart.patch_size[p].y * 1.00001f);
      }
    }
    for (std::size_t p = 0; p < flat.size(); ++p)
      EXPECT_NEAR(flat[p], space[p], 0.01 * space[p] + 1e-9) << "patch " << p;
  }
}

void expect_sound(const scene::Scene& s, float q) {
  const auto l = built(s, q);
  ASSERT_TRUE(l);
  expect_no_texel_claimed_twice(*l);
  expect_sound_charts(s, *l);
  EXPECT_LE(std::uint64_t{l->levels.back().width} * l->levels.back().height, kCoarseTexels);
}

TEST(Layout, ABoxHasSixPatchesOfItsFaces) {
  const auto s = scene_of({box({0, 0, 0}, {1, 2, 3})});
  const auto l = built(s, 16);
  EXPECT_EQ(l->patch_count, 6u);
  EXPECT_NEAR(l->surface_area, 22, 1e-4);
  expect_sound(s, 16);
}

TEST(Layout, NoTexelIsClaimedTwiceInTriangleSoups) {
  for (std::uint32_t seed = 1; seed <= 5; ++seed) expect_sound(scene_of({triangle_soup(seed, 400)}, seed % 2), 24);
}

TEST(Layout, RoundRingedAndCoilingShapesEndValidly) {
  expect_sound(scene_of({sphere(2, 24)}), 20);
  expect_sound(scene_of({annulus(1, 1.2f, 64)}), 20);
  expect_sound(scene_of({helix(5, 0.02f)}), 20);
  expect_sound(
      scene_of({sheet(
          60, 60, [](float u, float v) { return glm::vec3(10 * u, std::sin(20 * u) * std::cos(17 * v), 10 * v); })}),
      16);
}

TEST(Layout, AHelixOverItselfIsCutIntoSeveralPatches) {
  const auto l = built(scene_of({helix(5, 0.02f)}), 20);
  EXPECT_GE(l->patch_count, 5u);
}

TEST(Layout, OneTriangleIsOnePatch) {
  scene::Mesh m;
  m.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  m.triangles = {{0, 1, 2}};
  const auto s = scene_of({m});
  EXPECT_EQ(built(s, 8)->patch_count, 1u);
  expect_sound(s, 8);
}

TEST(Layout, DuplicateTrianglesGetTexelsOfTheirOwn) {
  scene::Mesh m;
  m.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {1, 1, 0}};
  m.triangles = {{0, 1, 2}, {0, 1, 2}, {1, 3, 2}};
  const auto l = built(scene_of({m}), 8);
  EXPECT_NE(l->charts[0].local_patch[0], l->charts[0].local_patch[1]);
}

TEST(Layout, DegenerateTrianglesAreDroppedAndCounted) {
  scene::Mesh m;
  m.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {2, 0, 0}, {0, std::nanf(""), 0}};
  m.triangles = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {1, 1, 2}};
  const auto l = built(scene_of({m}), 8);
  EXPECT_EQ(l->charts[0].local_patch[1], kDroppedTriangle);
  std::map<std::string, std::uint64_t> reasons;
  for (const auto& d : l->dropped) reasons[d.reason] = d.count;
  EXPECT_EQ(reasons["zero area"], 2u);
  EXPECT_EQ(reasons["not finite"], 1u);
}

TEST(Layout, BacksOfDoubleSidedMaterialsHavePatchesOfTheirOwn) {
  const auto l = built(scene_of({box({0, 0, 0}, {1, 1, 1})}, true), 8);
  EXPECT_EQ(l->patch_count, 12u);
  EXPECT_NE(l->patch_of(0, 0, true), l->patch_of(0, 0, false));
  EXPECT_NEAR(l->surface_area, 12, 1e-4);
}

TEST(Layout, InstancesOfEqualStretchShareAChart) {
  auto s = scene_of({box({0, 0, 0}, {1, 1, 1})});
  auto turned = s.instances[0];
  turned.to_world = glm::mat4(0, 0, -1, 0, 0, 1, 0, 0, 1, 0, 0, 0, 5, 6, 7, 1);
  auto twice = s.instances[0];
  twice.to_world = glm::mat4(2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1);
  s.instances.push_back(turned);
  s.instances.push_back(twice);
  const auto l = built(s, 8);
  EXPECT_EQ(l->charts.size(), 2u);
  EXPECT_EQ(l->instances[0].chart, l->instances[1].chart);
  EXPECT_NEAR(l->surface_area, 6 + 6 + 24, 1e-3);
}

TEST(Layout, DoesNotDependOnTheThreadCount) {
  const auto s = scene_of({triangle_soup(7, 600), sphere(3, 20), helix(3, 0.03f)});
  EXPECT_EQ(encode_layout(*built(s, 40, 1)), encode_layout(*built(s, 40, 2)));
}

TEST(Layout, TooLargeQIsRefusedWithOneThatFits) {
  const auto s = scene_of({box({0, 0, 0}, {10, 10, 10})});
  const auto refused = build_layout(s, {.q = 1000, .max_texels = 1'000'000});
  ASSERT_FALSE(refused.has_value());
  const auto& text = refused.error().message;
  const auto at = text.rfind(' ');
  const float fits = std::stof(text.substr(at));
  EXPECT_GT(fits, 10) << text;
  EXPECT_TRUE(build_layout(s, {.q = fits, .max_texels = 1'000'000}).has_value()) << text;
}

TEST(Layout, AutomaticQIsAPowerOfTwoUnderItsBound) {
  const auto l = built(scene_of({box({0, 0, 0}, {100, 20, 100})}), 0);
  EXPECT_EQ(std::exp2(std::round(std::log2(l->q))), l->q);
  const auto texels = std::uint64_t{l->levels[0].width} * l->levels[0].height;
  EXPECT_LE(texels, kAutoTexels);
  EXPECT_GT(texels * 5, kAutoTexels);
}

TEST(Layout, AutomaticQGivesASmallSceneAsManyTexelsAsALargeOne) {
  const auto texels_of_box = [](float edge) {
    const auto l = built(scene_of({box({0, 0, 0}, {edge, edge, edge})}), 0);
    return std::uint64_t{l->levels[0].width} * l->levels[0].height;
  };
  const float small = std::ldexp(1.0f, -14);  // 61 micrometres, a power of two: the same texels exactly
  EXPECT_EQ(texels_of_box(small), texels_of_box(1));
}

TEST(Layout, ASceneWithoutSurfaceIsAnError) {
  EXPECT_FALSE(build_layout(scene_of({scene::Mesh{}}), {.q = 8}).has_value());
  EXPECT_FALSE(build_layout(scene_of({box({0, 0, 0}, {1, 1, 1})}), {.q = -1}).has_value());
  EXPECT_FALSE(build_layout(scene_of({box({0, 0, 0}, {1, 1, 1})}), {.q = std::nanf("")}).has_value());
}

class RealScene : public ::testing::TestWithParam<const char*> {};

TEST_P(RealScene, NoTexelIsClaimedTwiceAndNoTriangleFlips) {
  const auto file = std::filesystem::path(DARM_SHARED_SCENES) / "scenes" / GetParam();
  if (!std::filesystem::exists(file)) GTEST_SKIP() << file << " is not there";
  const auto loaded = scene::load_scene(file, {});
  ASSERT_TRUE(loaded.has_value()) << loaded.error().message;
  const auto l = built(**loaded, 8, 2);
  ASSERT_TRUE(l);
  expect_no_texel_claimed_twice(*l);
  for (const auto& chart : l->charts)
    for (std::size_t t = 0; t < chart.uv.size(); ++t)
      if (chart.local_patch[t] != kDroppedTriangle) {
        EXPECT_GT(twice_area(chart.uv[t]), -1e-6);
      }
}

INSTANTIATE_TEST_SUITE_P(Shared, RealScene, ::testing::Values("sponza.glb", "sibenik.glb", "quake_oacmpdm10.glb"));

}  // namespace
}  // namespace darm::atlas

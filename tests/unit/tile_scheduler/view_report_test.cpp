#include "actors/tile_scheduler/view_report.hpp"

#include <gtest/gtest.h>

#include <atomic>
#include <cmath>

#include "tests/unit/tile_scheduler/quad_scene.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr Viewport kViewport{160, 90};

// A 1 x 1 wall straight ahead, q = 64, one texel a pixel or more: every texel of the wall is read, 65 x 65 of them.
TEST(ViewReport, CountsEveryTexelOfAWallThatIsSeenWhole) {
  const auto world = testing::make_world({testing::Quad{{-0.5f, -0.5f, -1.4f}, {1, 0, 0}, {0, 1, 0}, 1, 1}}, 64, 1);
  const auto report = report_view(*world.layout, *world.rays, look_at({0, 0, 0}, {0, 0, -1}, 60), kViewport, 2);
  EXPECT_EQ(report.visible_texels, 65u * 65u);
  EXPECT_EQ(report.visible_tiles, 9u);
  EXPECT_NEAR(report.efficiency, 65.0 * 65.0 / (900 * 9), 1e-9);
}

TEST(ViewReport, IsTheSameForAnyNumberOfThreads) {
  const auto world = testing::make_room();
  const auto camera = look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55);
  const auto one = report_view(*world.layout, *world.rays, camera, kViewport, 1);
  const auto three = report_view(*world.layout, *world.rays, camera, kViewport, 3);
  EXPECT_EQ(one.visible_texels, three.visible_texels);
  EXPECT_EQ(one.visible_tiles, three.visible_tiles);
  EXPECT_GT(one.visible_tiles, 10u);
  EXPECT_NEAR(one.covered, three.covered, 1e-6);
}

TEST(ViewReport, SeesNothingInAnEmptyDirection) {
  const auto world = testing::make_room();
  const auto report = report_view(*world.layout, *world.rays, look_at({0, 50, 0}, {0, 100, 0}, 40), kViewport, 1);
  EXPECT_EQ(report.visible_texels, 0u);
  EXPECT_EQ(report.efficiency, 0.0);
  EXPECT_EQ(report.covered, 0.0);
}

TEST(ClientSamples, WeightsOfOneLayerSumToTheShareOfThePictureThatIsCovered) {
  const auto world = testing::make_world({testing::Quad{{-50, -50, -2}, {1, 0, 0}, {0, 1, 0}, 100, 100}}, 8, 2);
  double sum = 0;
  for_each_client_sample(*world.layout, *world.rays, look_at({0, 0, 0}, {0, 0, -1}, 60), kViewport, 1,
                         [&](unsigned, const SurfaceSample&, float weight) { sum += double(weight); });
  EXPECT_NEAR(sum, 1.0, 1e-4);
}

}  // namespace
}  // namespace darm::tile_scheduler

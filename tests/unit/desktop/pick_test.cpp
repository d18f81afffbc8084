#include "client/desktop/pick.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <glm/geometric.hpp>

#include "tests/unit/client/synthetic.hpp"

namespace darm::client::desktop {
namespace {

// The square of 2 x 2 in the plane z = 0, and again three times as large at (10, 0, -4).
SceneModel scene() {
  auto manifest = synthetic::manifest();
  auto large = synthetic::instance_at(10, 0, -4);
  for (const int i : {0, 5, 10}) large.set_to_world(i, 3);
  *manifest.add_instances() = large;
  auto made = SceneModel::from_manifest(manifest);
  EXPECT_TRUE(made);
  EXPECT_TRUE(made->add_chunk(synthetic::square_chunk()));
  return *made;
}

TEST(Pick, FindsTheNearestSurfaceWhateverTheInstancesScale) {
  const SceneModel s = scene();
  const auto near = pick(s, {1, 1, 5}, {0, 0, -1});
  ASSERT_TRUE(near);
  EXPECT_NEAR(*near, 5, 1e-9);
  const auto far = pick(s, {14, 5, 5}, {0, 0, -1});
  ASSERT_TRUE(far);
  EXPECT_NEAR(*far, 9, 1e-9);
}

TEST(Pick, MissesBesideAndBehind) {
  const SceneModel s = scene();
  EXPECT_FALSE(pick(s, {2.1, 1, 5}, {0, 0, -1}));
  EXPECT_FALSE(pick(s, {1, 1, 5}, {0, 0, 1}));
  EXPECT_FALSE(pick(s, {1, 1, 5}, {1, 0, 0}));
}

TEST(Pick, APointOfTheWindowIsThePointThatIsSeenThere) {
  const SceneModel s = scene();
  UprightView view;
  view.position = {1, 1, 5};
  const auto middle = point_under(s, view, 0, 0);
  ASSERT_TRUE(middle);
  EXPECT_LT(glm::distance(*middle, glm::dvec3(1, 1, 0)), 1e-9);
  const double height = 2 * 5 * std::tan(view.fovy / 2);
  const auto corner = point_under(s, view, 0.9 / height, -0.8 / height);
  ASSERT_TRUE(corner);
  EXPECT_LT(glm::distance(*corner, glm::dvec3(1.9, 0.2, 0)), 1e-9);
  EXPECT_FALSE(point_under(s, view, 1.1 / height, 0));
}

}  // namespace
}  // namespace darm::client::desktop

#include "actors/renderer/bright_texels.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "tests/unit/renderer_light/estimate.hpp"
#include "tests/unit/renderer_light/lit_room.hpp"

namespace darm::renderer {
namespace {

Estimate soft(const LitRoom& room, const SurfacePoint& point, const StoredLight& stored, std::uint32_t samples) {
  return estimate(samples, [&](Sampler& s) { return room.transport->soft_light(point, s, &stored).x; });
}

// What the ceiling's spot sends to a place that sees all of it, over pi: the stored light, bilinear between texels, at
// points a fifth of a texel apart.
double spot_at(const LitRoom& room, const trace::Surface& receiver) {
  constexpr double kStep = 1.0 / 320;
  double sum = 0;
  for (double dx = -0.4; dx < 0.4; dx += kStep)
    for (double dz = -0.4; dz < 0.4; dz += kStep) {
      const glm::vec3 at = spot_middle() + glm::vec3(static_cast<float>(dx), 0, static_cast<float>(dz));
      const SurfacePoint point = room.seen({at.x, 1.9f, at.z}, {0, 1, 0});
      const PatchId patch = room.layout->patch_of(point.instance, point.triangle, point.front);
      const int level = room.layout->coarse_level();
      const auto guess = room.plain->guess(
          patch, level,
          room.layout->texel_at(patch, level, room.layout->patch_uv(point.instance, point.triangle, point.u, point.v)));
      if (!guess) continue;
      const glm::dvec3 way = glm::dvec3(at) - glm::dvec3(receiver.position);
      const double square = glm::dot(way, way);
      const double cosines = glm::dot(way, glm::dvec3(receiver.normal)) * way.y / square;
      sum += (double{guess->soft.x} - double{kRoomLight}) * std::max(cosines, 0.0) / (M_PI * square) * kStep * kStep;
    }
  return LitRoom::kAlbedo * sum;
}

struct Place {
  const char* name;
  glm::vec3 from, direction;
};

// Five standard errors: fails by chance once in 1.7e6.
TEST(BrightTexels, AimedPathsBringWhatTheSpotSends) {
  const LitRoom room(spot_light);
  ASSERT_FALSE(room.aimed->bright().empty());
  for (const auto& [name, from, direction] :
       {Place{"floor under it", {-0.6f, 0, -0.4f}, {0, -1, 0}}, Place{"wall", {0, 0.3f, 0}, {-1, 0, 0}},
        Place{"high on the wall", {0, 1.6f, -0.4f}, {-1, 0, 0}}, Place{"top of the block", {1, 0, 1}, {0, -1, 0}}}) {
    const SurfacePoint point = room.seen(from, direction);
    const double truth = double{LitRoom::kAlbedo * kRoomLight} + spot_at(room, trace::make_surface(*room.rays, point));
    const Estimate aimed = soft(room, point, *room.aimed, 1u << 16);
    EXPECT_NEAR(aimed.mean, truth, 5 * aimed.error + 0.002 * truth) << name;
    const Estimate plain = soft(room, point, *room.plain, 1u << 14);
    EXPECT_NEAR(plain.mean, truth, 5 * plain.error) << name;
    EXPECT_LT(aimed.error * 256, plain.error * 128 / 10) << name << ": of one sample";
  }
}

TEST(BrightTexels, AimingChangesNothingWhereTheSpotIsNotSeen) {
  const LitRoom room(spot_light);
  for (const auto& [name, from, direction] :
       {Place{"ceiling beside it", {0.1f, 0, 0.1f}, {0, 1, 0}}, Place{"behind the block", {1.9f, -1.9f, 1}, {0, -1, 0}},
        Place{"side of the block", {1.9f, -1.5f, 1}, {-1, 0, 0}}})
    expect_agrees(soft(room, room.seen(from, direction), *room.aimed, 1u << 14), LitRoom::kAlbedo * kRoomLight);
}

TEST(BrightTexels, ThereAreNoneWhereRaysFindTheLightByChance) {
  const LitRoom even([](const glm::vec3&) { return 3.0f; });
  EXPECT_TRUE(even.aimed->bright().empty());
  const LitRoom sunny([](const glm::vec3& at) { return at.y < -1.9f && at.x < 0 ? 12.0f : 2.0f; });
  EXPECT_TRUE(sunny.aimed->bright().empty());
  const LitRoom dark([](const glm::vec3&) { return 0.0f; });
  EXPECT_TRUE(dark.aimed->bright().empty());
}

TEST(BrightTexels, NobodyAimsAtWhatFacesAway) {
  const LitRoom room(spot_light);
  const BrightTexels& bright = room.aimed->bright();
  EXPECT_GT(bright.aim({0, -2, 0}, {0, 1, 0}, kRoomLight).chance, 0.9f);
  EXPECT_EQ(bright.aim({0, -2, 0}, {0, -1, 0}, kRoomLight).chance, 0.0f) << "the receiver does";
  EXPECT_EQ(bright.aim({0, 3, 0}, {0, -1, 0}, kRoomLight).chance, 0.0f) << "it stands behind the ceiling";
  EXPECT_EQ(bright.aim({1, 2, 1}, {0, -1, 0}, kRoomLight).chance, 0.0f) << "it is the ceiling";
  EXPECT_EQ(bright.aim({0, -2, 0}, {0, 1, 0}, 1e6f).chance, 0.0f) << "other light is all that counts there";
}

}  // namespace
}  // namespace darm::renderer

// The effect plan names what a scene needs, with its reason.
#include "actors/scene/effect_plan.hpp"

#include <gtest/gtest.h>

#include <algorithm>

namespace darm::scene {
namespace {

Scene one_triangle() {
  Scene s;
  s.materials.resize(2);
  s.meshes.emplace_back();
  s.objects.push_back({"thing", true});
  s.instances.push_back({0, glm::mat4(1.0f), false, 0});
  return s;
}

const Effect& effect(const EffectPlan& plan, const std::string& name) {
  return *std::ranges::find_if(plan.effects, [&](const Effect& e) { return e.name == name; });
}

TEST(EffectPlan, NeedsNothingThatNoInstanceShows) {
  Scene s = one_triangle();
  s.materials[1].alpha_mode = AlphaMode::kMask;  // no mesh uses it
  const EffectPlan plan = plan_effects(s);
  EXPECT_FALSE(plan.alpha_test);
  EXPECT_EQ(effect(plan, "alpha test").reason, "no materials with alpha MASK");
  EXPECT_EQ(plan.effects.size(), 15u);
}

TEST(EffectPlan, GivesReasons) {
  Scene s = one_triangle();
  s.materials[0].alpha_mode = AlphaMode::kMask;
  s.lights.resize(3);
  const EffectPlan plan = plan_effects(s);
  EXPECT_TRUE(plan.alpha_test);
  EXPECT_EQ(effect(plan, "alpha test").reason, "1 material with alpha MASK");
  EXPECT_TRUE(plan.delta_lights);
  EXPECT_EQ(effect(plan, "delta lights").reason, "3 point, spot or directional lights");
  EXPECT_TRUE(plan.moving_bodies);
  EXPECT_TRUE(plan.moving_lights);
  EXPECT_FALSE(plan.sky);
}

}  // namespace
}  // namespace darm::scene

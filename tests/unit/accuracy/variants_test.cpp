#include "daemon/accuracy/variants.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "daemon/accuracy/recording.hpp"
#include "daemon/accuracy/result_key.hpp"

namespace darm::accuracy {
namespace {

StudyScope scope() {
  StudyScope s;
  s.config.accuracy = config::preset_of("reference");  // what is configured is not what a study starts from
  s.q = 64;
  s.plan.sky = s.plan.delta_lights = s.plan.view_layer = true;
  return s;
}

const Variant& named(const std::vector<Variant>& all, const std::string& name) {
  return *std::find_if(all.begin(), all.end(), [&](const Variant& v) { return v.name == name; });
}

TEST(Variants, EachDiffersFromBalancedInOneKnob) {
  const auto all = variants_of(scope());
  const auto& base = all.front();
  EXPECT_EQ(base.name, kBalanced);
  EXPECT_EQ(base.config.accuracy.indirect, "stored");
  for (const auto& v : all) {
    if (v.method != Method::kAtlas || v.group == Group::kPresets) continue;
    const auto& a = v.config.accuracy;
    const int knobs =
        (a.indirect != base.config.accuracy.indirect) + (a.filter_samples != base.config.accuracy.filter_samples) +
        (a.target != base.config.accuracy.target) + (v.config.render.max_samples != base.config.render.max_samples) +
        (v.config.scene.q != base.config.scene.q) + v.private_layer;
    EXPECT_EQ(knobs, 1) << v.name;
  }
}

TEST(Variants, DensityIsHalvedAndDoubled) {
  const auto all = variants_of(scope());
  EXPECT_EQ(named(all, "q 32").config.scene.q, 32);
  EXPECT_EQ(named(all, "q 128").config.scene.q, 128);
}

TEST(Variants, WhatASceneHasNotIsNotLeftOut) {
  auto plain = scope();
  plain.plan = {};
  for (const auto& v : variants_of(plain)) {
    EXPECT_FALSE(v.left_out.sky || v.left_out.sun_and_lamps || v.left_out.private_layer) << v.name;
    EXPECT_FALSE(v.private_layer) << v.name;
  }
}

TEST(Variants, AreChosenByGroupOrName) {
  const auto all = variants_of(scope());
  EXPECT_EQ(chosen(all, {})->size(), all.size());
  EXPECT_EQ(chosen(all, {"q"})->size(), 2u);
  EXPECT_EQ(chosen(all, {"q", "q 32"})->size(), 2u);
  const auto codec = chosen(all, {"crf 18"});
  ASSERT_EQ(codec->size(), 2u);  // and the run that it is made of
  EXPECT_EQ(codec->front().name, kBalanced);
  const auto wrong = chosen(all, {"q 17"});
  ASSERT_FALSE(wrong);
  EXPECT_NE(wrong.error().message.find("presets, q, samples"), std::string::npos);
}

TEST(ResultKey, ChangesWithWhateverAResultDependsOn) {
  const auto all = variants_of(scope());
  std::set<std::string> keys;
  std::size_t made = 0;
  const auto add = [&](const KeyParts& parts, const Variant& variant) {
    keys.insert(result_key(parts, variant));
    ++made;
  };
  KeyParts parts;
  for (const auto& v : all) add(parts, v);
  const auto change = [&](auto&& how) {
    KeyParts p = parts;
    Variant v = all.front();
    how(p, v);
    add(p, v);
  };
  change([](auto& p, auto&) { p.scene_hash = 1; });
  change([](auto& p, auto&) { p.exposure = 1.0000001f; });
  change([](auto& p, auto&) { p.camera.position.x = 1e-9; });
  change([](auto& p, auto&) { p.camera.fovy = 0.81f; });
  change([](auto& p, auto&) { p.viewport.width = 1; });
  change([](auto& p, auto&) { p.threads = 3; });
  change([](auto& p, auto&) { p.reference_psnr = 41; });
  change([](auto&, auto& v) { v.seconds = 1; });
  change([](auto&, auto& v) { v.config.stream.crf = 19; });
  change([](auto&, auto& v) { v.config.stream.preset = "veryfast"; });
  change([](auto&, auto& v) { v.config.render.slice_ms = 5; });
  EXPECT_EQ(keys.size(), made);
  EXPECT_EQ(result_key(parts, all.front()), result_key(parts, all.front()));
}

TEST(Recording, SettlesOnlyAfterATimeThatGrowsWithTheRun) {
  EXPECT_FALSE(has_settled(100, 0));  // no frame yet
  EXPECT_FALSE(has_settled(4, 1.5));
  EXPECT_TRUE(has_settled(4.6, 1.5));
  EXPECT_FALSE(has_settled(30, 21));
  EXPECT_TRUE(has_settled(30, 19));
}

}  // namespace
}  // namespace darm::accuracy

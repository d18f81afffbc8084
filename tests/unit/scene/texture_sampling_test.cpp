// Texture reading: wrap, filter, encoding, transform, and coordinates no one should use.
#include "actors/scene/texture_sampling.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace darm::scene {
namespace {

/// A scene with one 2x1 image: black, then white with half alpha.
Scene two_texels() {
  Scene s;
  s.images.push_back({"", 2, 1, {0, 0, 0, 255, 255, 255, 255, 127}});
  return s;
}

TextureRef texture(Wrap wrap, bool nearest) {
  TextureRef t;
  t.image = 0;
  t.wrap_s = t.wrap_t = wrap;
  t.nearest = nearest;
  return t;
}

TEST(TextureSampling, IsWhiteWithoutATexture) {
  EXPECT_EQ(sample_at(Scene{}, TextureRef{}, {0, 0}, TextureEncoding::kSrgb), glm::vec4(1));
}

TEST(TextureSampling, DecodesSrgbBeforeItMixes) {
  Scene s;
  s.images.push_back({"", 1, 1, {188, 188, 188, 255}});
  EXPECT_NEAR(sample_at(s, texture(Wrap::kRepeat, false), {0.5f, 0.5f}, TextureEncoding::kSrgb).x, 0.5029f, 1e-3f);
  EXPECT_NEAR(sample_at(s, texture(Wrap::kRepeat, false), {0.5f, 0.5f}, TextureEncoding::kLinear).x, 188.0f / 255.0f,
              1e-6f);
  // Half way between black and white is half the light, whatever the encoding.
  EXPECT_NEAR(sample_at(two_texels(), texture(Wrap::kClampToEdge, false), {0.5f, 0.5f}, TextureEncoding::kSrgb).x, 0.5f,
              1e-6f);
}

TEST(TextureSampling, ObeysWrapModes) {
  const Scene s = two_texels();
  const auto at = [&](Wrap wrap, float u) {
    return sample_at(s, texture(wrap, true), {u, 0.5f}, TextureEncoding::kSrgb).x;
  };
  EXPECT_EQ(at(Wrap::kRepeat, 1.25f), 0.0f);
  EXPECT_EQ(at(Wrap::kRepeat, -0.25f), 1.0f);
  EXPECT_EQ(at(Wrap::kMirroredRepeat, 1.25f), 1.0f);
  EXPECT_EQ(at(Wrap::kMirroredRepeat, -0.25f), 0.0f);
  EXPECT_EQ(at(Wrap::kClampToEdge, 7.0f), 1.0f);
  EXPECT_EQ(at(Wrap::kClampToEdge, -7.0f), 0.0f);
}

TEST(TextureSampling, BlendsAcrossTheRepeatedEdgeOnlyWhenRepeating) {
  const Scene s = two_texels();
  EXPECT_NEAR(sample_at(s, texture(Wrap::kRepeat, false), {0.0f, 0.5f}, TextureEncoding::kSrgb).x, 0.5f, 1e-6f);
  EXPECT_NEAR(sample_at(s, texture(Wrap::kClampToEdge, false), {0.0f, 0.5f}, TextureEncoding::kSrgb).x, 0.0f, 1e-6f);
}

TEST(TextureSampling, SurvivesAnyCoordinate) {
  const Scene s = two_texels();
  const float inf = std::numeric_limits<float>::infinity();
  for (const Wrap wrap : {Wrap::kRepeat, Wrap::kMirroredRepeat, Wrap::kClampToEdge}) {
    for (const float u :
         {0.0f, 1.0f, -1.0f, 1e30f, -1e30f, 3.4e38f, inf, -inf, std::nanf(""), 1e-40f, -1e-40f, 0.99999994f}) {
      for (const bool nearest : {true, false}) {
        const glm::vec4 c = sample_at(s, texture(wrap, nearest), {u, -u}, TextureEncoding::kSrgb);
        for (int k = 0; k < 4; ++k) EXPECT_TRUE(c[k] >= 0.0f && c[k] <= 1.0f) << u;
      }
    }
  }
}

TEST(TextureSampling, AppliesTheUvTransform) {
  TextureRef t = texture(Wrap::kRepeat, true);
  t.uv_transform = glm::mat3(1.0f);
  t.uv_transform[2] = glm::vec3(0.5f, 0, 1);
  EXPECT_EQ(sample_at(two_texels(), t, {0.25f, 0.5f}, TextureEncoding::kSrgb).x, 1.0f);
}

TEST(TextureSampling, InterpolatesOnTheTriangle) {
  Mesh m;
  m.uvs[1] = {{0, 0}, {1, 0}, {0, 1}};
  m.triangles = {{0, 1, 2}};
  EXPECT_EQ(interpolate_uv(m, 1, 0, 0.25f, 0.5f), glm::vec2(0.25f, 0.5f));
  EXPECT_EQ(interpolate_uv(m, 0, 0, 0.25f, 0.5f), glm::vec2(0.0f));
  EXPECT_EQ(interpolate_color(m, 0, 0.25f, 0.5f), glm::vec4(1.0f));
}

}  // namespace
}  // namespace darm::scene

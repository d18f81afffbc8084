#include "client/core/image_metrics.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <random>

#include "client/core/scene_model.hpp"

namespace darm::client {
namespace {

Image8 flat(std::uint8_t v, std::uint32_t w = 64, std::uint32_t h = 48) {
  return {w, h, std::vector<std::uint8_t>(std::size_t{w} * h * 3, v)};
}

ImageF linear_of(const Image8& i) {
  ImageF f{i.width, i.height, {}};
  for (const auto v : i.rgb) f.rgb.push_back(srgb_to_linear(v / 255.0f));
  return f;
}

TEST(ImageMetrics, FlatDifferenceHasTheTextbookPsnr) {
  const ImageF truth = linear_of(flat(100));
  const auto score = compare(flat(110), {truth, truth});
  ASSERT_TRUE(score);
  EXPECT_NEAR(score->psnr, -20 * std::log10(10.0 / 255.0), 1e-3);
  EXPECT_NEAR(score->rmse, 10.0 / 255.0, 1e-6);
  // Flat windows: only the luminance term is left.
  const double c1 = 6.5025;
  EXPECT_NEAR(score->mssim, (2 * 100.0 * 110 + c1) / (100.0 * 100 + 110 * 110 + c1), 1e-6);
}

TEST(ImageMetrics, EqualPicturesArePerfect) {
  const ImageF truth = linear_of(flat(77));
  const auto score = compare(flat(77), {truth, truth});
  ASSERT_TRUE(score);
  EXPECT_GE(score->psnr, 99.0);
  EXPECT_NEAR(score->mssim, 1, 1e-6);
}

TEST(ImageMetrics, NoiseOfTheHalvesCancels) {
  std::mt19937 random(3);
  std::normal_distribution<float> noise(0, 0.02f);
  const Image8 picture = flat(120, 256, 256);
  Reference r{linear_of(flat(128, 256, 256)), linear_of(flat(128, 256, 256))};
  for (auto* half : {&r.a, &r.b}) {
    for (float& v : half->rgb) v += noise(random);
  }
  const auto score = compare(picture, r);
  const auto own = reference_psnr(r);
  ASSERT_TRUE(score && own);
  EXPECT_NEAR(score->rmse, 8.0 / 255.0, 0.05 * 8.0 / 255.0);
  EXPECT_LT(*own, 45);  // the noise itself is seen here
}

TEST(ImageMetrics, OwnPsnrIsThatOfTheMeanOfTheHalves) {
  const auto own = reference_psnr({linear_of(flat(100)), linear_of(flat(104))});
  ASSERT_TRUE(own);
  EXPECT_NEAR(*own, -20 * std::log10(2.0 / 255.0), 1e-3);
}

TEST(ImageMetrics, InvertedStructureScoresBelowZero) {
  Image8 picture = flat(0), inverse = flat(0);
  for (std::size_t i = 0; i < picture.rgb.size(); ++i) {
    const bool on = (i / 3 % 64 / 2 + i / 3 / 64 / 2) % 2 == 0;
    picture.rgb[i] = on ? 200 : 50;
    inverse.rgb[i] = on ? 50 : 200;
  }
  const ImageF truth = linear_of(inverse);
  const auto score = compare(picture, {truth, truth});
  ASSERT_TRUE(score);
  EXPECT_LT(score->mssim, -0.8);
}

TEST(ImageMetrics, RefusesOtherSizes) {
  const ImageF truth = linear_of(flat(100));
  EXPECT_FALSE(compare(flat(1, 32, 32), {truth, truth}));
  EXPECT_FALSE(compare(flat(100), {truth, linear_of(flat(100, 32, 32))}));
}

class PictureFiles : public ::testing::Test {
 protected:
  std::filesystem::path path(const char* name) {
    return std::filesystem::temp_directory_path() / (std::string("darm_client_") + std::to_string(::getpid()) + name);
  }
};

TEST_F(PictureFiles, PngAndPfmComeBackAsTheyWere) {
  Image8 image = flat(0, 5, 3);
  ImageF linear{5, 3, {}};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) {
    image.rgb[i] = static_cast<std::uint8_t>(i * 5);
    linear.rgb.push_back(static_cast<float>(i) * 0.1f);
  }
  const auto png = path("a.png"), pfm = path("a.pfm");
  ASSERT_TRUE(write_png(png, image));
  ASSERT_TRUE(write_pfm(pfm, linear));
  const auto png_back = read_png(png);
  const auto pfm_back = read_pfm(pfm);
  ASSERT_TRUE(png_back && pfm_back);
  EXPECT_EQ(png_back->rgb, image.rgb);
  EXPECT_EQ(pfm_back->rgb, linear.rgb);
  std::filesystem::remove(png);
  std::filesystem::remove(pfm);
}

TEST_F(PictureFiles, HostileFilesAreRefusedBeforeMemoryIsTaken) {
  const auto file = path("bad.pfm");
  for (const char* text : {"", "PF", "P6\n2 2\n-1\n", "PF\n2 2\n-1\nxx", "PF\n4000000000 4000000000\n-1\n",
                           "PF\n2 2\n0\n", "PF\n-1 5\n-1\n"}) {
    std::ofstream(file) << text;
    EXPECT_FALSE(read_pfm(file)) << text;
    EXPECT_FALSE(read_png(file)) << text;
  }
  std::filesystem::remove(file);
  EXPECT_FALSE(read_png(file));
}

}  // namespace
}  // namespace darm::client

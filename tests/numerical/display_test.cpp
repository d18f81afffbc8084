// From radiance to codes over sixteen decades, and cameras at the poles of their parameters.
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <cmath>
#include <filesystem>
#include <glm/gtc/quaternion.hpp>
#include <limits>

#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/reference_state.hpp"
#include "actors/renderer/texel_shading.hpp"
#include "actors/renderer/tile_display.hpp"
#include "actors/types/camera.hpp"
#include "tests/numerical/statistics.hpp"
#include "tests/numerical/worst.hpp"
#include "tests/unit/renderer_tile/made_up_surface.hpp"

namespace darm::numerical {
namespace {

using renderer::srgb_code;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

/// IEC 61966-2-1, display units 0..255, not rounded.
long double curve(long double x) {
  x = std::min(std::max(x, 0.0L), 1.0L);
  return 255 * (x <= 0.0031308L ? 12.92L * x : 1.055L * std::pow(x, 1 / 2.4L) - 0.055L);
}

TEST(Display, codes_are_the_rounded_curve_and_never_fall_as_light_grows) {
  Worst off("transfer curve: distance of a code from the curve beyond rounding, codes", 2e-5);
  Worst falls("transfer curve: steps down", 0);
  int last = 0;
  const auto look = [&](float x) {
    const int code = srgb_code(x);
    falls.see(code < last ? 1 : 0, x);
    last = code;
    off.see(static_cast<double>(std::abs(curve(static_cast<long double>(x)) - code)) - 0.5, x);
  };
  // Every 997th float from 1e-12 to 1, then on to 1e9.
  const auto first = std::bit_cast<std::uint32_t>(1e-12f), one = std::bit_cast<std::uint32_t>(1.0f);
  const std::uint32_t stride = kSanitized ? 99991 : 997;
  for (std::uint32_t bits = first; bits < one; bits += stride) look(std::bit_cast<float>(bits));
  for (std::uint32_t bits = one; bits < std::bit_cast<std::uint32_t>(1e9f); bits += 64 * stride)
    look(std::bit_cast<float>(bits));
  // Every float around the edge of each code.
  for (int code = 1; code < 256; ++code) {
    const double v = (code - 0.5) / 255;
    const double x = v <= 0.04045 ? v / 12.92 : std::pow((v + 0.055) / 1.055, 2.4);
    const auto middle = std::bit_cast<std::uint32_t>(static_cast<float>(x));
    last = code - 1;
    for (std::uint32_t bits = middle - scaled(256u); bits <= middle + scaled(256u); ++bits)
      look(std::bit_cast<float>(bits));
  }
}

TEST(Display, what_rounding_leaves_below_zero_is_black) {
  Worst off("below zero: code", 0);
  for (const float x : {-0.0f, -1e-45f, -1e-38f, -1e-8f, -1.0f, -1e8f, -std::numeric_limits<float>::infinity(),
                        std::numeric_limits<float>::quiet_NaN()})
    off.see(srgb_code(x), x);
}

class Picture : public ::testing::Test {
 protected:
  Picture() {
    folder_ = std::filesystem::temp_directory_path() / ("darm_display_numbers_" + std::to_string(::getpid()));
    store_ = atlas::RadianceStore::open(folder_, {}, std::vector<std::uint32_t>{9}).value();
  }
  ~Picture() override {
    store_.reset();
    std::filesystem::remove_all(folder_);
  }
  renderer::TilePicture picture_of(TileId tile, float exposure) {
    const renderer::LevelTiles level{3, 3};
    world_.world.albedo = [](TileId, int, int) { return glm::vec3(1.0f); };
    for (const std::uint32_t passes : {1u, 4u})  // the first pass, then soft light for all
      (void)renderer::shade_tile(*store_, tile, TexelMask::all(), passes, *world_.tile(tile)).value();
    renderer::TileFactsCache facts;
    facts.get(tile, world_, *store_)->learn_albedo(*world_.tile(tile), TexelMask::all());
    renderer::TileDisplay display(*store_, facts, {exposure, 384});
    return display.draw(tile, level, TexelMask::all()).value();
  }

  std::filesystem::path folder_;
  std::unique_ptr<atlas::RadianceStore> store_;
  renderer::MadeUpWorld world_;
};

// Dim and bright patches side by side in one tile, sharp and soft, filtered: each keeps its own level.
TEST_F(Picture, of_sixteen_decades_of_light_is_the_curve_of_the_exposed_light) {
  Worst off("pictures: code against the curve, codes", 0.5001);
  Worst error("pictures: error estimates that are no number", 0);
  std::uint32_t tile = 0;
  for (const float exposure : {1e-8f, 1.0f, 1e8f}) {
    const auto light_of = [&](int x) { return std::pow(10.0f, static_cast<float>(x / 2 - 8)) * 0.7f; };  // 1e-8 to 1e7
    world_.world.light = [&](TileId, int texel, std::uint32_t) {
      const float l = light_of(texel % kTileSize);
      return texel % 2 ? renderer::TexelLight{glm::vec3(0), glm::vec3(l)}
                       : renderer::TexelLight{glm::vec3(0.25f * l), glm::vec3(0.75f * l)};
    };
    world_.world.patch = [](TileId, int x, int) { return static_cast<std::uint32_t>(x); };
    const auto picture = picture_of(TileId(0, tile++), exposure);
    for (int y = 0; y < kTileSize; ++y)
      for (int x = 0; x < kTileSize; ++x) {
        const auto at = static_cast<std::size_t>(((y + 1) * kSlotSize + x + 1) * 3);
        const long double truth = curve(static_cast<long double>(light_of(x)) * static_cast<long double>(exposure));
        off.see(static_cast<double>(std::abs(picture.image->rgb[at] - truth)), "light", light_of(x), "exposure",
                exposure);
      }
    error.see(std::isfinite(picture.error) && picture.error >= 0 ? 0 : 1, "exposure", exposure);
  }
}

TEST_F(Picture, of_light_rounded_below_zero_or_beyond_float_is_black_or_white) {
  Worst off("extreme pictures: code against the curve", 0);
  std::uint32_t tile = 0;
  const std::pair<float, float> cases[] = {
      {-1e-9f, 1.0f}, {-1e-9f, 1e8f}, {9e14f, 1e30f}, {1e-30f, 1e-30f}, {1e-42f, 1e38f}};
  for (const auto& [light, exposure] : cases) {
    world_.world.light = [&](TileId, int, std::uint32_t) {
      return renderer::TexelLight{glm::vec3(light), glm::vec3(light)};
    };
    const auto picture = picture_of(TileId(0, tile++), exposure);
    const long double truth = curve(2 * static_cast<long double>(light) * static_cast<long double>(exposure));
    for (int y = 1; y <= kTileSize; ++y)  // the payload: borders are the neighbour tiles'
      for (int x = 1; x <= kTileSize; ++x) {
        const int code = picture.image->rgb[static_cast<std::size_t>((y * kSlotSize + x) * 3)];
        off.see(std::abs(code - static_cast<double>(std::round(truth))), "light", light, "exposure", exposure);
      }
  }
}

TEST(Display, greys_keep_their_code_as_luma_and_have_no_colour) {
  Worst luma("greys: luma against the code", 0);
  Worst chroma("greys: chroma against 128", 0);
  for (int code = 0; code < 256; ++code) {
    TileImage image{};
    image.rgb.fill(static_cast<std::uint8_t>(code));
    renderer::convert_to_planes(image);
    luma.see(std::abs(image.y[37] - code), code);
    chroma.see(std::max(std::abs(image.cb[9] - 128), std::abs(image.cr[9] - 128)), code);
  }
}

// The reference averages a pixel's quarters in float: a mean of n samples is good to n / 2^24, and far better in
// practice.
TEST(Display, reference_quarters_average_in_float_within_samples_over_two_to_the_24) {
  Worst off("reference: mean of a quarter against double, relative error over samples / 2^24", 0.1);
  for (const float bright : {1.0f, 1e4f, 1e8f}) {
    renderer::QuarterMean quarter;
    double sum = 0;
    const std::uint32_t n = scaled(1u << 20);
    for (std::uint32_t i = 0; i < n; ++i) {
      const float x = independent_point(3, i).x < 1e-3f ? bright : 1e-2f * independent_point(4, i).x;
      quarter.add(glm::vec3(x));
      sum += static_cast<double>(x);
    }
    off.see(std::abs(static_cast<double>(quarter.mean.x) / (sum / n) - 1) / (n / 16777216.0 + 1e-5), "bright", bright);
  }
}

double angle_between(const glm::dvec3& a, const glm::dvec3& b) {
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

// Straight up and down, a hair beside, with an up vector that is zero, parallel or no number: always a rotation that
// looks at its target.
TEST(Cameras, look_where_they_should_whatever_is_up) {
  Worst aim("cameras: angle between the view and its target, radians", 3e-7);
  Worst skew("cameras: length of the quaternion against 1", 2e-7);
  Worst roll("cameras: horizon that is not level, radians", 3e-6);
  Worst invalid("cameras: invalid ones", 0);
  const glm::dvec3 ups[] = {{0, 1, 0},    {0, 0, 0},    {0, 0, 1},        {1e-200, 0, 0},
                            {0, -3e5, 0}, {kNan, 0, 0}, {0, kInfinity, 0}};
  for (const double tilt : {0.0, 1e-12, 1e-7, 1e-5, 1e-3, 0.5, 1.5707963, 3.1, 3.1415926, 3.14159265358979})
    for (const double turn : {0.0, 0.4, 1.5707963267948966, 3.0, -2.0})
      for (const double far : {1e-6, 1.0, 1e6})
        for (const auto& up : ups) {
          const glm::dvec3 d(std::sin(tilt) * std::cos(turn), std::cos(tilt), std::sin(tilt) * std::sin(turn));
          const glm::dvec3 at(12, -7, 3);
          const glm::dvec3 truth = glm::normalize((at + d * far) - at);
          const auto camera = look_at(at, at + d * far, 60, up);
          const glm::dquat q(camera.orientation);
          aim.see(angle_between(q * glm::dvec3(0, 0, -1), truth), "tilt", tilt, "turn", turn, "far", far);
          skew.see(std::abs(glm::length(q) - 1));
          invalid.see(is_valid(camera) ? 0 : 1);
          // Level: the right-hand side is across an up that can be used.
          if (up == glm::dvec3(0, 1, 0) && tilt >= 1e-3 && tilt < 3.14)
            roll.see(std::abs((q * glm::dvec3(1, 0, 0)).y), "tilt", tilt, "turn", turn);
        }
}

TEST(Cameras, of_any_field_of_view_or_no_number_are_valid_or_refused) {
  Worst wrong("cameras: nonsense that passes, or sense that does not", 0);
  for (const double fovy : {0.0, -0.0, -90.0, 1e-300, 0.1, 179.0, 180.0, 360.0, 1e300, kNan, kInfinity, -kInfinity})
    wrong.see(is_valid(look_at({0, 0, 0}, {0, 0, -5}, fovy)) ? 0 : 1, "fovy", fovy);
  for (const double bad : {kNan, kInfinity, -kInfinity})
    for (int axis = 0; axis < 3; ++axis) {
      glm::dvec3 p(1, 2, 3);
      p[axis] = bad;
      wrong.see(is_valid(look_at(p, {0, 0, 0}, 60)) ? 0 : 1, "position", bad);
      wrong.see(is_valid(look_at({1, 2, 3}, p, 60)) ? 0 : 1, "target", bad);
      wrong.see(is_valid(look_at(p, p, 60, p)) ? 0 : 1, "all", bad);
      Camera camera;
      camera.position[axis] = bad;
      wrong.see(is_valid(camera) ? 1 : 0, "pose", bad);
    }
  for (const float bad : {static_cast<float>(kNan), static_cast<float>(kInfinity), 0.0f, 3.1415927f, -1.0f, 3e38f}) {
    Camera camera;
    camera.fovy = bad;
    wrong.see(is_valid(camera) ? 1 : 0, "fovy", bad);
    for (int part = 0; part < 4; ++part) {
      Camera turned;
      turned.orientation = {0, 0, 0, 0};
      (&turned.orientation.x)[part] = bad;
      wrong.see(is_valid(turned) && bad != -1.0f ? 1 : 0, "orientation", bad);
    }
  }
}

// Pixels of a telescope are millionths of a radian apart: the ray of each must be its own.
TEST(Cameras, rays_pass_through_their_pixel_at_any_field_of_view) {
  Worst off("camera rays: distance from their pixel, pixels", 0.2);
  const Viewport viewport{1920, 1080};
  for (const double fovy : {0.1, 1.0, 60.0, 150.0, 179.0})
    for (std::uint32_t i = 0; i < 200; ++i) {
      const auto xi = independent_point(6, i), yi = independent_point(7, i);
      const glm::dvec3 target(2 * double{xi.x} - 1, 2 * double{xi.y} - 1, 2 * double{yi.x} - 1);
      const auto camera = look_at({0, 0, 0}, target, fovy);
      const double x = std::floor(1920 * double{yi.y}), y = std::floor(1080 * double{xi.y});
      const double half = std::tan(static_cast<double>(camera.fovy) / 2);
      const glm::dvec3 local((2 * x - 1920) / 1080 * half, (1 - 2 * y / 1080) * half, -1);
      const glm::dvec3 truth = glm::normalize(glm::dquat(camera.orientation) * local);
      const glm::dvec3 got(ray_direction(camera, viewport, static_cast<float>(x), static_cast<float>(y)));
      // The angle of a pixel where this ray passes, not at the middle: the picture is a plane.
      const double pixel = 2 * half / 1080 / glm::dot(local, local);
      off.see(angle_between(got, truth) / pixel, "fovy", fovy, "x", x, "y", y);
    }
}

}  // namespace
}  // namespace darm::numerical

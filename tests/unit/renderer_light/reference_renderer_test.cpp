#include "actors/renderer/reference_renderer.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <cstring>
#include <filesystem>
#include <fstream>

#include "actors/renderer/exposure.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::renderer {
namespace {

using test::HandScene;

class Reference : public ::testing::Test {
 protected:
  Reference() {
    folder_ = std::filesystem::temp_directory_path() / ("darm_reference_" + std::to_string(getpid()));
    std::filesystem::create_directories(folder_);
    HandScene hand;
    hand.box(glm::vec3(-1), glm::vec3(1), hand.material(HandScene::matte({0.7f, 0.5f, 0.3f})), true);
    hand.quad({-0.3f, 0.9f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f},
              hand.material(HandScene::matte(glm::vec3(0.2f), glm::vec3(4))));
    const auto scene = hand.share();
    transport_ = std::make_unique<LightTransport>(scene, trace::RayScene::build(scene, 1).value());
    job_.camera = look_at({0, 0, 0.9}, {0, -0.2, -1}, 70);
    job_.viewport = {48, 32};
    job_.spp = 8;
  }
  ~Reference() override { std::filesystem::remove_all(folder_); }

  static bool same(const Picture& a, const Picture& b) {
    return a.pixels.size() == b.pixels.size() &&
           std::memcmp(a.pixels.data(), b.pixels.data(), a.pixels.size() * sizeof(glm::vec3)) == 0;
  }

  std::filesystem::path folder_;
  std::unique_ptr<LightTransport> transport_;
  ReferenceJob job_;
};

TEST_F(Reference, bits_are_equal_for_any_number_of_threads) {
  for (const auto effects : {PictureEffects::kFull, PictureEffects::kViewIndependent}) {
    job_.effects = effects;
    job_.threads = 1;
    const auto one = render_reference(*transport_, job_).value();
    job_.threads = 3;
    const auto three = render_reference(*transport_, job_).value();
    EXPECT_TRUE(same(one.mean, three.mean));
    EXPECT_TRUE(same(one.half_a, three.half_a));
    EXPECT_FALSE(same(one.half_a, one.half_b));
    EXPECT_EQ(one.spp, 8u);
    EXPECT_EQ(one.paths, 48u * 32 * 8);
  }
}

TEST_F(Reference, a_resumed_picture_equals_an_uninterrupted_one) {
  const auto whole = render_reference(*transport_, job_).value();
  job_.state_file = folder_ / "state";
  job_.progress = [](const ReferenceProgress& p) { return p.spp < 4; };
  const auto part = render_reference(*transport_, job_).value();
  EXPECT_TRUE(part.stopped);
  EXPECT_EQ(part.spp, 4u);
  job_.progress = nullptr;
  const auto resumed = render_reference(*transport_, job_).value();
  EXPECT_TRUE(same(whole.mean, resumed.mean));
  EXPECT_TRUE(same(whole.half_b, resumed.half_b));
  EXPECT_EQ(whole.own_psnr, resumed.own_psnr);
}

TEST_F(Reference, a_foreign_or_damaged_state_is_warned_of_and_begun_anew) {
  const auto whole = render_reference(*transport_, job_).value();
  job_.state_file = folder_ / "state";
  std::vector<std::string> warnings;
  job_.warn = [&warnings](const std::string& what) { warnings.push_back(what); };
  auto other = job_;
  other.exposure = 2;
  EXPECT_NE(reference_hash(*transport_, job_), reference_hash(*transport_, other));
  ASSERT_TRUE(render_reference(*transport_, other).has_value());
  EXPECT_TRUE(warnings.empty());
  // Each time the picture is that of a run without a state file, and its state takes the place of the broken one.
  const auto begins_anew = [&](const char* how) {
    const auto made = render_reference(*transport_, job_);
    ASSERT_TRUE(made.has_value()) << how;
    EXPECT_TRUE(same(whole.mean, made->mean)) << how;
    EXPECT_EQ(warnings.size(), 1u) << how;
    warnings.clear();
    job_.progress = [&](const ReferenceProgress&) { return ADD_FAILURE() << how << ": all was done", false; };
    EXPECT_TRUE(render_reference(*transport_, job_).has_value());
    EXPECT_TRUE(warnings.empty()) << how;
    job_.progress = nullptr;
  };
  begins_anew("of another picture");
  const auto size = std::filesystem::file_size(job_.state_file);
  {
    std::fstream file(job_.state_file, std::ios::in | std::ios::out | std::ios::binary);
    file.seekp(static_cast<std::streamoff>(size / 2));
    file.put('\x5a');
  }
  begins_anew("damaged");
  std::filesystem::resize_file(job_.state_file, size - 3);
  begins_anew("cut short");
  std::ofstream(job_.state_file, std::ios::trunc) << "nonsense";
  begins_anew("of no kind");
}

TEST_F(Reference, a_state_that_cannot_be_written_is_warned_of_once_and_costs_no_picture) {
  const auto whole = render_reference(*transport_, job_).value();
  int warnings = 0;
  job_.warn = [&warnings](const std::string&) { ++warnings; };
  job_.save_seconds = 0;
  job_.state_file = folder_ / "missing" / "state";
  auto made = render_reference(*transport_, job_);
  ASSERT_TRUE(made.has_value());
  EXPECT_TRUE(same(whole.mean, made->mean));
  EXPECT_EQ(warnings, 1);
  job_.state_file = folder_ / "state";  // a folder: what was written beside it cannot take its name
  std::filesystem::create_directories(job_.state_file / "full");
  made = render_reference(*transport_, job_);
  ASSERT_TRUE(made.has_value());
  EXPECT_TRUE(same(whole.mean, made->mean));
  EXPECT_FALSE(std::filesystem::exists(folder_ / "state.part"));
}

TEST_F(Reference, own_psnr_predicts_the_error_against_a_better_picture) {
  job_.viewport = {24, 16};
  job_.spp = 32;
  const auto rough = render_reference(*transport_, job_).value();
  job_.spp = 1024;
  job_.seed_a = 11;
  job_.seed_b = 12;
  const auto truth = render_reference(*transport_, job_).value();
  // psnr_of_mean(a, b) takes both as halves of one mean: a quarter of their squared distance, 6.02 dB.
  const double measured = psnr_of_mean(rough.mean, truth.mean) - 6.02;
  EXPECT_NEAR(rough.own_psnr, measured, 1.5);
  EXPECT_GT(truth.own_psnr, rough.own_psnr + 12);
}

TEST_F(Reference, a_target_psnr_ends_it_early) {
  job_.spp = 100000;
  job_.viewport = {16, 16};
  job_.until_psnr = 25;
  const auto made = render_reference(*transport_, job_).value();
  EXPECT_GE(made.own_psnr, 25);
  EXPECT_LT(made.spp, 5000u);
}

TEST_F(Reference, nonsense_is_refused) {
  auto bad = job_;
  bad.camera.fovy = std::nanf("");
  EXPECT_FALSE(render_reference(*transport_, bad).has_value());
  bad = job_;
  bad.viewport.width = 0;
  EXPECT_FALSE(render_reference(*transport_, bad).has_value());
  bad = job_;
  bad.exposure = std::nanf("");
  EXPECT_FALSE(render_reference(*transport_, bad).has_value());
}

TEST_F(Reference, pfm_pictures_come_back_as_they_were_and_broken_ones_are_refused) {
  Picture p{3, 2, {{0, 1, 2}, {3, 4, 5}, {6, 7, 8}, {9, 10, 11}, {12, 13, 14}, {1e-9f, -1, 1e9f}}};
  const auto path = folder_ / "p.pfm";
  ASSERT_TRUE(write_pfm(path, p));
  const auto back = read_pfm(path);
  ASSERT_TRUE(back.has_value());
  EXPECT_TRUE(same(p, *back));
  ASSERT_TRUE(write_png(folder_ / "p.png", p));
  EXPECT_GT(std::filesystem::file_size(folder_ / "p.png"), 50u);
  EXPECT_FALSE(write_png(folder_ / "missing" / "p.png", p).has_value());
  std::filesystem::resize_file(path, std::filesystem::file_size(path) - 1);
  EXPECT_FALSE(read_pfm(path).has_value());
  std::ofstream(path, std::ios::trunc) << "PF\n4000000000 4000000000\n-1.0\n";
  EXPECT_FALSE(read_pfm(path).has_value());
  std::ofstream(path, std::ios::trunc) << "P6\n1 1\n255\nabc";
  EXPECT_FALSE(read_pfm(path).has_value());
  EXPECT_FALSE(read_pfm(folder_ / "none.pfm").has_value());
}

TEST(Exposure, is_pi_over_the_irradiance_of_an_evenly_lit_scene_and_one_in_the_dark) {
  HandScene hand;
  hand.quad({-1, 0, 1}, {2, 0, 0}, {0, 0, -2}, hand.material(HandScene::matte(glm::vec3(0.5f))));
  hand.scene.sky = {glm::vec3(3), glm::vec3(3), glm::vec3(0)};
  const auto scene = hand.share();
  const LightTransport lit(scene, trace::RayScene::build(scene, 1).value());
  EXPECT_NEAR(scene_exposure(lit, 256), 1.0 / 3, 1e-3);
  EXPECT_EQ(scene_exposure(lit, 256), scene_exposure(lit, 256));
  hand.scene.sky = {};
  const auto dark_scene = hand.share();
  const LightTransport dark(dark_scene, trace::RayScene::build(dark_scene, 1).value());
  EXPECT_EQ(scene_exposure(dark, 256), 1.0f);
}

// A white room of 4 m, a lamp of 10 cm facing up 10 cm under its ceiling: 8 samples of a point find the spot seldom.
TEST(Exposure, of_a_room_lit_over_a_small_bright_spot_is_that_of_its_walls) {
  HandScene hand;
  const auto white = hand.material(HandScene::matte(glm::vec3(0.8f)));
  hand.quad({-2, 0, 2}, {4, 0, 0}, {0, 0, -4}, white);  // floor
  hand.quad({-2, 3, -2}, {4, 0, 0}, {0, 0, 4}, white);  // ceiling
  hand.quad({-2, 0, -2}, {4, 0, 0}, {0, 3, 0}, white);  // walls, which face inwards
  hand.quad({2, 0, 2}, {-4, 0, 0}, {0, 3, 0}, white);
  hand.quad({-2, 0, 2}, {0, 0, -4}, {0, 3, 0}, white);
  hand.quad({2, 0, -2}, {0, 0, 4}, {0, 3, 0}, white);
  hand.quad({-0.05f, 2.9f, 0.05f}, {0.1f, 0, 0}, {0, 0, -0.1f},
            hand.material(HandScene::matte(glm::vec3(0), glm::vec3(2000))));
  const auto scene = hand.share();
  const LightTransport lit(scene, trace::RayScene::build(scene, 1).value());
  double floor = 0;
  constexpr std::uint32_t kSamples = 20'000;
  for (std::uint32_t i = 0; i < kSamples; ++i) {
    Sampler sampler(7, i % 100, i / 100);
    floor += double{luminance(lit.irradiance({0, 0, sampler.next_1d(), 0, true}, sampler).sum())};
  }
  const double of_floor = kPi * kSamples / floor;
  EXPECT_GT(scene_exposure(lit) / of_floor, 0.3);
  EXPECT_LT(scene_exposure(lit) / of_floor, 2);
}

}  // namespace
}  // namespace darm::renderer

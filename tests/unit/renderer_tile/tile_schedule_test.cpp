#include "actors/renderer/tile_schedule.hpp"

#include <gtest/gtest.h>

#include <algorithm>

#include "actors/renderer/coarse_level.hpp"

namespace darm::renderer {
namespace {

const std::vector<LevelTiles> kLevels{{10, 10}, {3, 3}};

TileRequest request(std::uint32_t index, float weight, bool display = true) {
  TileRequest r;
  r.tile = TileId(0, index);
  r.weight = weight;
  r.display = display;
  for (int x = 0; x < 10; ++x) r.mask.set(x, 0);
  return r;
}

bool all_stored(TileId) { return true; }

TileProgress at(float samples, std::uint32_t texels = 10) {
  TileProgress p;
  p.least = p.mean = samples;
  p.texels = texels;
  p.unshaded = samples > 0 ? 0 : texels;
  return p;
}

bool nothing_stored(TileId) { return false; }

class TileScheduleTest : public ::testing::Test {
 protected:
  // Runs a batch as if every job did what it says; returns the tiles in order.
  std::vector<std::uint32_t> run(std::uint64_t samples) {
    std::vector<std::uint32_t> order;
    for (const auto& job : schedule.next_batch(samples)) {
      float& n = counts[job.tile];
      n = std::min(n + static_cast<float>(job.passes), static_cast<float>(job.most));
      order.push_back(job.tile.index());
      schedule.shaded(job.tile, at(n), job.passes * 10);
    }
    return order;
  }
  std::vector<std::uint32_t> publish(float error = 0.1f) {
    std::vector<std::uint32_t> tiles;
    for (const auto tile : schedule.pictures_due()) {
      tiles.push_back(tile.index());
      schedule.pictured(tile, error);
    }
    return tiles;
  }
  TileSchedule schedule{kLevels, ScheduleOptions{}};
  std::unordered_map<TileId, float> counts;
};

TEST_F(TileScheduleTest, of_tiles_alike_the_heavier_has_its_first_pass_sooner_and_all_before_any_second) {
  std::vector<TileRequest> work;
  for (std::uint32_t i = 0; i < 30; ++i) work.push_back(request(i, 0.01f + 0.0001f * static_cast<float>(i)));
  schedule.replace(work, nothing_stored);
  std::vector<std::uint32_t> order;
  while (order.size() < 30) {
    const auto tiles = run(50);
    order.insert(order.end(), tiles.begin(), tiles.end());
    publish(0.01f);
  }
  ASSERT_EQ(order.size(), 30u);
  EXPECT_TRUE(std::is_sorted(order.rbegin(), order.rend())) << "heaviest first";
  EXPECT_EQ(std::count_if(counts.begin(), counts.end(), [](const auto& c) { return c.second == 1; }), 30);
}

TEST_F(TileScheduleTest, noisy_tile_that_fills_the_view_goes_on_before_one_that_hardly_shows_begins) {
  schedule.replace({request(1, 0.9f), request(2, 0.001f)}, nothing_stored);
  EXPECT_EQ(run(1), std::vector<std::uint32_t>{1});
  publish(0.05f);
  for (int pass = 0; pass < 3; ++pass) EXPECT_EQ(run(1), std::vector<std::uint32_t>{1});
  schedule.pictured(TileId(0, 1), 0.001f);
  EXPECT_EQ(run(1), std::vector<std::uint32_t>{2}) << "but not for ever";
}

TEST_F(TileScheduleTest, first_pass_is_worth_more_the_coarser_the_level_it_replaces) {
  schedule = TileSchedule({{10, 10}, {5, 5}, {3, 3}}, ScheduleOptions{});
  auto fine = request(1, 0.1f), coarser = request(1, 0.1f);
  coarser.tile = TileId(1, 1);
  schedule.replace({coarser, fine}, nothing_stored);
  const auto jobs = schedule.next_batch(100'000);
  ASSERT_EQ(jobs.size(), 2u);
  EXPECT_EQ(jobs[0].tile, fine.tile);
}

TEST_F(TileScheduleTest, stored_light_is_looked_at_before_anything_is_shaded) {
  schedule.replace({request(1, 0.9f), request(2, 0.1f)}, [](TileId t) { return t.index() == 2; });
  const auto jobs = schedule.next_batch(100'000);
  ASSERT_EQ(jobs.size(), 1u);
  EXPECT_EQ(jobs[0].tile.index(), 2u);
  EXPECT_EQ(jobs[0].passes, 0u);
  schedule.shaded(jobs[0].tile, at(5), 0);
  EXPECT_EQ(publish(), std::vector<std::uint32_t>{2});
  EXPECT_EQ(run(1), std::vector<std::uint32_t>{1});
}

TEST_F(TileScheduleTest, samples_go_where_weighted_error_is_largest) {
  schedule.replace({request(1, 0.1f), request(2, 0.1f), request(3, 0.4f)}, nothing_stored);
  run(1000);
  schedule.pictured(TileId(0, 1), 0.30f);
  schedule.pictured(TileId(0, 2), 0.05f);
  schedule.pictured(TileId(0, 3), 0.05f);
  const auto jobs = schedule.next_batch(100'000);
  ASSERT_EQ(jobs.size(), 3u);
  EXPECT_EQ(jobs[0].tile.index(), 1u);
  EXPECT_EQ(jobs[1].tile.index(), 3u);
  EXPECT_EQ(jobs[2].tile.index(), 2u);
}

TEST_F(TileScheduleTest, pictures_come_at_doubling_sample_counts) {
  schedule.replace({request(1, 0.1f)}, nothing_stored);
  std::vector<float> published;
  for (int i = 0; i < 200; ++i) {
    for (const auto& job : schedule.next_batch(1)) {
      counts[job.tile] += 1;
      schedule.shaded(job.tile, at(counts[job.tile]), 10);
    }
    if (!publish().empty()) published.push_back(counts[TileId(0, 1)]);
  }
  EXPECT_EQ(published, (std::vector<float>{1, 2, 4, 8, 16, 32, 64, 128}));
}

TEST_F(TileScheduleTest, work_ends_at_max_samples_with_a_last_picture) {
  ScheduleOptions options;
  options.max_samples = 100;
  schedule = TileSchedule(kLevels, options);
  schedule.replace({request(1, 0.1f)}, nothing_stored);
  std::vector<float> published;
  for (int i = 0; i < 100; ++i) {
    run(1);
    if (!publish().empty()) published.push_back(counts[TileId(0, 1)]);
  }
  EXPECT_EQ(published.back(), 100.0f);
  EXPECT_TRUE(schedule.next_batch(1000).empty());
}

TEST_F(TileScheduleTest, tile_under_its_error_target_stops_until_a_more_exacting_viewer_comes) {
  auto wanted = request(1, 0.1f);
  wanted.target_error = 0.02f;
  schedule.replace({wanted}, nothing_stored);
  for (int i = 0; i < 200 && !schedule.next_batch(1).empty(); ++i) {
    run(1);
    publish(0.01f);
  }
  EXPECT_GE(counts[TileId(0, 1)], 16.0f);
  EXPECT_LT(counts[TileId(0, 1)], 64.0f);
  wanted.target_error = 0.005f;
  schedule.replace({wanted}, all_stored);
  EXPECT_EQ(schedule.next_batch(1000).size(), 1u);
}

TEST_F(TileScheduleTest, newly_seen_texels_are_shaded_and_shown_at_once) {
  schedule.replace({request(1, 0.1f)}, nothing_stored);
  for (int i = 0; i < 5; ++i) run(1);
  publish();
  auto more = request(1, 0.1f);
  for (int x = 0; x < 10; ++x) more.mask.set(x, 5);
  schedule.replace({more}, [](TileId) { return true; });
  auto jobs = schedule.next_batch(1000);
  ASSERT_EQ(jobs.size(), 1u);
  EXPECT_EQ(jobs[0].passes, 0u);
  TileProgress half = at(10, 20);
  half.least = 0;
  half.unshaded = 10;
  schedule.shaded(jobs[0].tile, half, 0);
  jobs = schedule.next_batch(1000);
  ASSERT_EQ(jobs.size(), 1u);
  EXPECT_EQ(jobs[0].cost, 12u);  // sharp light for ten, soft for a quarter of them
  schedule.shaded(jobs[0].tile, at(10, 20), 10);
  EXPECT_EQ(publish(), std::vector<std::uint32_t>{1});
}

TEST_F(TileScheduleTest, neighbours_first_light_renews_the_border_when_all_is_calm) {
  schedule.replace({request(1, 0.9f), request(2, 0.1f), request(9, 0.01f)}, nothing_stored);
  run(1);
  EXPECT_EQ(publish(0.001f), std::vector<std::uint32_t>{1});
  run(1);
  EXPECT_EQ(publish(0.001f), std::vector<std::uint32_t>{2});
  run(1);  // no first pass waits any longer
  EXPECT_EQ(publish(0.001f), (std::vector<std::uint32_t>{1, 9}));
}

TEST_F(TileScheduleTest, a_picture_that_shares_rare_light_follows_the_samples_of_its_neighbours) {
  schedule.replace({request(1, 0.5f), request(2, 0.5f), request(9, 0.01f)}, nothing_stored);
  const auto lit = [&](std::uint32_t tile, float samples) { schedule.shaded(TileId(0, tile), at(samples), 10); };
  lit(1, 4);
  lit(2, 1);
  schedule.pictured(TileId(0, 1), 0.1f, 0.5f);
  schedule.pictured(TileId(0, 2), 0.1f, 0.0f);
  lit(2, 1.5f);
  EXPECT_TRUE(schedule.pictures_due().empty());
  lit(2, 2);
  lit(1, 7.9f);
  EXPECT_EQ(publish(), (std::vector<std::uint32_t>{1, 2})) << "1 by its neighbour's, 2 by its own";
  lit(1, 16);
  lit(2, 3.9f);
  EXPECT_EQ(publish(), std::vector<std::uint32_t>{1}) << "what shares nothing waits for its own";
}

TEST_F(TileScheduleTest, border_tiles_are_shaded_but_have_no_picture) {
  schedule.replace({request(1, 0.1f), request(2, 0.1f, false)}, nothing_stored);
  run(1000);
  EXPECT_EQ(counts.size(), 2u);
  EXPECT_EQ(publish(), std::vector<std::uint32_t>{1});
}

TEST_F(TileScheduleTest, border_tiles_rest_once_those_they_border_are_on_target) {
  auto shown = request(1, 0.1f), border = request(2, 0.1f, false);
  shown.target_error = border.target_error = 0.02f;
  schedule.replace({shown, border}, nothing_stored);
  for (int i = 0; i < 200; ++i) {
    run(1000);
    publish(0.1f);
  }
  EXPECT_GT(counts[TileId(0, 2)], 100.0f) << "its neighbour is not exact enough";
  const float before = counts[TileId(0, 2)];
  schedule.pictured(TileId(0, 1), 0.01f);
  EXPECT_TRUE(schedule.next_batch(1000).empty());
  EXPECT_EQ(counts[TileId(0, 2)], before);
}

TEST_F(TileScheduleTest, border_tiles_without_a_target_go_on) {
  schedule.replace({request(2, 0.1f, false)}, nothing_stored);
  for (int i = 0; i < 12; ++i) run(1000);
  EXPECT_GE(counts[TileId(0, 2)], 16.0f);
  EXPECT_FALSE(schedule.next_batch(1000).empty());
}

TEST_F(TileScheduleTest, tile_that_fails_twice_is_left_alone) {
  schedule.replace({request(1, 0.1f)}, nothing_stored);
  EXPECT_TRUE(schedule.failed(TileId(0, 1)));
  EXPECT_EQ(schedule.next_batch(1000).size(), 1u);
  EXPECT_FALSE(schedule.failed(TileId(0, 1)));
  EXPECT_TRUE(schedule.next_batch(1000).empty());
}

TEST(CoarseRoundsTest, rounds_end_and_pictures_come_at_powers_of_two) {
  CoarseRounds rounds(1, LevelTiles{3, 3}, 10);
  std::vector<std::uint32_t> pictures;
  std::uint32_t round = 0;
  for (int i = 0; i < 1000 && !rounds.finished(); ++i) {
    for (const auto& job : rounds.next_batch(1500)) round = std::max(round, job.most);
    EXPECT_EQ(rounds.even(), round > 2) << "from then on every texel has two";
    if (rounds.batch_finished() == CoarseDue::kPicture) pictures.push_back(round);
  }
  EXPECT_EQ(pictures, (std::vector<std::uint32_t>{1, 1, 2, 4, 8, 10}));  // the first is the first pass
  EXPECT_TRUE(rounds.finished());
}

TEST(CoarseRoundsTest, what_is_seen_comes_first_and_is_enough_for_a_picture) {
  CoarseRounds rounds(1, LevelTiles{3, 3}, 10);
  TexelMask left, right;
  left.set(0, 0);
  right.set(29, 29);
  rounds.prefer(std::vector<CoarseRequest>{{7, left}, {99, left}, {2, left}, {7, right}});
  const auto jobs = rounds.next_batch(1000);
  ASSERT_EQ(jobs.size(), 2u);  // one a tile, none outside the level
  EXPECT_EQ(jobs[0].tile.index(), 2u);
  EXPECT_EQ(jobs[1].tile.index(), 7u);
  EXPECT_EQ(jobs[1].mask.count(), 2);
  EXPECT_EQ(rounds.batch_finished(), CoarseDue::kPicture);
  EXPECT_FALSE(rounds.opening());
  // The rest of round 0 has every tile whole, those too.
  EXPECT_EQ(rounds.next_batch(1u << 20).size(), 9u);
  EXPECT_EQ(rounds.batch_finished(), CoarseDue::kPicture);
}

TEST(CoarseRoundsTest, what_is_hurried_comes_before_all_and_a_tile_once_in_a_batch) {
  CoarseRounds rounds(1, LevelTiles{3, 3}, 10);
  TexelMask one;
  one.set(4, 4);
  rounds.prefer(std::vector<CoarseRequest>{{3, one}});
  rounds.hurry(std::vector<CoarseRequest>{{5, one}, {99, one}, {2, one}, {5, one}}, 40);
  std::vector<std::uint32_t> reached;
  while (rounds.hurries()) {
    const auto jobs = rounds.next_batch(1000);
    ASSERT_EQ(jobs.size(), 2u);
    EXPECT_EQ(jobs[0].tile.index(), 2u);
    EXPECT_EQ(jobs[1].tile.index(), 5u);
    EXPECT_EQ(jobs[0].most, jobs[1].most);
    EXPECT_LE(jobs[0].passes, 16u) << "a job is no long work";
    reached.push_back(jobs[0].most);
    EXPECT_EQ(rounds.batch_finished(), rounds.hurries() ? CoarseDue::kNothing : CoarseDue::kLight);
  }
  EXPECT_EQ(reached, (std::vector<std::uint32_t>{1, 16, 32, 40}));
  EXPECT_TRUE(rounds.opening()) << "light is no picture";
  EXPECT_EQ(rounds.next_batch(1000).size(), 1u);
  EXPECT_EQ(rounds.batch_finished(), CoarseDue::kPicture);
}

TEST(CoarseRoundsTest, after_the_last_round_texels_may_still_be_hurried) {
  CoarseRounds rounds(1, LevelTiles{3, 3}, 10);
  rounds.resume(1000);
  EXPECT_EQ(rounds.batch_finished(), CoarseDue::kNothing);
  TexelMask one;
  one.set(4, 4);
  rounds.hurry(std::vector<CoarseRequest>{{5, one}}, 1);
  EXPECT_EQ(rounds.next_batch(1000).size(), 1u);
  EXPECT_EQ(rounds.batch_finished(), CoarseDue::kLight);
  EXPECT_TRUE(rounds.next_batch(1000).empty());
}

TEST(CoarseCanvasTest, tiles_without_light_are_as_bright_as_the_nearest_and_grey) {
  CoarseCanvas canvas(LevelTiles{3, 1}, 7);
  TileImage image{};
  for (std::size_t i = 0; i < image.rgb.size(); ++i) image.rgb[i] = i % 3 == 1 ? 90 : 0;  // green
  canvas.put(2, image, 0.01f);
  const auto picture = canvas.finish();
  EXPECT_EQ(picture->version, 7u);
  EXPECT_EQ(picture->width, 90u);
  EXPECT_EQ(picture->height, 30u);
  for (std::size_t i = 0; i < picture->rgb.size(); ++i) {
    const bool put = i / 3 % 90 >= 60;
    ASSERT_EQ(picture->rgb[i], put ? (i % 3 == 1 ? 90 : 0) : 64) << i;
  }
}

TEST(CoarseCanvasTest, tiles_have_the_errors_they_were_drawn_with_and_those_that_were_not_a_quarter) {
  CoarseCanvas canvas(LevelTiles{3, 1}, 1);
  canvas.put(1, TileImage{}, 0.01f);
  canvas.put(2, TileImage{}, 0.5f);
  EXPECT_EQ(canvas.finish()->errors, (std::vector<float>{0.25f, 0.01f, 0.5f}));
  EXPECT_EQ(canvas.finish(0.125f)->errors, (std::vector<float>{0.25f, 0.125f, 0.5f})) << "light may be unsettled";
}

TEST_F(TileScheduleTest, stored_tiles_are_asked_for_their_picture_once) {
  schedule.replace({request(1, 0.5f), request(2, 0.5f, false)}, all_stored);
  EXPECT_EQ(schedule.recalls_due(), std::vector<TileId>{TileId(0, 1)});  // borders show nothing
  EXPECT_TRUE(schedule.recalls_due().empty());
  schedule.replace({request(1, 0.5f), request(3, 0.5f)}, nothing_stored);
  EXPECT_TRUE(schedule.recalls_due().empty());
}

TEST_F(TileScheduleTest, a_recalled_picture_is_drawn_anew_only_when_samples_have_grown) {
  schedule.replace({request(1, 0.5f)}, all_stored);
  static_cast<void>(schedule.recalls_due());
  schedule.recalled(TileId(0, 1), 0.1f, 8);
  schedule.shaded(TileId(0, 1), at(8), 0);  // surveyed: as far as the picture
  EXPECT_TRUE(schedule.pictures_due().empty());
  schedule.shaded(TileId(0, 1), at(16), 80);
  EXPECT_EQ(schedule.pictures_due(), std::vector<TileId>{TileId(0, 1)});
}

TEST_F(TileScheduleTest, a_view_that_grows_over_lit_texels_gets_a_picture_drawn_for_them_once) {
  TexelMask part;
  part.set(3, 3);
  TileRequest seen = request(1, 0.5f);
  seen.mask = part;
  schedule.replace({seen}, all_stored);
  schedule.shaded(TileId(0, 1), at(8), 0);
  schedule.pictured(TileId(0, 1), 0.1f);
  EXPECT_TRUE(schedule.pictures_due().empty());
  schedule.replace({request(1, 0.5f)}, all_stored);  // another texel, which somebody else had lit
  schedule.shaded(TileId(0, 1), at(8), 0);           // surveyed
  EXPECT_EQ(schedule.pictures_due(), std::vector<TileId>{TileId(0, 1)});
  schedule.pictured(TileId(0, 1), 0.1f);
  schedule.replace({seen}, all_stored);
  schedule.replace({request(1, 0.5f)}, all_stored);  // back and forth: that was shown
  schedule.shaded(TileId(0, 1), at(8), 0);
  EXPECT_TRUE(schedule.pictures_due().empty());
}

TEST(CoarseRounds, resume_after_the_rounds_that_are_stored) {
  CoarseRounds rounds(1, {3, 3}, 64);
  rounds.resume(16);
  EXPECT_FALSE(rounds.opening());
  const auto jobs = rounds.next_batch(1);
  ASSERT_FALSE(jobs.empty());
  EXPECT_EQ(jobs[0].most, 17u);
  CoarseRounds shown(1, {3, 3}, 64);
  shown.resume(0);  // a picture of what had been lit when it ended
  EXPECT_FALSE(shown.opening());
  EXPECT_EQ(shown.next_batch(1)[0].most, 1u);
  CoarseRounds done(1, {3, 3}, 64);
  done.resume(1000);
  EXPECT_TRUE(done.finished());
}

}  // namespace
}  // namespace darm::renderer

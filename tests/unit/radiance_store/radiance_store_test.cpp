#include "actors/atlas/radiance_store.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cmath>
#include <fstream>
#include <limits>
#include <random>
#include <thread>

namespace darm::atlas {
namespace {

const std::vector<std::uint32_t> kTiles{40, 10, 2};
const StoreKey kKey{0x11, 0x22, 0x33};

class RadianceStoreTest : public ::testing::Test {
 protected:
  void SetUp() override {
    dir_ = std::filesystem::temp_directory_path() / ("darm_store_" + std::to_string(::getpid()) + "_" +
                                                     ::testing::UnitTest::GetInstance()->current_test_info()->name());
    std::filesystem::remove_all(dir_);
  }
  void TearDown() override { std::filesystem::remove_all(dir_); }

  std::unique_ptr<RadianceStore> open(const StoreKey& key = kKey, const StoreOptions& options = {}) {
    auto store = RadianceStore::open(dir_, key, kTiles, options);
    EXPECT_TRUE(store.has_value()) << store.error().message;
    return store ? std::move(*store) : nullptr;
  }
  [[nodiscard]] std::filesystem::path file() const { return dir_ / RadianceStore::file_name(kKey); }

  void overwrite(std::uint64_t offset, const std::string& bytes) const {
    std::fstream f(file(), std::ios::in | std::ios::out | std::ios::binary);
    f.seekp(static_cast<std::streamoff>(offset));
    f.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  }

  std::filesystem::path dir_;
};

TexelBatch batch_of(std::initializer_list<glm::vec3> samples) {
  TexelBatch b;
  for (const auto& s : samples) EXPECT_TRUE(b.add(s));
  return b;
}

void put(RadianceStore& store, TileId tile, float value) {
  auto update = store.begin_update(tile);
  ASSERT_TRUE(update.has_value()) << update.error().message;
  for (int t = 0; t < kTileTexels; ++t) {
    update->merge(t, Layer::kSharp, batch_of({glm::vec3(value)}));
    update->merge(t, Layer::kSoft, batch_of({glm::vec3(value * 2), glm::vec3(value * 4)}));
  }
}

TEST_F(RadianceStoreTest, light_survives_a_restart) {
  {
    auto store = open();
    put(*store, TileId(0, 7), 1.5f);
    put(*store, TileId(2, 1), 3.0f);
    put(*store, TileId(2, 1), 3.0f);
  }
  auto store = open();
  EXPECT_TRUE(store->refused_reason().empty()) << store->refused_reason();
  const auto a = store->read(TileId(0, 7));
  ASSERT_TRUE(a);
  EXPECT_EQ(a->mean(Layer::kSharp, 899), glm::vec3(1.5f));
  EXPECT_EQ(a->mean(Layer::kSoft, 0), glm::vec3(4.5f));
  EXPECT_EQ(a->count(Layer::kSoft, 0), 2.0f);
  EXPECT_EQ(store->version(TileId(2, 1)), 2u);
  EXPECT_FALSE(store->read(TileId(0, 8)));
  EXPECT_EQ(store->version(TileId(0, 8)), 0u);
  EXPECT_EQ(store->counters().tiles, 2u);
}

TEST_F(RadianceStoreTest, second_moment_and_mean_are_those_of_all_samples_in_any_order) {
  auto store = open();
  std::mt19937 random(7);
  std::lognormal_distribution<float> light(0.0f, 2.0f);
  std::vector<glm::vec3> samples;
  for (int i = 0; i < 3000; ++i) samples.emplace_back(light(random), light(random), light(random));
  double mean = 0, squares = 0;
  glm::dvec3 sum(0);
  for (const auto& s : samples) sum += glm::dvec3(s);
  sum /= samples.size();
  mean = luminance(sum);
  for (const auto& s : samples) squares += std::pow(luminance(glm::dvec3(s)) - mean, 2);

  for (int order = 0; order < 4; ++order) {
    std::shuffle(samples.begin(), samples.end(), random);
    auto update = store->begin_update(TileId(1, 3));
    ASSERT_TRUE(update);
    std::size_t at = 0;
    while (at < samples.size()) {
      TexelBatch b;
      const std::size_t n = std::min<std::size_t>(samples.size() - at, 1 + random() % 40);
      for (std::size_t i = 0; i < n; ++i) ASSERT_TRUE(b.add(samples[at + i]));
      update->merge(order, Layer::kSoft, b);
      at += n;
    }
    const auto got = update->view().mean(Layer::kSoft, order);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(got[c] / sum[c], 1.0, 2e-5);
    const double n = static_cast<double>(samples.size());
    const double expected = squares / (n * (n - 1));
    EXPECT_NEAR(update->view().variance_of_mean(Layer::kSoft, order, 0) / expected, 1.0, 1e-4);
  }
}

TEST_F(RadianceStoreTest, samples_that_are_no_light_are_refused) {
  TexelBatch b;
  EXPECT_FALSE(b.add({std::nanf(""), 0, 0}));
  EXPECT_FALSE(b.add({0, std::numeric_limits<float>::infinity(), 0}));
  EXPECT_FALSE(b.add({0, 0, -std::numeric_limits<float>::infinity()}));
  EXPECT_FALSE(b.add({1e30f, 0, 0}));
  EXPECT_EQ(b.count, 0u);
  EXPECT_EQ(b.sum, glm::dvec3(0));
}

TEST_F(RadianceStoreTest, brightest_legal_light_stays_finite) {
  auto store = open();
  auto update = store->begin_update(TileId(0, 0));
  ASSERT_TRUE(update);
  for (int i = 0; i < 100; ++i) update->merge(0, Layer::kSoft, batch_of({glm::vec3(9e14f), glm::vec3(0)}));
  EXPECT_TRUE(std::isfinite(update->view().variance_of_mean(Layer::kSoft, 0, 0)));
}

TEST_F(RadianceStoreTest, corrupted_tile_is_refused_and_starts_again) {
  {
    put(*open(), TileId(0, 4), 1.0f);
  }
  const auto size = std::filesystem::file_size(file());
  ASSERT_GT(size, 4096u * 2 + 20000);
  overwrite(4096 * 2 + 20000, "torn");
  auto store = open();
  EXPECT_FALSE(store->read(TileId(0, 4)));
  EXPECT_FALSE(store->read(TileId(0, 4)));
  EXPECT_EQ(store->counters().torn, 1u);
  put(*store, TileId(0, 4), 2.0f);
  ASSERT_TRUE(store->read(TileId(0, 4)));
  EXPECT_EQ(store->read(TileId(0, 4))->mean(Layer::kSharp, 0), glm::vec3(2.0f));
  EXPECT_EQ(store->read(TileId(0, 4))->count(Layer::kSharp, 0), 1.0f);
}

TEST_F(RadianceStoreTest, tile_under_update_at_a_crash_is_refused_and_others_kept) {
  const pid_t child = ::fork();
  ASSERT_GE(child, 0);
  if (child == 0) {
    auto store = RadianceStore::open(dir_, kKey, kTiles);
    for (int i = 0; i < 3; ++i) {
      auto done = (*store)->begin_update(TileId(0, static_cast<std::uint32_t>(i)));
      for (int t = 0; t < kTileTexels; ++t) {
        TexelBatch b;
        (void)b.add(glm::vec3(static_cast<float>(i)));
        done->merge(t, Layer::kSoft, b);
      }
    }
    auto torn = (*store)->begin_update(TileId(0, 1));
    TexelBatch b;
    (void)b.add(glm::vec3(99.0f));
    torn->merge(0, Layer::kSoft, b);
    ::kill(::getpid(), SIGKILL);
  }
  int status = 0;
  ::waitpid(child, &status, 0);
  ASSERT_TRUE(WIFSIGNALED(status));
  auto store = open();
  EXPECT_TRUE(store->read(TileId(0, 0)));
  EXPECT_FALSE(store->read(TileId(0, 1)));
  ASSERT_TRUE(store->read(TileId(0, 2)));
  EXPECT_EQ(store->read(TileId(0, 2))->mean(Layer::kSoft, 5), glm::vec3(2.0f));
  EXPECT_EQ(store->counters().torn, 1u);
}

// Every tile holds, at any time, the same whole number in all texels and layers: a mixture would be a torn tile shown.
TEST_F(RadianceStoreTest, kill_at_any_instant_leaves_each_tile_whole_or_refused) {
  for (int round = 0; round < 12; ++round) {
    const pid_t child = ::fork();
    ASSERT_GE(child, 0);
    if (child == 0) {
      auto store = RadianceStore::open(dir_, kKey, kTiles);
      if (!store) ::_exit(1);
      for (std::uint32_t i = 0;; ++i) {
        auto update = (*store)->begin_update(TileId(0, i % 40));
        TexelBatch b;
        (void)b.add(glm::vec3(1.0f));
        for (int t = 0; t < kTileTexels; ++t) {
          update->merge(t, Layer::kSharp, b);
          update->merge(t, Layer::kSoft, b);
        }
      }
    }
    ::usleep(static_cast<useconds_t>(3000 + round * 1700));
    ::kill(child, SIGKILL);
    int status = 0;
    ::waitpid(child, &status, 0);
    ASSERT_TRUE(WIFSIGNALED(status));
    auto store = open();
    for (std::uint32_t i = 0; i < 40; ++i) {
      const auto view = store->read(TileId(0, i));
      if (!view) continue;
      const float n = view->count(Layer::kSharp, 0);
      for (int t = 0; t < kTileTexels; ++t) {
        ASSERT_EQ(view->count(Layer::kSharp, t), n);
        ASSERT_EQ(view->count(Layer::kSoft, t), n);
      }
    }
    // One tile a kill; a slow child is killed before it comes round to mending what an earlier one left.
    EXPECT_LE(store->counters().torn, static_cast<unsigned>(round) + 1);
    EXPECT_EQ(store->counters().bad_entries, 0u);
  }
}

TEST_F(RadianceStoreTest, foreign_file_is_set_aside_with_a_reason) {
  std::filesystem::create_directories(dir_);
  std::ofstream(file()) << std::string(100'000, 'x');
  auto store = open();
  ASSERT_TRUE(store);
  EXPECT_EQ(store->refused_reason(), "not a radiance store");
  EXPECT_TRUE(std::filesystem::exists(file().string() + ".refused"));
  put(*store, TileId(0, 0), 1.0f);
  EXPECT_TRUE(store->read(TileId(0, 0)));
}

TEST_F(RadianceStoreTest, damaged_header_and_other_layout_are_set_aside) {
  {
    put(*open(), TileId(0, 0), 1.0f);
  }
  overwrite(33, "?");
  {
    auto store = open();
    EXPECT_EQ(store->refused_reason(), "header is damaged");
    EXPECT_FALSE(store->read(TileId(0, 0)));
    put(*store, TileId(0, 0), 1.0f);
  }
  const std::vector<std::uint32_t> other{41, 10, 2};
  auto store = RadianceStore::open(dir_, kKey, other);
  ASSERT_TRUE(store);
  EXPECT_EQ((*store)->refused_reason(), "of another atlas layout");
}

TEST_F(RadianceStoreTest, other_light_is_another_file) {
  {
    put(*open(), TileId(0, 0), 1.0f);
  }
  auto other = open(StoreKey{0x11, 0x22, 0x44});
  EXPECT_FALSE(other->read(TileId(0, 0)));
  EXPECT_TRUE(open()->read(TileId(0, 0)));
}

TEST_F(RadianceStoreTest, wild_directory_entries_are_refused) {
  {
    auto store = open();
    put(*store, TileId(0, 0), 1.0f);
    put(*store, TileId(0, 1), 2.0f);
  }
  overwrite(4096 + 4 * 2, std::string("\xff\xff\xff\x7f", 4));  // far outside the file
  overwrite(4096 + 4 * 3, std::string("\x01\x00\x00\x00", 4));  // the block of tile 0
  auto store = open();
  EXPECT_EQ(store->counters().bad_entries, 2u);
  EXPECT_TRUE(store->read(TileId(0, 0)));
  EXPECT_TRUE(store->read(TileId(0, 1)));
  EXPECT_FALSE(store->read(TileId(0, 2)));
  EXPECT_FALSE(store->read(TileId(0, 3)));
}

TEST_F(RadianceStoreTest, cut_off_file_loses_only_what_is_cut) {
  {
    auto store = open();
    put(*store, TileId(0, 0), 1.0f);
    put(*store, TileId(0, 1), 2.0f);
  }
  std::filesystem::resize_file(file(), 4096 * 2 + RadianceStore::kBlockBytes + 100);
  auto store = open();
  EXPECT_TRUE(store->read(TileId(0, 0)));
  EXPECT_FALSE(store->read(TileId(0, 1)));
  put(*store, TileId(0, 1), 2.0f);
  EXPECT_TRUE(store->read(TileId(0, 1)));
}

TEST_F(RadianceStoreTest, disk_is_taken_only_for_shaded_tiles) {
  const std::vector<std::uint32_t> many{200'000, 50'000};
  auto store = RadianceStore::open(dir_, kKey, many);
  ASSERT_TRUE(store);
  for (std::uint32_t i = 0; i < 100; ++i) put(**store, TileId(0, i * 2000), 1.0f);
  struct stat info{};
  ASSERT_EQ(::stat((*store)->path().c_str(), &info), 0);
  EXPECT_LT(info.st_blocks * 512,
            100 * RadianceStore::kBlockBytes + 2 * 1'200'000 + 1'500'000);  // all tiles would take 11 GB
}

TEST_F(RadianceStoreTest, new_tiles_are_refused_at_the_size_limit_and_old_ones_go_on) {
  auto store = open(kKey, StoreOptions{4096 * 2 + 3 * RadianceStore::kBlockBytes});
  for (std::uint32_t i = 0; i < 3; ++i) put(*store, TileId(0, i), 1.0f);
  const auto refused = store->begin_update(TileId(0, 3));
  ASSERT_FALSE(refused);
  EXPECT_THAT(refused.error().message, ::testing::HasSubstr("full"));
  EXPECT_EQ(store->counters().refused_full, 1u);
  put(*store, TileId(0, 2), 1.0f);
  EXPECT_EQ(store->version(TileId(0, 2)), 2u);
}

TEST_F(RadianceStoreTest, a_reserved_last_level_has_room_whatever_the_others_take) {
  const std::vector<std::uint32_t> tiles{50, 3};
  const StoreOptions five{.max_bytes = 4096 * 2 + 5 * RadianceStore::kBlockBytes, .reserve_last_level = true};
  for (int restart = 0; restart < 2; ++restart) {
    auto store = RadianceStore::open(dir_, kKey, tiles, five);
    ASSERT_TRUE(store) << store.error().message;
    std::uint32_t taken = 0;
    for (std::uint32_t i = 0; i < 10; ++i)
      if ((*store)->begin_update(TileId(0, i))) ++taken;
    EXPECT_EQ(taken, 2u);
    if (restart == 0) put(**store, TileId(1, 1), 1.0f);
  }
  auto store = RadianceStore::open(dir_, kKey, tiles, five);
  ASSERT_TRUE(store);
  for (std::uint32_t i = 0; i < 3; ++i) put(**store, TileId(1, i), 1.0f);
  EXPECT_EQ((*store)->counters().tiles, 5u);
}

TEST_F(RadianceStoreTest, a_limit_under_the_reserved_level_is_refused_with_the_way_out) {
  const std::vector<std::uint32_t> tiles{50, 3};
  const auto store = RadianceStore::open(
      dir_, kKey, tiles, {.max_bytes = 4096 * 2 + 2 * RadianceStore::kBlockBytes, .reserve_last_level = true});
  ASSERT_FALSE(store);
  EXPECT_THAT(store.error().message, ::testing::HasSubstr("raise state.max_store_bytes"));
}

TEST_F(RadianceStoreTest, albedo_is_there_after_a_restart_and_starts_unknown) {
  TileAlbedo albedo;
  albedo.bits[7] = {65535, 1, 300};
  albedo.points[7] = 4;
  {
    auto store = open();
    put(*store, TileId(0, 0), 1.0f);
    put(*store, TileId(0, 1), 1.0f);
    store->begin_update(TileId(0, 0))->put_albedo(albedo);
  }
  auto store = open();
  EXPECT_EQ(store->read(TileId(0, 0))->albedo(), albedo);
  EXPECT_EQ(store->read(TileId(0, 1))->albedo(), TileAlbedo{});
}

TEST_F(RadianceStoreTest, damaged_albedo_is_refused_with_its_tile) {
  {
    auto store = open();
    put(*store, TileId(0, 0), 1.0f);
    TileAlbedo albedo;
    albedo.points.fill(4);
    store->begin_update(TileId(0, 0))->put_albedo(albedo);
  }
  overwrite(4096 * 2 + 64 + sizeof(float) * kPlanes * kTileTexels + 10, "x");
  auto store = open();
  EXPECT_FALSE(store->read(TileId(0, 0)));
  EXPECT_EQ(store->counters().torn, 1u);
}

StoredPicture picture_of(std::uint8_t grey) {
  StoredPicture p;
  p.rgb.fill(grey);
  p.coverage.fill(200);
  p.covered = 1;
  p.error = 0.25f;
  p.samples = 12;
  return p;
}

TEST_F(RadianceStoreTest, a_picture_is_there_after_a_restart_under_its_tag_only) {
  {
    auto store = open();
    put(*store, TileId(0, 0), 1.0f);
    store->put_picture(TileId(0, 0), 77, picture_of(10));
    store->put_picture(TileId(0, 0), 77, picture_of(99));
    store->put_picture(TileId(0, 1), 77, picture_of(99));  // no light: nothing to keep it beside
  }
  auto store = open();
  EXPECT_EQ(store->picture(TileId(0, 0), 77), picture_of(99));
  EXPECT_FALSE(store->picture(TileId(0, 0), 78));
  EXPECT_FALSE(store->picture(TileId(0, 0), 0));
  EXPECT_FALSE(store->picture(TileId(0, 1), 77));
  EXPECT_EQ(store->counters().tiles, 1u);
}

TEST_F(RadianceStoreTest, a_damaged_picture_is_refused_and_its_light_is_not) {
  {
    auto store = open();
    put(*store, TileId(0, 0), 1.0f);
    store->put_picture(TileId(0, 0), 77, picture_of(10));
  }
  overwrite(4096 * 2 + RadianceStore::kBlockBytes - 4096, "damage");
  auto store = open();
  EXPECT_TRUE(store->read(TileId(0, 0)));
  EXPECT_FALSE(store->picture(TileId(0, 0), 77));
  EXPECT_EQ(store->counters().torn, 0u);
}

TEST_F(RadianceStoreTest, a_new_tile_in_an_old_block_has_no_picture) {
  {
    auto store = open();
    put(*store, TileId(0, 0), 1.0f);
    store->put_picture(TileId(0, 0), 77, picture_of(10));
  }
  overwrite(4096 * 2 + 64 + 10, "x");  // its light is torn
  auto store = open();
  EXPECT_FALSE(store->picture(TileId(0, 0), 77));
  put(*store, TileId(0, 0), 1.0f);
  EXPECT_TRUE(store->read(TileId(0, 0)));
  EXPECT_FALSE(store->picture(TileId(0, 0), 77));
}

TEST_F(RadianceStoreTest, tiles_outside_the_atlas_do_not_exist) {
  auto store = open();
  EXPECT_FALSE(store->begin_update(TileId(0, 40)));
  EXPECT_FALSE(store->begin_update(TileId(3, 0)));
  EXPECT_FALSE(store->read(TileId(15, 0x0fffffff)));
}

TEST_F(RadianceStoreTest, two_processes_do_not_share_a_store) {
  auto store = open();
  auto second = RadianceStore::open(dir_, kKey, kTiles);
  ASSERT_FALSE(second);
  EXPECT_THAT(second.error().message, ::testing::HasSubstr("in use"));
}

TEST_F(RadianceStoreTest, threads_write_different_tiles_at_once) {
  auto store = open();
  std::vector<std::thread> threads;
  for (std::uint32_t w = 0; w < 4; ++w)
    threads.emplace_back([&, w] {
      for (std::uint32_t round = 0; round < 20; ++round)
        for (std::uint32_t i = w; i < 40; i += 4) put(*store, TileId(0, i), static_cast<float>(i + 1));
    });
  for (auto& t : threads) t.join();
  store.reset();
  store = open();
  for (std::uint32_t i = 0; i < 40; ++i) {
    const auto view = store->read(TileId(0, i));
    ASSERT_TRUE(view);
    EXPECT_EQ(view->mean(Layer::kSharp, 17), glm::vec3(static_cast<float>(i + 1)));
    EXPECT_EQ(store->version(TileId(0, i)), 20u);
  }
  EXPECT_EQ(store->counters().torn, 0u);
}

}  // namespace
}  // namespace darm::atlas

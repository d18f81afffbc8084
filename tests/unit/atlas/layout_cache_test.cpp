// A layout that was kept is the layout that was made, or none.
#include "actors/atlas/layout_cache.hpp"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <cstdio>
#include <filesystem>
#include <fstream>

#include "actors/atlas/build_layout.hpp"
#include "tests/unit/atlas/hand_made_scenes.hpp"

namespace darm::atlas {
namespace {

using namespace testing;

class LayoutCache : public ::testing::Test {
 protected:
  LayoutCache() {
    auto name = (std::filesystem::temp_directory_path() / "darm-layout-XXXXXX").string();
    folder_ = mkdtemp(name.data());
  }
  ~LayoutCache() override { std::filesystem::remove_all(folder_); }
  std::filesystem::path only_file() const { return std::filesystem::directory_iterator(folder_)->path(); }

  scene::Scene scene_ = scene_of({box({0, 0, 0}, {1, 2, 3}), triangle_soup(2, 50)}, true);
  std::filesystem::path folder_;
};

TEST_F(LayoutCache, GivesBackEveryNumber) {
  const auto made = build_layout(scene_, {.q = 16}).value();
  const auto bytes = encode_layout(*made);
  const auto kept = decode_layout(bytes);
  ASSERT_TRUE(kept.has_value()) << kept.error().message;
  EXPECT_EQ(encode_layout(**kept), bytes);
  EXPECT_EQ((*kept)->levels[0].tiles_x, made->levels[0].tiles_x);
}

TEST_F(LayoutCache, RefusesEveryTornLengthAndEveryFlippedByte) {
  const auto bytes = encode_layout(*build_layout(scene_of({box({0, 0, 0}, {1, 1, 1})}), {.q = 4}).value());
  for (std::size_t n = 0; n < bytes.size(); ++n)
    EXPECT_FALSE(decode_layout(std::span(bytes).first(n)).has_value()) << n;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    if (i >= 12 && i < 16) continue;  // the reserved word
    auto bad = bytes;
    bad[i] ^= std::byte{0x10};
    EXPECT_FALSE(decode_layout(bad).has_value()) << i;
  }
}

TEST_F(LayoutCache, IsTakenOnTheSecondStart) {
  LayoutTimes times;
  const auto first = cached_layout(scene_, {.q = 16}, folder_, &times).value();
  EXPECT_GT(times.parameterise + times.pack, 0);
  const auto second = cached_layout(scene_, {.q = 16}, folder_, &times).value();
  EXPECT_EQ(times.parameterise + times.pack, 0);
  EXPECT_EQ(encode_layout(*first), encode_layout(*second));
}

TEST_F(LayoutCache, IsMadeAnewWhenTornOrOfAnotherScene) {
  const auto first = cached_layout(scene_, {.q = 16}, folder_).value();
  const auto file = only_file();
  std::filesystem::resize_file(file, std::filesystem::file_size(file) / 2);
  LayoutTimes times;
  const auto again = cached_layout(scene_, {.q = 16}, folder_, &times).value();
  EXPECT_GT(times.parameterise + times.pack, 0);
  EXPECT_EQ(encode_layout(*first), encode_layout(*again));

  const auto other = build_layout(scene_of({box({0, 0, 0}, {1, 1, 1})}), {.q = 16}).value();
  ASSERT_TRUE(write_layout(file, *other).has_value());
  EXPECT_EQ(encode_layout(*first), encode_layout(*cached_layout(scene_, {.q = 16}, folder_).value()));
}

TEST_F(LayoutCache, ADirectoryThatCannotBeWrittenCostsOnlyTheCache) {
  std::ofstream(folder_ / "file") << "not a folder";
  EXPECT_TRUE(cached_layout(scene_, {.q = 16}, folder_ / "file").has_value());
}

TEST_F(LayoutCache, ATooLargeQIsRefusedThoughALayoutIsKept) {
  ASSERT_TRUE(cached_layout(scene_, {.q = 16}, folder_).has_value());
  EXPECT_FALSE(cached_layout(scene_, {.q = 16, .max_texels = 1000}, folder_).has_value());
}

}  // namespace
}  // namespace darm::atlas

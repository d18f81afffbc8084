#include "daemon/accuracy/client_state.hpp"

#include <gtest/gtest.h>

#include "actors/encoder/phystex_picture.hpp"

namespace darm::accuracy {
namespace {

atlas::Layout two_levels() {
  atlas::Layout layout;
  atlas::Level fine;
  fine.width = fine.height = 60;
  fine.tiles_x = fine.tiles_y = 2;
  atlas::Level coarse;
  coarse.width = coarse.height = 30;
  coarse.tiles_x = coarse.tiles_y = 1;
  layout.levels = {fine, coarse};
  return layout;
}

std::shared_ptr<const TileImage> flat_tile(std::uint8_t grey) {
  auto image = std::make_shared<TileImage>();
  image->rgb.fill(grey);
  image->y.fill(grey);
  image->cb.fill(128);
  image->cr.fill(128);
  return image;
}

encoder::PageEdit edit(TileId tile, SlotIndex slot) { return {tile, slot, nullptr, nullptr}; }

TEST(ClientState, APageTableAndItsSlotsChangeTogether) {
  const auto layout = two_levels();
  ClientState state(layout, 64);
  EXPECT_EQ(state.slot_of(TileId(0, 3)), kNoSlot);
  const std::vector<encoder::PageEdit> edits{edit(TileId(0, 3), 2)};
  const std::vector<encoder::SlotWrite> writes{{2, flat_tile(102)}};
  state.apply(true, edits, writes);
  EXPECT_EQ(state.slot_of(TileId(0, 3)), 2);
  EXPECT_NEAR(state.slot_colour(2, {16, 16}).x, 0.4f, 1e-6f);
  const std::vector<encoder::PageEdit> gone{edit(TileId(0, 3), kNoSlot), edit(TileId(1, 0), 2)};
  state.apply(false, gone, {});
  EXPECT_EQ(state.slot_of(TileId(0, 3)), kNoSlot);
  EXPECT_EQ(state.slot_of(TileId(1, 0)), 2);
  state.apply(true, {}, {});
  EXPECT_EQ(state.slot_of(TileId(1, 0)), kNoSlot);
}

TEST(ClientState, WhatIsOutOfRangeIsNotThere) {
  const auto layout = two_levels();
  ClientState state(layout, 64);
  const std::vector<encoder::PageEdit> edits{edit(TileId(5, 0), 0), edit(TileId(0, 99), 0), edit(TileId(0, 0), 4)};
  const std::vector<encoder::SlotWrite> writes{{4, flat_tile(1)}};
  state.apply(true, edits, writes);
  for (const auto tile : {TileId(5, 0), TileId(0, 99), TileId(0, 0), TileId(0, 1)})
    EXPECT_EQ(state.slot_of(tile), kNoSlot);
}

TEST(ClientState, ASlotReadFromPlanesIsTheTileThatWasWrittenAndNoNeighbour) {
  const auto layout = two_levels();
  encoder::PhysTexPicture picture(64, false);
  picture.write(0, *flat_tile(50));
  picture.write(1, *flat_tile(200));
  ClientState state(layout, 64);
  const std::vector<encoder::PageEdit> edits{edit(TileId(0, 0), 0), edit(TileId(0, 1), 1)};
  const std::vector<encoder::SlotWrite> writes{{0, flat_tile(0)}, {1, flat_tile(0)}};
  state.apply(true, edits, writes);
  state.set_picture(DecodedPlanes::copy(picture.view()));
  for (const float at : {1.0f, 16.0f, 31.0f, 40.0f}) {
    EXPECT_NEAR(state.slot_colour(0, {at, at}).x, 50 / 255.0f, 1e-5f);
    EXPECT_NEAR(state.slot_colour(1, {at, at}).y, 200 / 255.0f, 1e-5f);
  }
  state.set_picture({});
  EXPECT_EQ(state.slot_colour(1, {16, 16}).x, 0);
}

TEST(ClientState, ColoursLieBetweenTexelCentres) {
  const auto layout = two_levels();
  auto image = std::make_shared<TileImage>(*flat_tile(0));
  for (std::size_t y = 0; y < kSlotSize; ++y)
    for (std::size_t x = 0; x < kSlotSize; ++x) image->rgb[(y * kSlotSize + x) * 3] = static_cast<std::uint8_t>(8 * x);
  ClientState state(layout, 64);
  const std::vector<encoder::SlotWrite> writes{{0, image}};
  state.apply(true, {}, writes);
  EXPECT_NEAR(state.slot_colour(0, {10.5f, 5}).x, 80 / 255.0f, 1e-6f);
  EXPECT_NEAR(state.slot_colour(0, {10.75f, 5}).x, 82 / 255.0f, 1e-6f);
}

TEST(ClientState, TheCoarseLevelIsReadWithinItsOwnSize) {
  const auto layout = two_levels();
  ClientState state(layout, 64);
  EXPECT_FALSE(state.has_coarse());
  DecodedPlanes planes;
  planes.width = planes.height = 32;  // padded by the codec
  planes.chroma_width = planes.chroma_height = 16;
  planes.y.assign(32 * 32, 255);
  for (std::size_t y = 0; y < 30; ++y) std::fill_n(planes.y.begin() + static_cast<std::ptrdiff_t>(y * 32), 30, 51);
  planes.cb.assign(256, 128);
  planes.cr.assign(256, 128);
  state.set_coarse(planes, 30, 30);
  EXPECT_TRUE(state.has_coarse());
  for (const float at : {-3.0f, 0.0f, 29.5f, 30.0f, 99.0f}) EXPECT_NEAR(state.coarse_colour({at, at}).x, 0.2f, 1e-6f);
}

}  // namespace
}  // namespace darm::accuracy

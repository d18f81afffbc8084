#include "actors/session/session_memory.hpp"

#include <gtest/gtest.h>

namespace darm::session {
namespace {

TEST(SessionMemory, adds_up_what_each_holds_now_and_forgets_who_has_gone) {
  const auto memory = std::make_shared<SessionMemory>(100);
  SessionMemory::Share first(memory);
  first.set(30);
  {
    SessionMemory::Share second(memory);
    second.set(60);
    first.set(40);
    EXPECT_EQ(memory->held(), 100u);
    EXPECT_TRUE(second.has_room(0));
    EXPECT_FALSE(first.has_room(1));
    second.set(70);
    EXPECT_FALSE(first.has_room(0)) << "over it there is no room for anything";
  }
  EXPECT_EQ(memory->held(), 40u);
  first.set(5);
  EXPECT_EQ(memory->held(), 5u);
  EXPECT_TRUE(first.has_room(95));
}

TEST(SessionMemory, layers_leave_room_for_whoever_comes_next) {
  const auto memory = std::make_shared<SessionMemory>(100);
  SessionMemory::Share layers(memory), next(memory);
  EXPECT_TRUE(layers.has_room_for_layer(75));
  EXPECT_FALSE(layers.has_room_for_layer(76));
  layers.set(75);
  EXPECT_FALSE(next.has_room_for_layer(1));
  EXPECT_TRUE(next.has_room(25));
  layers.set(80);
  EXPECT_FALSE(next.has_room_for_layer(0)) << "messages that wait count as well";
}

TEST(SessionMemory, without_a_limit_there_is_always_room) {
  SessionMemory::Share share(std::make_shared<SessionMemory>());
  share.set(std::size_t{1} << 40);
  EXPECT_TRUE(share.has_room(std::size_t{1} << 40));
  EXPECT_TRUE(share.has_room_for_layer(std::size_t{1} << 40));
}

}  // namespace
}  // namespace darm::session

#include "actors/session/address_places.hpp"

#include <gtest/gtest.h>

#include <boost/asio/ip/address.hpp>
#include <vector>

#include "actors/session/asio_connection.hpp"
#include "actors/session/pending_sockets.hpp"

namespace darm::session {
namespace {

std::string peer(const char* address) { return peer_of(boost::asio::ip::make_address(address)); }

TEST(AddressPlaces, an_address_has_as_many_as_it_may_and_others_have_theirs) {
  AddressPlaces places(2);
  auto first = places.enter("10.0.0.1");
  auto second = places.enter("10.0.0.1");
  ASSERT_TRUE(first && second);
  EXPECT_FALSE(places.enter("10.0.0.1"));
  const auto other = places.enter("10.0.0.2");
  EXPECT_TRUE(other);
  second.reset();
  EXPECT_TRUE(places.enter("10.0.0.1")) << "and is free again at once, as this one is";
  EXPECT_TRUE(places.enter("10.0.0.1"));
}

TEST(AddressPlaces, what_is_given_up_leaves_nothing_behind) {
  AddressPlaces places(1);
  {
    auto place = places.enter("a");
    ASSERT_TRUE(place);
    const AddressPlaces::Place moved = std::move(*place);
    place.reset();
    EXPECT_FALSE(places.enter("a")) << "who was moved still has it";
  }
  EXPECT_EQ(places.addresses(), 0u);
  AddressPlaces none(0);
  EXPECT_FALSE(none.enter("a"));
  EXPECT_EQ(none.addresses(), 0u);
}

TEST(AddressPlaces, a_connection_that_is_gone_already_is_nobodys) {
  AddressPlaces places(1);
  const auto one = places.enter(""), two = places.enter("");
  EXPECT_TRUE(one && two);
  EXPECT_EQ(places.addresses(), 0u);
}

TEST(PeerOf, counts_a_network_of_ipv6_as_one_and_ipv4_alike_however_it_came) {
  EXPECT_EQ(peer("2001:db8:1:2::1"), peer("2001:db8:1:2:ffff::9"));
  EXPECT_NE(peer("2001:db8:1:2::1"), peer("2001:db8:1:3::1"));
  EXPECT_EQ(peer("::ffff:10.0.0.1"), peer("10.0.0.1"));
  EXPECT_NE(peer("10.0.0.1"), peer("10.0.0.2"));
}

TEST(PendingSockets, leave_half_of_the_places_to_others_than_one_address) {
  PendingSockets pending(8);
  std::vector<PendingSockets::Place> held;
  const auto enter = [&](const char* address) {
    auto place = pending.enter([] {}, address);
    if (place) held.push_back(std::move(*place));
    return place.has_value();
  };
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(enter("a"));
  EXPECT_FALSE(enter("a"));
  for (int i = 0; i < 4; ++i) EXPECT_TRUE(enter("b"));
  EXPECT_FALSE(enter("c")) << "all are taken";
  held.clear();
  EXPECT_TRUE(enter("a"));
}

}  // namespace
}  // namespace darm::session

#include "client/desktop/view_link.hpp"

#include <gtest/gtest.h>

#include <glm/geometric.hpp>

namespace darm::client::desktop {
namespace {

TEST(ViewLink, AViewComesBackFromItsLinkInASceneOf7MmAndOneOf3Km) {
  for (const double size : {0.007, 10.0, 3000.0}) {
    const UprightView view{{size / 3, -size / 7, size * 0.9}, 2.5, -0.41, 0.9};
    const auto back = from_link("https://host:9080/" + to_link(view));
    ASSERT_TRUE(back);
    EXPECT_LT(glm::distance(back->position, view.position), size * 2e-8);
    EXPECT_NEAR(back->yaw, view.yaw, 1e-6);
    EXPECT_NEAR(back->pitch, view.pitch, 1e-6);
    EXPECT_NEAR(back->fovy, view.fovy, 1e-6);
    EXPECT_EQ(to_link(*back), to_link(view)) << "a link that is passed on stays the same";
  }
}

TEST(ViewLink, IsWhatTheWebClientWrites) {
  EXPECT_EQ(to_link({{1.5, -2, 1e-3}, 90 * kDegree, -12.5 * kDegree, 50 * kDegree}), "#view=1.5,-2,0.001,90,-12.5,50");
}

TEST(ViewLink, WhatWasCutOrMadeUpIsNoView) {
  for (const char* text :
       {"", "#", "#view=", "#view=1,2,3", "#view=1,2,3,4,5,60,7", "#view=1,2,nan,0,0,60", "#view=1,2,inf,0,0,60",
        "#view=1e99,0,0,0,0,60", "#view=1e999,0,0,0,0,60", "#view=1,2,3,0,91,60", "#view=1,2,3,0,0,0",
        "#view=1,2,3,0,0,170", "#view=1,2,3,0,0,<b>", "#other=1,2,3,4,5,60", "#view=0x10,2,3,0,0,60"}) {
    EXPECT_FALSE(from_link(text)) << text;
  }
}

TEST(ViewLink, ACameraInWordsIsReadToo) {
  const auto view = read_view("-5.6,1.75,-0.5 -2.632,2.004,-0.148 58");
  ASSERT_TRUE(view) << view.error().message;
  EXPECT_NEAR(view->position.x, -5.6, 1e-12);
  EXPECT_LT(glm::distance(forward(*view), glm::normalize(glm::dvec3(2.968, 0.254, 0.352))), 1e-9);
  EXPECT_NEAR(view->fovy, 58 * kDegree, 1e-12);
  for (const char* text : {"1,2,3", "1,2,3 4,5,6", "1,2,3 4,5,6 0", "1,2,3 4,5,6 179", "1,2,3 4,5,6 nan", "hall",
                           "1,2,3 4,5,6 60 7", "1,2,3 4,5,inf 60"}) {
    EXPECT_FALSE(read_view(text)) << text;
  }
}

}  // namespace
}  // namespace darm::client::desktop

#include "client/desktop/redraw.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace darm::client::desktop {
namespace {

TEST(RedrawPace, AStillViewWithoutNewsCostsNothing) {
  RedrawPace pace;
  EXPECT_TRUE(pace.due(0)) << "the first picture";
  pace.drawn(0, 10);
  EXPECT_TRUE(std::isinf(pace.wait(1e9)));
}

TEST(RedrawPace, AHandThatMovesIsFollowedAtOnceWithOrWithoutTheStream) {
  RedrawPace pace;
  double now = 0;
  for (int i = 0; i < 20; ++i) {
    pace.moved(now);
    EXPECT_TRUE(pace.due(now));
    EXPECT_TRUE(pace.moving(now));
    pace.drawn(now, now + 100);
    now += 100;
    EXPECT_FALSE(pace.due(now)) << "one picture a move";
  }
  EXPECT_FALSE(pace.moving(now + 200));
}

TEST(RedrawPace, NewsOfAStillViewTakeAThirdOfTheTime) {
  RedrawPace pace;
  double now = 1000, drawing = 0;
  pace.drawn(now - 100, now);
  for (int i = 0; i < 10000; ++i, now += 1) {  // news all the time, pictures of 100 ms
    pace.news();
    if (!pace.due(now)) continue;
    pace.drawn(now, now + 100);
    drawing += 100;
    now += 100;
  }
  EXPECT_NEAR(drawing / (now - 1000), 0.35, 0.02);
}

TEST(RedrawPace, QuickPicturesAreDrawnAsNewsCome) {
  RedrawPace pace;
  pace.drawn(0, 1);
  pace.news();
  EXPECT_LT(pace.wait(1), 3);
  EXPECT_TRUE(pace.due(4));
}

}  // namespace
}  // namespace darm::client::desktop

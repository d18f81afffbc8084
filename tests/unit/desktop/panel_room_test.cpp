#include "client/desktop/panel_room.hpp"

#include <gtest/gtest.h>

namespace darm::client::desktop {
namespace {

// As they are with a font of 13 pixels.
constexpr Extent kWholePanel{600, 135}, kBriefPanel{200, 85}, kKeys{300, 240};

TEST(PanelRoom, AWindowShowsAsMuchOfThePanelAsLeavesTheSceneToBeSeen) {
  EXPECT_EQ(panel_form({1260, 700}, kWholePanel, kBriefPanel), PanelForm::kWhole);
  EXPECT_EQ(panel_form({460, 250}, kWholePanel, kBriefPanel), PanelForm::kBrief) << "480x270: it would cover all of it";
  EXPECT_EQ(panel_form({620, 340}, kWholePanel, kBriefPanel), PanelForm::kBrief) << "fits, and covers too much";
  EXPECT_EQ(panel_form({140, 70}, kWholePanel, kBriefPanel), PanelForm::kNone);
  EXPECT_EQ(panel_form({0, 0}, kWholePanel, kBriefPanel), PanelForm::kNone);
}

TEST(PanelRoom, ASheetShrinksToTheWindowAndNoFurtherThanCanBeRead) {
  EXPECT_EQ(shrunk({1260, 700}, kKeys), 1);
  EXPECT_FLOAT_EQ(shrunk({460, 180}, kKeys), 0.75f);
  EXPECT_FLOAT_EQ(shrunk({225, 700}, kKeys), 0.75f);
  EXPECT_EQ(shrunk({40, 30}, kKeys), 0.5f);
  EXPECT_EQ(shrunk({40, 30}, {}), 1);
}

TEST(PanelRoom, SheetsInOppositeCornersAreApartBesideOrBelowEachOther) {
  EXPECT_TRUE(apart({620, 200}, kBriefPanel, kKeys, 10)) << "beside";
  EXPECT_TRUE(apart({400, 340}, kBriefPanel, kKeys, 10)) << "below";
  EXPECT_FALSE(apart({460, 250}, kBriefPanel, kKeys, 10));
}

}  // namespace
}  // namespace darm::client::desktop

#include "client/desktop/reunion.hpp"

#include <gtest/gtest.h>

namespace darm::client::desktop {
namespace {

TEST(Reunion, TriesGrowRarerButNotBeyondAFewSeconds) {
  EXPECT_LT(retry_delay_ms(0, 0), 350);
  EXPECT_GT(retry_delay_ms(3, 0.5), retry_delay_ms(2, 0.5));
  for (unsigned n = 0; n < 100; ++n) EXPECT_LE(retry_delay_ms(n, 1), 5500);
}

TEST(Reunion, ALossIsSaidQuietlyAndThePictureStays) {
  Reunion r;
  EXPECT_FALSE(r.words(0).quiet.empty()) << "walking in";
  r.joined(1000);
  EXPECT_EQ(r.words(1000).quiet, "Walking in...") << "until there is a picture";
  r.pictured();
  EXPECT_EQ(r.words(1100).quiet, "");
  const auto first = r.lost(Error("server: closed the connection"), 0.5);
  ASSERT_TRUE(first);
  EXPECT_NE(r.words(2000).quiet.find("the picture stays"), std::string::npos);
  EXPECT_EQ(r.words(2000).alert, "");
  const auto second = r.lost(Error("refused"), 0.5);
  ASSERT_TRUE(second);
  EXPECT_GT(*second, *first);
  r.joined(5000);
  EXPECT_EQ(r.words(5001).quiet, "Connected again.");
  EXPECT_EQ(r.words(8001).quiet, "") << "it leaves by itself";
  const auto anew = r.lost(Error("closed"), 0.5);
  ASSERT_TRUE(anew);
  EXPECT_EQ(*anew, *first) << "the next loss is a new one";
  EXPECT_EQ(r.joins(), 2u);
}

TEST(Reunion, WhoLeftBecauseNobodyLookedComesBackWithoutWords) {
  Reunion r;
  r.joined(0);
  r.pictured();
  r.left();
  r.joined(1000);
  EXPECT_EQ(r.words(1001).quiet, "");
  ASSERT_TRUE(r.lost(Error("closed"), 0.5));
  r.joined(2000);
  EXPECT_EQ(r.words(2001).quiet, "Connected again.");
}

TEST(Reunion, WithoutAPictureTheReasonIsSaid) {
  Reunion r;
  ASSERT_TRUE(r.lost(Error("host:9: no answer"), 0.5));
  EXPECT_EQ(r.words(0).quiet, "host:9: no answer. Trying again...");
  ASSERT_TRUE(r.lost(Error("is a server there?"), 0.5));
  EXPECT_EQ(r.words(0).quiet, "is a server there? Trying again...") << "one mark at the end of a sentence";
}

TEST(Reunion, AFullServerIsTriedAgainLater) {
  Reunion r;
  const auto wait = r.lost(Error("full", Cause::kFull), 0.5);
  ASSERT_TRUE(wait);
  EXPECT_GE(*wait, 10'000);
  EXPECT_FALSE(r.words(0).alert.empty());
  r.joined(1);
  EXPECT_EQ(r.words(1).alert, "");
}

TEST(Reunion, WhatTimeDoesNotHealIsNotTriedAgain) {
  for (const Cause cause : {Cause::kVersion, Cause::kRefused, Cause::kProtocol}) {
    Reunion r;
    r.pictured();
    EXPECT_FALSE(r.lost(Error("why", cause), 0.5));
    EXPECT_NE(r.words(0).alert.find("why"), std::string::npos);
  }
}

TEST(Reunion, APassingLineGivesWayToWhatWasThereBefore) {
  Reunion r;
  r.joined(0);
  r.pictured();
  static_cast<void>(r.lost(Error("closed"), 0.5));
  const std::string lost = r.words(10).quiet;
  r.say("Saved.", 10, 2);
  EXPECT_EQ(r.words(2009).quiet, "Saved.");
  EXPECT_EQ(r.words(2011).quiet, lost);
}

}  // namespace
}  // namespace darm::client::desktop

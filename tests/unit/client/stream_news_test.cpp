#include "client/core/stream_news.hpp"

#include <gtest/gtest.h>

#include "client/core/picture_pool.hpp"

namespace darm::client {
namespace {

StreamNews rows(std::uint32_t row, std::uint16_t slot) {
  StreamNews n;
  n.pages[row] = {slot};
  return n;
}

TEST(StreamNews, WhatCameInTwoPiecesIsAsIfItHadComeInOne) {
  StreamNews news = rows(1, 10);
  news.coverage[3] = "old";
  StreamNews newer = rows(2, 20);
  newer.pages[1] = {11};
  newer.coverage[3] = "new";
  newer.coverage[4] = "more";
  newer.picture = std::make_shared<Picture>();
  const auto picture = newer.picture;
  news.add(std::move(newer));
  EXPECT_EQ(news.pages.at(1), std::vector<std::uint16_t>{11});
  EXPECT_EQ(news.pages.at(2), std::vector<std::uint16_t>{20});
  EXPECT_EQ(news.coverage.at(3), "new");
  EXPECT_EQ(news.coverage.size(), 2u);
  EXPECT_EQ(news.picture, picture);
  news.add(rows(5, 1));
  EXPECT_EQ(news.picture, picture) << "the newest picture stays until there is a newer one";
}

TEST(StreamNews, ANewPlayersNewsVoidTheOldButForCoarseTex) {
  StreamNews news = rows(1, 10);
  news.coarse = std::make_shared<Picture>();
  news.picture = std::make_shared<Picture>();
  news.through[1] = "x";
  const auto coarse = news.coarse;
  StreamNews fresh = rows(7, 70);
  fresh.fresh = true;
  news.add(std::move(fresh));
  EXPECT_TRUE(news.fresh);
  EXPECT_EQ(news.pages.size(), 1u);
  EXPECT_EQ(news.picture, nullptr);
  EXPECT_TRUE(news.through.empty());
  EXPECT_EQ(news.coarse, coarse);
  EXPECT_FALSE(news.empty());
  EXPECT_TRUE(StreamNews().empty());
}

TEST(PicturePool, APictureComesBackOnceNobodyHoldsIt) {
  PicturePool pool;
  auto first = pool.take();
  const Picture* place = first.get();
  auto second = pool.take();
  EXPECT_NE(second.get(), place) << "what is held is not given twice";
  std::shared_ptr<const Picture> shown = first;
  first.reset();
  EXPECT_NE(pool.take().get(), place);
  shown.reset();
  EXPECT_EQ(pool.take().get(), place);
}

TEST(PicturePool, APictureOutlivesItsPool) {
  std::shared_ptr<Picture> picture;
  {
    PicturePool pool;
    picture = pool.take();
  }
  picture->y.assign(100, 7);
  EXPECT_EQ(picture->y[99], 7);
}

}  // namespace
}  // namespace darm::client

#include "client/desktop/figures.hpp"

#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>

namespace darm::client::desktop {
namespace {

std::map<std::string, std::string> said(const Measured& m) {
  std::map<std::string, std::string> out;
  for (const auto& [label, value] : panel_lines(m)) out[label] = value;
  return out;
}

TEST(Figures, ThePanelTellsNumbersWithTheirUnits) {
  Measured m;
  m.frames_per_second = 58.6;
  m.draw_ms = 4;
  m.upload_ms = 2.4;
  m.decode_ms = 6.2;
  m.bits_per_second = 1.62e6;
  m.lag_ms = 132.4;
  m.error = 0.01;
  m.resolution_error = 0.1;
  m.omitted_error = 0.05;
  m.traffic.received = 3'200'000;
  m.seconds = 100;
  m.residency = ResidencyCounts{1000, 10, 810, 50, 30, 100};
  const auto lines = said(m);
  EXPECT_EQ(lines.at("Frames a second"), "59");
  EXPECT_EQ(lines.at("Stream"), "1.6 Mbit/s");
  EXPECT_EQ(lines.at("Shading lag"), "132 ms");
  EXPECT_EQ(lines.at("Coarser than asked"), "10.0 %") << "of the samples that show a surface";
  EXPECT_EQ(lines.at("Error of the light"), "2.55 of 255 (40.0 dB)");
  EXPECT_EQ(lines.at("Error of resolution"), "25.50 of 255 (20.0 dB)");
  EXPECT_EQ(lines.at("Reflections left out"), "12.75 of 255 (26.0 dB)");
  EXPECT_EQ(lines.at("Cost"), "3.2 MB (115.2 MB an hour), ms: decoding 6, uploading 2, drawing 4");
}

TEST(Figures, InFewWordsItTellsTheSame) {
  Measured m;
  m.frames_per_second = 20;
  m.divisor = 2;
  m.bits_per_second = 1.62e6;
  m.lag_ms = 132.4;
  m.error = 0.01;
  const PanelLines lines = {
      {"Frames/s", "20, coarser"}, {"Stream", "1.6 Mbit/s"}, {"Lag", "132 ms"}, {"Error", "2.55 of 255"}};
  EXPECT_EQ(brief_lines(m), lines);
  EXPECT_EQ(brief_lines(Measured{}).back()[1], "-");
}

TEST(Figures, WhatIsNotKnownIsNotSaid) {
  const auto lines = said(Measured{});
  EXPECT_EQ(lines.at("Frames a second"), "still");
  EXPECT_EQ(lines.at("Shading lag"), "-");
  EXPECT_EQ(lines.at("Coarser than asked"), "-");
  EXPECT_EQ(lines.at("Error of the light"), "-");
  EXPECT_FALSE(fallback_share(ResidencyCounts{5, 0, 0, 0, 0, 5})) << "only sky is seen";
}

TEST(Figures, PercentilesAreThoseOfTheValues) {
  Series s;
  EXPECT_EQ(s.percentile(0.5), 0);
  for (int i = 100; i >= 0; --i) s.add(i);
  EXPECT_EQ(s.percentile(0.5), 50);
  EXPECT_EQ(s.percentile(0.99), 99);
  EXPECT_EQ(s.percentile(1), 100);
  EXPECT_EQ(s.last(), 0);
}

TEST(Figures, ASeriesOfDaysKeepsTheNewest) {
  Series s;
  for (int i = 0; i < 100'000; ++i) s.add(1);
  for (int i = 0; i < 99'000; ++i) s.add(2);
  EXPECT_EQ(s.count(), 100'000u);
  EXPECT_EQ(s.percentile(0.5), 2);
  EXPECT_EQ(s.percentile(0), 1);
}

TEST(Figures, ARateForgetsWhatIsPast) {
  Rate r(1000);
  for (int i = 0; i < 30; ++i) r.add(i * 10.0);
  EXPECT_EQ(r.per_second(300), 30);
  EXPECT_EQ(r.per_second(5000), 0);
  Rate bytes(4000);
  bytes.add(0, 1000);
  bytes.add(1000, 3000);
  EXPECT_EQ(bytes.per_second(1000), 1000);
}

TEST(Figures, TheReportIsJsonWithTheSpreadOfEachTime) {
  VisitFigures f;
  f.frames_drawn = 50;
  f.seconds = 10;
  f.draw_ms.add(20);
  f.draw_ms.add(40);
  const auto j = nlohmann::json::parse(report_json(f, Measured{}));
  EXPECT_EQ(j["frames_per_second"], 5.0);
  EXPECT_EQ(j["draw_ms"]["count"], 2);
  EXPECT_EQ(j["draw_ms"]["p99"], 40.0);
  EXPECT_TRUE(j["decode_ms"].is_null());
}

}  // namespace
}  // namespace darm::client::desktop

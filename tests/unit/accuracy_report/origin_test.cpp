#include "daemon/accuracy/report/origin.hpp"

#include <gtest/gtest.h>

#include <limits>

#include "daemon/accuracy/report/report_page.hpp"
#include "daemon/accuracy/report/tables.hpp"
#include "tests/unit/accuracy_report/well_formed.hpp"

namespace darm::accuracy {
namespace {

constexpr double kLast = 1770000000, kEarlier = 1769900000;  // 2026-02-02 02:40 and 2026-01-31 22:53

Measurement result(Group group, const std::string& variant, double began, double speed) {
  Measurement m;
  m.camera = "hall";
  m.group = group;
  m.variant = variant;
  m.curve = {{0.5, 28, 1e5}, {2, 32, 1e6}};
  if (began > 0) m.figures[figure::kRunBegan] = began;
  if (speed > 0) m.figures[figure::kRaysPerSecond] = speed;
  return m;
}

Report report_of(std::vector<Measurement> measurements) {
  Report r;
  r.scene = "hall.glb";
  r.cameras = {{"hall", 0.97, 40.2}};
  r.measurements = std::move(measurements);
  return r;
}

Report resumed() {
  return report_of({result(Group::kPresets, kBalanced, kEarlier, 3e6), result(Group::kDensity, "q 32", kLast, 6e6),
                    result(Group::kDensity, "q 128", kLast, 5.5e6), result(Group::kCodec, "crf 18", 0, 0)});
}

TEST(Origins, OneRunHasNoStars) {
  const auto r =
      report_of({result(Group::kPresets, kBalanced, kLast, 5e6), result(Group::kDensity, "q 32", kLast, 6e6)});
  const Origins origins(r);
  for (const auto& m : r.measurements) EXPECT_EQ(origins.name_of(m), m.variant);
  EXPECT_EQ(sections_of(r, "hall")[0].tables[0].columns.back(), "camera frames take");
  EXPECT_EQ(html_page(r).find(" * Measured"), std::string::npos);
  EXPECT_NE(html_page(r).find("Measured 2026-02-02 02:40 UTC."), std::string::npos);
}

TEST(Origins, ResultsFromBeforeOriginsWereNotedAreOneRun) {
  const auto r = report_of({result(Group::kPresets, kBalanced, 0, 0), result(Group::kDensity, "q 32", 0, 0)});
  const Origins origins(r);
  for (const auto& m : r.measurements) EXPECT_FALSE(origins.is_apart(m));
  EXPECT_EQ(origins.when(), "");
}

TEST(Origins, WhatAnotherRunMeasuredHasAStarADateAndASpeed) {
  const auto r = resumed();
  const Origins origins(r);
  EXPECT_EQ(origins.name_of(r.measurements[0]), "balanced *");
  EXPECT_EQ(origins.words_of(r.measurements[0]), "2026-01-31 22:53 UTC, rays at 0.50 times the last run's usual speed");
  EXPECT_EQ(origins.name_of(r.measurements[1]), "q 32");
  EXPECT_EQ(origins.words_of(r.measurements[1]), "last run");
  EXPECT_EQ(origins.words_of(r.measurements[3]), "earlier, it is not known when");
}

TEST(Origins, AnotherLoadInOneRunHasAStarToo) {
  const auto r = report_of({result(Group::kPresets, kBalanced, kLast, 6e6), result(Group::kDensity, "q 32", kLast, 6e6),
                            result(Group::kDensity, "q 128", kLast, 3e6)});
  const Origins origins(r);
  EXPECT_FALSE(origins.is_apart(r.measurements[0]));
  EXPECT_EQ(origins.name_of(r.measurements[2]), "q 128 *");
  EXPECT_EQ(origins.words_of(r.measurements[2]), "last run, rays at 0.50 times its usual speed");
}

TEST(Origins, EachTableThatMixesRunsSaysSo) {
  const auto r = resumed();
  for (const auto& section : sections_of(r, "hall")) {
    const auto& table = section.tables.front();
    ASSERT_EQ(table.columns.back(), "measured") << section.heading;
    for (const auto& row : table.rows) EXPECT_EQ(row.size(), table.columns.size()) << section.heading;
  }
  const auto density = sections_of(r, "hall")[1];
  EXPECT_EQ(density.tables[0].rows[0].front(), "balanced *");
  EXPECT_EQ(density.tables[1].columns, (std::vector<std::string>{"dB", "balanced *", "q 32", "q 128"}));
  EXPECT_EQ(density.chart.series[0].label, "balanced *");
  EXPECT_EQ(testing::fault_of(html_page(r)), "");
  EXPECT_NE(html_page(r).find("* Measured in another run"), std::string::npos);
  EXPECT_NE(markdown_page(r, "x-").find("\\* Measured in another run"), std::string::npos);
}

TEST(Origins, OddNumbersAreNoDates) {
  for (const double odd :
       {-1.0, 1e15, std::numeric_limits<double>::infinity(), std::numeric_limits<double>::quiet_NaN()}) {
    auto m = result(Group::kPresets, kBalanced, kLast, 1);
    m.figures[figure::kRunBegan] = odd;
    m.figures[figure::kRaysPerSecond] = odd;
    const auto r = report_of({m});
    EXPECT_EQ(Origins(r).when(), "");
    EXPECT_EQ(Origins(r).words_of(r.measurements[0]).find("nan"), std::string::npos);
  }
}

}  // namespace
}  // namespace darm::accuracy

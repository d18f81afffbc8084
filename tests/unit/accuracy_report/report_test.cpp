#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <nlohmann/json.hpp>

#include "daemon/accuracy/report/report_page.hpp"
#include "daemon/accuracy/report/svg_chart.hpp"
#include "daemon/accuracy/report/tables.hpp"
#include "tests/unit/accuracy_report/well_formed.hpp"

namespace darm::accuracy {
namespace {

using testing::fault_of;

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();

Measurement curve(const std::string& camera, Group group, const std::string& variant, std::vector<Point> points) {
  Measurement m;
  m.key = "0123456789abcdef";
  m.camera = camera;
  m.group = group;
  m.variant = variant;
  m.curve = std::move(points);
  return m;
}

Report report_of(const std::string& camera) {
  Report r;
  r.scene = "hall & <tower>.glb";
  r.q = 64;
  r.threads = 2;
  r.width = 1280;
  r.height = 720;
  r.seconds = 16;
  r.cameras = {{camera, 0.97, 40.2}};
  r.plan = {{"sky", true, "the sky emits", "12 % of a path"}, {"normal maps", false, "no <normal> maps", {}}};
  r.measurements = {
      curve(camera, Group::kPresets, kBalanced, {{0.5, 28, 1e5}, {2, 32, 1e6}, {32, 37, 3e7}}),
      curve(camera, Group::kFrames, kCameraFrames, {{1, 20, 1}, {8, 28, 8}, {32, 34, 30}}),
      curve(camera, Group::kDensity, "q 128", {{0.7, 27, 1e5}, {16, 35, 1e7}}),
  };
  auto codec = curve(camera, Group::kCodec, "crf 18", {{0.5, 28, 1e5}});
  codec.figures = {{figure::kFirstCodecDb, 44.1}, {figure::kBytes, 1.5e6}, {figure::kEncodeSeconds, 0.025}};
  auto sky = curve(camera, Group::kEffects, "sky", {});
  sky.figures = {
      {figure::kWithoutDb, 31.2}, {figure::kAtLeast, 0}, {figure::kSecondsWith, 1.2}, {figure::kSecondsWithout, 0.9}};
  r.measurements.push_back(codec);
  r.measurements.push_back(sky);
  return r;
}

void expect_sound(const Report& r) {
  EXPECT_EQ(fault_of(html_page(r)), "");
  for (const auto& [name, svg] : svg_files(r, "x-")) EXPECT_EQ(fault_of(svg), "") << name;
  for (const auto& text : {html_page(r), markdown_page(r, "x-"), json_text(r), curves_csv(r), figures_csv(r)}) {
    EXPECT_EQ(text.find("nan"), std::string::npos);
    EXPECT_EQ(text.find(">inf"), std::string::npos);
  }
  EXPECT_FALSE(nlohmann::json::parse(json_text(r), nullptr, false).is_discarded());
}

TEST(Report, APageIsWellFormedWhateverTheNames) {
  for (const char* camera : {"atrium", "a<b>&\"c\"", "\xff\x01", "|pipe|\n", "-10,1.5,-0.3 10,4,0 60"})
    expect_sound(report_of(camera));
}

TEST(Report, OddNumbersLeaveAPageSound) {
  auto r = report_of("atrium");
  r.measurements[0].curve = {{0.5, kNan, kNan}, {2, 32, 1}, {3, std::numeric_limits<double>::infinity(), 1}};
  r.measurements[1].curve = {{0, -1e300, 0}};
  r.cameras[0].reference_psnr = std::numeric_limits<double>::infinity();
  expect_sound(r);
}

TEST(Report, NothingMeasuredIsAPageToo) {
  expect_sound(Report());
  auto r = report_of("atrium");
  r.measurements.clear();
  expect_sound(r);
}

TEST(Report, ThePageLoadsNothingAndRunsNothing) {
  const auto page = html_page(report_of("atrium"));
  for (const char* word : {"<script", "<link", "<img", "src=", "href=", "@import", "url("})
    EXPECT_EQ(page.find(word), std::string::npos) << word;
  EXPECT_NE(page.find("prefers-color-scheme:dark"), std::string::npos);
}

TEST(Report, TheVerdictComparesWithCameraFramesAtACommonDecibel) {
  // Balanced is at 34 dB after 2 * 16^(2/5) s = 6.06 s, camera frames after 32 s.
  EXPECT_NE(html_page(report_of("atrium")).find("takes 5.3 times as long to 34.0 dB"), std::string::npos);
}

TEST(Report, EachVariantOfAGroupStandsBesideBalancedAndCameraFrames) {
  const auto sections = sections_of(report_of("atrium"), "atrium");
  const auto density =
      std::find_if(sections.begin(), sections.end(), [](const Section& s) { return s.heading == "Texel density q"; });
  ASSERT_NE(density, sections.end());
  ASSERT_EQ(density->chart.series.size(), 3u);
  EXPECT_EQ(density->chart.series[0].label, kBalanced);
  EXPECT_EQ(density->chart.series[1].label, "q 128");
  EXPECT_EQ(density->chart.series[2].label, kCameraFrames);
}

TEST(Report, ADecibelOfAPriceTableIsWhereTheCurveSays) {
  const auto sections = sections_of(report_of("atrium"), "atrium");
  const auto& table = sections.front().tables.back();
  const auto row = std::find_if(table.rows.begin(), table.rows.end(), [](const auto& r) { return r[0] == "32"; });
  ASSERT_NE(row, table.rows.end());
  EXPECT_EQ((*row)[1], "2.0 (+0.59)");  // 2 s at 32 dB, 2 / 4^(1/4) = 1.41 s at 31
}

TEST(Report, ThePlanNamesACostOnlyWhereOneWasMeasured) {
  auto r = report_of("atrium");
  const auto table = plan_table(r);
  ASSERT_EQ(table.columns.size(), 4u);
  EXPECT_EQ(table.rows[0][3], "12 % of a path");
  EXPECT_EQ(table.rows[1][3], "–");
  r.plan[0].cost.clear();
  EXPECT_EQ(plan_table(r).columns.size(), 3u);
}

TEST(Report, CsvHasARowAPointAndAFigure) {
  const auto r = report_of("a,b");
  const auto curves = curves_csv(r);
  EXPECT_EQ(std::count(curves.begin(), curves.end(), '\n'), 1 + 3 + 3 + 2 + 1);
  EXPECT_NE(curves.find("\"a,b\",presets,balanced,0.5,28,1e+05\r\n"), std::string::npos);
  const auto figures = figures_csv(r);
  EXPECT_EQ(std::count(figures.begin(), figures.end(), '\n'), 1 + 3 + 4);
}

TEST(Chart, AnyNumberOfPointsIsDrawn) {
  for (const auto& points : std::vector<std::vector<Point>>{
           {}, {{1, 30, 0}}, {{1, 30, 0}, {1, 30, 0}}, {{1, 30, 0}, {2, 30, 0}}, {{-1, 30, 0}}, {{0, kNan, 0}}}) {
    const auto svg = svg_chart({"c", "t", "d", {{"label", points}}}, true);
    EXPECT_EQ(fault_of(svg), "");
    EXPECT_EQ(svg.find("nan"), std::string::npos);
    EXPECT_EQ(svg.find("inf"), std::string::npos);
  }
  EXPECT_NE(svg_chart({"c", "t", "d", {}}, true).find("no measurements"), std::string::npos);
}

TEST(Chart, NamesNeverCoverEachOther) {
  Chart chart{"c", "t", "d", {}};
  for (int i = 0; i < 7; ++i) chart.series.push_back({"same " + std::to_string(i), {{1, 30, 0}, {2, 33, 0}}});
  const auto svg = svg_chart(chart, true);
  std::vector<double> heights;
  for (std::size_t at = svg.find("class=\"name\""); at != std::string::npos; at = svg.find("class=\"name\"", at + 1))
    heights.push_back(std::stod(svg.substr(svg.find("y=\"", at) + 3)));
  ASSERT_EQ(heights.size(), 7u);
  std::sort(heights.begin(), heights.end());
  for (std::size_t i = 1; i < heights.size(); ++i) EXPECT_GE(heights[i] - heights[i - 1], 14);
  EXPECT_GE(heights.front(), 0);
  EXPECT_LE(heights.back(), 380);
}

TEST(Chart, ALogarithmicAxisHasFewRoundMarks) {
  EXPECT_EQ(log_marks(0.5, 20), (std::vector<double>{0.5, 1, 2, 5, 10, 20}));
  EXPECT_TRUE(log_marks(0, 1).empty());
  EXPECT_TRUE(log_marks(2, 2).empty());
  EXPECT_TRUE(log_marks(kNan, 1).empty());
  EXPECT_LE(log_marks(1e-6, 1e9).size(), 12u);
}

}  // namespace
}  // namespace darm::accuracy

#include "daemon/accuracy/report/results_file.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace darm::accuracy {
namespace {

Measurement sample(const std::string& key = "0123456789abcdef") {
  Measurement m;
  m.key = key;
  m.camera = "a \"quoted\", \\ name\n";
  m.group = Group::kDensity;
  m.variant = "q 128";
  m.curve = {{0.25, 27.123456789012345, 1000}, {1.5, 33, 2e6}};
  m.figures = {{figure::kLightDb, 33.25}};
  return m;
}

class ResultsFile : public ::testing::Test {
 protected:
  std::filesystem::path file =
      std::filesystem::temp_directory_path() / ("darm-results-" + std::to_string(::getpid()) + ".jsonl");
  void SetUp() override { std::filesystem::remove(file); }
  void TearDown() override { std::filesystem::remove(file); }
};

TEST_F(ResultsFile, AMeasurementComesBackAsItWas) {
  const auto m = sample();
  const auto line = to_line(m);
  EXPECT_EQ(line.find('\n'), std::string::npos);
  const auto back = parse_line(line);
  ASSERT_TRUE(back) << back.error().message;
  EXPECT_EQ(back->camera, m.camera);
  EXPECT_EQ(back->group, m.group);
  ASSERT_EQ(back->curve.size(), 2u);
  EXPECT_EQ(back->curve[0].db, m.curve[0].db);
  EXPECT_EQ(back->figures, m.figures);
}

TEST_F(ResultsFile, ALineThatWasCutOffIsLostAloneAndNothingIsAddedToIt) {
  ASSERT_TRUE(append_result(file, sample("0000000000000001")));
  const auto whole = std::filesystem::file_size(file);
  ASSERT_TRUE(append_result(file, sample("0000000000000002")));
  std::filesystem::resize_file(file, whole + 30);
  ASSERT_TRUE(append_result(file, sample("0000000000000003")));
  const auto loaded = load_results(file);
  ASSERT_TRUE(loaded);
  ASSERT_EQ(loaded->size(), 2u);
  EXPECT_EQ((*loaded)[0].key, "0000000000000001");
  EXPECT_EQ((*loaded)[1].key, "0000000000000003");
}

TEST_F(ResultsFile, TheLaterOfTwoResultsCounts) {
  auto later = sample();
  later.variant = "later";
  const auto made = parse_results(to_line(sample()) + "\n" + to_line(later) + "\n");
  ASSERT_EQ(made.size(), 1u);
  EXPECT_EQ(made[0].variant, "later");
}

TEST_F(ResultsFile, NoFileHoldsNothingAndAFolderIsAnError) {
  ASSERT_TRUE(load_results(file));
  EXPECT_TRUE(load_results(file)->empty());
  EXPECT_FALSE(load_results(std::filesystem::temp_directory_path()));
}

TEST_F(ResultsFile, WhatIsNoResultIsRefused) {
  const std::string good = to_line(sample());
  const auto with = [&](const std::string& what, const std::string& instead) {
    auto text = good;
    const auto at = text.find(what);
    EXPECT_NE(at, std::string::npos) << what;
    return text.replace(at, what.size(), instead);
  };
  for (const auto& line :
       {std::string(), std::string("null"), std::string("[]"), std::string("{}"), with("0123456789abcdef", "0123"),
        with("0123456789abcdef", "0123456789ABCDEF"), with("\"q\"", "\"none\""), with("0.25", "null"),
        with("0.25", "2.5"), with("0.25", "-1"), with("33.25", "1e400"), with("33.25", "\"x\""), with("33.25", "1e99"),
        with("1000.0", "[[[[[[[[[[[[1]]]]]]]]]]]]"), good.substr(0, good.size() - 1)})
    EXPECT_FALSE(parse_line(line)) << line;
}

}  // namespace
}  // namespace darm::accuracy

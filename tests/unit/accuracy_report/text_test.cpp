#include "daemon/accuracy/report/text.hpp"

#include <gtest/gtest.h>

#include <limits>

namespace darm::accuracy {
namespace {

constexpr double kNan = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();

TEST(Text, NumbersHaveAsManyDigitsAsTheyMean) {
  EXPECT_EQ(seconds_text(0.3456), "0.35");
  EXPECT_EQ(seconds_text(2.149), "2.1");
  EXPECT_EQ(seconds_text(9.96), "10");
  EXPECT_EQ(seconds_text(123.4), "123");
  EXPECT_EQ(seconds_text(0.0042), "under 0.01");
  EXPECT_EQ(db_text(37.649), "37.6");
  EXPECT_EQ(ratio_text(0.994), "0.99");
  EXPECT_EQ(bytes_text(830'400), "830 kB");
  EXPECT_EQ(bytes_text(999'600), "1.0 MB");
  EXPECT_EQ(count_text(16), "16");
  EXPECT_EQ(count_text(45'200), "45 k");
  EXPECT_EQ(count_text(1.23e6), "1.2 M");
}

TEST(Text, WhatIsNoNumberIsNeverPrinted) {
  for (const double x : {kNan, kInfinity, -kInfinity}) {
    for (const auto& made : {seconds_text(x), db_text(x), ratio_text(x), bytes_text(x), count_text(x)})
      EXPECT_EQ(made, kNothing);
    EXPECT_EQ(exact_text(x), "");
  }
}

TEST(Text, ExactNumbersReadBackTheSame) {
  for (const double x : {0.1, 1.0 / 3, 37.64951234567, 1e-7}) EXPECT_EQ(std::stod(exact_text(x)), x);
}

TEST(Text, XmlHoldsAnyBytes) {
  EXPECT_EQ(xml_text("<a href=\"x\" & 'y'>"), "&lt;a href=&quot;x&quot; &amp; &#39;y&#39;&gt;");
  EXPECT_EQ(xml_text("Rückseite – ok"), "Rückseite – ok");
  const std::string bad = "\xef\xbf\xbd";
  EXPECT_EQ(xml_text(std::string_view("a\0b", 3)), "a" + bad + "b");
  EXPECT_EQ(xml_text("\x1b[2J"), bad + "[2J");
  EXPECT_EQ(xml_text("\xff"), bad);
  EXPECT_EQ(xml_text("\xc3"), bad);                      // cut off
  EXPECT_EQ(xml_text("\xc0\xaf"), bad + bad);            // overlong
  EXPECT_EQ(xml_text("\xed\xa0\x80"), bad + bad + bad);  // surrogate
}

TEST(Text, AMarkdownCellStaysOneCell) {
  EXPECT_EQ(markdown_text("a|b\nc"), "a\\|b c");
  EXPECT_EQ(markdown_text("<b>*x*"), "&lt;b>\\*x\\*");
}

TEST(Text, CsvFieldsAreQuotedWhereTheyMustBe) {
  EXPECT_EQ(csv_field("plain"), "plain");
  EXPECT_EQ(csv_field("1,2"), "\"1,2\"");
  EXPECT_EQ(csv_field("say \"so\""), "\"say \"\"so\"\"\"");
  EXPECT_EQ(csv_field("two\nlines"), "\"two\nlines\"");
  EXPECT_EQ(csv_field(" blank"), "\" blank\"");
}

}  // namespace
}  // namespace darm::accuracy

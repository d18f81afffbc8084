#include <gtest/gtest.h>

#include "daemon/config/toml_value.hpp"

namespace darm::config {
namespace {

TEST(TomlHardening, NonAsciiIsTakenInQuotesAndCommentsOnly) {
  EXPECT_TRUE(parse_toml("\xef\xbb\xbfname = \"k\xc3\xbc"
                         "che\" # \xe3\x81\x82\nother = 'caf\xc3\xa9'\n")
                  .has_value());
  const auto bare = parse_toml("a = 1\n\xe3\x81\x82 = 2\n");
  ASSERT_FALSE(bare.has_value());
  EXPECT_EQ(bare.error().line, 2);
}

}  // namespace
}  // namespace darm::config

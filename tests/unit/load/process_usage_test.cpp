#include "client/load/process_usage.hpp"

#include <gtest/gtest.h>
#include <unistd.h>

namespace darm::client::load {
namespace {

TEST(ProcessUsage, TimeAndMemoryAreReadPastWhateverNameAProcessHas) {
  const auto usage = parse_stat(
      "42 (a) R 1) S 1 42 42 0 -1 4194304 100 0 0 0 250 50 7 8 20 0 3 0 1000 12345678 2000 18446744073709551615 0\n",
      100, 4096);
  ASSERT_TRUE(usage.has_value());
  EXPECT_DOUBLE_EQ(usage->cpu_seconds, 3.0);
  EXPECT_EQ(usage->rss_bytes, 2000u * 4096);
}

TEST(ProcessUsage, AnotherTextIsRefused) {
  EXPECT_FALSE(parse_stat("", 100, 4096).has_value());
  EXPECT_FALSE(parse_stat("42 (a) S 1 2 3", 100, 4096).has_value());
  EXPECT_FALSE(parse_stat("42 (a) S 1 2 3 4 5 6 7 8 9 10 x y 0 0 0 0 0 0 0 0 0 0", 100, 4096).has_value());
}

TEST(ProcessUsage, OfThisProcessIsKnownAndOfNoProcessIsNot) {
  const auto own = usage_of(::getpid());
  ASSERT_TRUE(own.has_value());
  EXPECT_GT(own->rss_bytes, 0u);
  EXPECT_GT(own->descriptors, 2u);
  EXPECT_GE(own_cpu_seconds(), 0.0);
  EXPECT_FALSE(usage_of(-1).has_value());
}

TEST(ProcessUsage, TooFewDescriptorsAreSaidInOneSentence) {
  EXPECT_EQ(descriptor_warning(1024, 100), "");
  const auto warning = descriptor_warning(200, 100);
  EXPECT_NE(warning.find("ulimit -n 264"), std::string::npos) << warning;
  EXPECT_EQ(warning.find('\n'), std::string::npos);
}

}  // namespace
}  // namespace darm::client::load

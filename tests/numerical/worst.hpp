// What a numerical test reports: how many cases it looked at, and the worst of them against what is allowed.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstddef>
#include <cstdio>
#include <limits>
#include <sstream>
#include <string>
#include <utility>

namespace darm::numerical {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
inline constexpr bool kSanitized = true;
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kSanitized = true;
#else
inline constexpr bool kSanitized = false;
#endif
#else
inline constexpr bool kSanitized = false;
#endif

/// Sanitizers at -O0 are some thirty times slower, and look for other faults than these: they get a sixteenth of the
/// cases. Statistical tests judge by the standard error of what they drew, so they stay as strict.
template <class Count>
[[nodiscard]] constexpr Count scaled(Count n) {
  return kSanitized ? (n + 15) / 16 : n;
}

/// Collects figures of one kind over a test's cases; larger is worse, NaN is worst. On destruction it fails the test if
/// the worst is over `allowed`, prints one line, and records "worst allowed cases" under the figure's name for
/// report.py. Names are unique within a test.
class Worst {
 public:
  Worst(std::string what, double allowed) : what_(std::move(what)), allowed_(allowed) {}
  Worst(const Worst&) = delete;
  Worst& operator=(const Worst&) = delete;
  ~Worst() {
    EXPECT_GT(cases_, 0u) << what_ << ": nothing was looked at";
    EXPECT_LE(worst_, allowed_) << what_ << ", " << where_;
    std::ostringstream figures;
    figures << worst_ << ' ' << allowed_ << ' ' << cases_;
    ::testing::Test::RecordProperty(what_, figures.str());
    std::printf("worst: %s: %.3g of %.3g in %zu cases%s%s\n", what_.c_str(), worst_, allowed_, cases_,
                where_.empty() ? "" : ", at ", where_.c_str());
  }

  /// `where` is written down only if this is the worst so far.
  template <class... Where>
  void see(double figure, const Where&... where) {
    ++cases_;
    if (figure <= worst_ || std::isnan(worst_)) return;
    worst_ = figure;
    std::ostringstream text;
    ((text << where << ' '), ...);
    where_ = text.str();
  }

 private:
  std::string what_;
  double allowed_;
  double worst_ = -std::numeric_limits<double>::infinity();
  std::size_t cases_ = 0;
  std::string where_;
};

}  // namespace darm::numerical

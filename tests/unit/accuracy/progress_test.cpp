#include "daemon/progress.hpp"

#include <gtest/gtest.h>

#include <cstdlib>

#include "daemon/reference_words.hpp"

namespace darm {
namespace {

using namespace std::chrono_literals;

TEST(ProgressBar, FitsAndNeverLies) {
  EXPECT_EQ(progress_bar(0.5, "words", 80), "[############------------]  50 %  words");
  EXPECT_EQ(progress_bar(7, "", 80), progress_bar(1, "", 80));
  EXPECT_EQ(progress_bar(0.0 / 0.0, "", 80), progress_bar(0, "", 80));
  EXPECT_EQ(progress_bar(0.999, "", 80).find("100"), std::string::npos);
  EXPECT_EQ(progress_bar(0.5, std::string(200, 'x'), 60).size(), 60u);
}

// What is written, by a clock that the test moves.
class Written {
 public:
  Written() : file_(open_memstream(&text_, &size_)) {}
  ~Written() {
    std::fclose(file_);
    std::free(text_);  // NOLINT(cppcoreguidelines-no-malloc): open_memstream's
  }
  Written(const Written&) = delete;
  Written& operator=(const Written&) = delete;
  [[nodiscard]] ProgressOutput output(bool terminal) {
    return {.file = file_, .terminal = terminal, .now = [this] { return now_; }};
  }
  void pass(std::chrono::milliseconds time) { now_ += time; }
  [[nodiscard]] std::string text() {
    std::fflush(file_);
    return {text_, size_};
  }

 private:
  char* text_ = nullptr;
  std::size_t size_ = 0;
  std::FILE* file_;
  std::chrono::steady_clock::time_point now_{1h};
};

TEST(Progress, ALogHasALineForEveryTenSecondsOfSilence) {
  Written written;
  Progress progress("cmd", false, written.output(false));
  for (int i = 1; i <= 250; ++i) {
    written.pass(100ms);
    progress.show(0, std::to_string(i));
  }
  EXPECT_EQ(written.text(), "cmd: 100\ncmd: 200\n");
  progress.done(1, "piece");
  written.pass(9900ms);
  progress.show(0, "too soon");
  EXPECT_EQ(written.text(), "cmd: 100\ncmd: 200\ncmd: piece\n");
}

TEST(Progress, ATerminalHasOneLineThatMoves) {
  Written written;
  Progress progress("cmd", false, written.output(true));
  progress.show(0, "one");
  progress.show(0, "too soon");
  written.pass(100ms);
  progress.begin(2);
  progress.show(1, "two");
  progress.warn("careful");
  EXPECT_EQ(written.text(),
            "\r\x1b[Kcmd: one\r\x1b[K[############------------]  50 %  two\r\x1b[Kcmd: warning: careful\n");
}

TEST(Progress, QuietSaysOnlyWhatMustBeKnown) {
  Written written;
  Progress progress("cmd", true, written.output(false));
  written.pass(1h);
  progress.show(0, "x");
  progress.done(1, "y");
  progress.announce("stopped");
  EXPECT_EQ(written.text(), "cmd: stopped\n");
}

TEST(ReferenceWords, ThePsnrIsNamedOnceItIsMeasuredAndNeverBeyondSense) {
  EXPECT_EQ(reference_words({24, 64, 0, 12.4}, 1000), "24 of 64 samples per pixel, 12 s");
  EXPECT_EQ(reference_words({24, 64, 31.204, 12.4}, 1000), "24 of 64 samples per pixel, own PSNR 31.20 dB, 12 s");
  EXPECT_EQ(reference_words({24, 1000, 655.96, 0}, 1000), "24 samples per pixel, own PSNR over 100 dB, 0 s");
  EXPECT_EQ(decibel_words(std::numeric_limits<double>::infinity()), "over 100 dB");
}

}  // namespace
}  // namespace darm

// How far a long command is: a line that moves on a terminal, plain lines now and then elsewhere.
#pragma once

#include <chrono>
#include <cstdio>
#include <functional>
#include <string>

namespace darm {

/// "[#####-----]  50 %  words", at most `width` columns; a share that is no number counts as 0. Pure.
[[nodiscard]] std::string progress_bar(double share, const std::string& words, std::size_t width);

/// Where progress is written, and by which clock.
struct ProgressOutput {
  std::FILE* file = nullptr;
  bool terminal = false;
  std::function<std::chrono::steady_clock::time_point()> now = std::chrono::steady_clock::now;
};

/// One thread.
class Progress {
 public:
  /// `name` begins each plain line. `quiet`: nothing is written but warnings and what is announced.
  Progress(std::string name, bool quiet, ProgressOutput output);
  /// To standard error.
  Progress(std::string name, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Work ahead, in any unit (seconds, say). Until then, or with 0, there are words and no bar.
  void begin(double total) { total_ = total; }
  /// Under way: `part` of the unit beyond what is done. A terminal shows it at once, though at most ten times a second;
  /// elsewhere it is a line whenever nothing has been said for ten seconds.
  void show(double part, const std::string& words);
  /// A piece worth `worth` is done: a line.
  void done(double worth, const std::string& words);
  /// A line, however quiet.
  void announce(const std::string& words) { say(words); }
  void warn(const std::string& words) { say("warning: " + words); }

 private:
  void clear();
  void say(const std::string& words);
  std::string name_;
  bool quiet_;
  ProgressOutput output_;
  bool drawn_ = false;
  double total_ = 0;
  double done_ = 0;
  std::chrono::steady_clock::time_point drawn_at_{};
  std::chrono::steady_clock::time_point said_at_;
};

}  // namespace darm

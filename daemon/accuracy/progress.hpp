// How far a long command is: a bar on a terminal, plain lines elsewhere.
#pragma once

#include <chrono>
#include <cstdio>
#include <string>

namespace darm::accuracy {

/// "[#####-----]  50 %  words", at most `width` columns; a share that is no number counts as 0. Pure.
[[nodiscard]] std::string progress_bar(double share, const std::string& words, std::size_t width);

/// Writes to standard error; one thread.
class Progress {
 public:
  /// `name` begins each plain line. `quiet`: nothing is written but warnings.
  Progress(std::string name, bool quiet);
  ~Progress();
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// Work ahead, in any unit (seconds, say).
  void begin(double total) { total_ = total; }
  /// Under way: `part` of the unit beyond what is done. On a terminal the bar moves, at most ten times a second.
  void show(double part, const std::string& words);
  /// A piece worth `worth` is done: a line elsewhere.
  void done(double worth, const std::string& words);
  void warn(const std::string& words);

 private:
  void clear();
  std::string name_;
  bool quiet_;
  bool terminal_;
  bool drawn_ = false;
  double total_ = 1;
  double done_ = 0;
  std::chrono::steady_clock::time_point drawn_at_{};
};

}  // namespace darm::accuracy

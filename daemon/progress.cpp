#include "daemon/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace darm {
namespace {

constexpr std::size_t kBar = 24;
constexpr auto kRedrawn = std::chrono::milliseconds(100);
constexpr auto kSilence = std::chrono::seconds(10);

std::size_t terminal_width(std::FILE* file) {
  winsize size{};
  return ::ioctl(::fileno(file), TIOCGWINSZ, &size) == 0 && size.ws_col > 20 ? size.ws_col : 80;
}

}  // namespace

std::string progress_bar(double share, const std::string& words, std::size_t width) {
  const double s = std::isfinite(share) ? std::clamp(share, 0.0, 1.0) : 0.0;
  const auto full = static_cast<std::size_t>(s * kBar);
  char percent[16];
  std::snprintf(percent, sizeof percent, "] %3.0f %%  ", std::floor(100 * s));
  std::string out = "[" + std::string(full, '#') + std::string(kBar - full, '-') + percent + words;
  if (out.size() > width) out.resize(width);
  return out;
}

Progress::Progress(std::string name, bool quiet, ProgressOutput output)
    : name_(std::move(name)), quiet_(quiet), output_(std::move(output)), said_at_(output_.now()) {}

Progress::Progress(std::string name, bool quiet)
    : Progress(std::move(name), quiet, {.file = stderr, .terminal = ::isatty(STDERR_FILENO) == 1}) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (std::exchange(drawn_, false)) std::fputs("\r\x1b[K", output_.file);
}

void Progress::say(const std::string& words) {
  clear();
  said_at_ = output_.now();
  std::fprintf(output_.file, "%s: %s\n", name_.c_str(), words.c_str());
}

void Progress::show(double part, const std::string& words) {
  if (quiet_) return;
  const auto now = output_.now();
  if (!output_.terminal) {
    if (now - said_at_ >= kSilence) say(words);
    return;
  }
  if (now - drawn_at_ < kRedrawn) return;
  drawn_at_ = now;
  drawn_ = true;
  const std::size_t width = terminal_width(output_.file) - 1;
  const std::string line =
      total_ > 0 ? progress_bar((done_ + part) / total_, words, width) : (name_ + ": " + words).substr(0, width);
  std::fprintf(output_.file, "\r\x1b[K%s", line.c_str());
}

void Progress::done(double worth, const std::string& words) {
  done_ += worth;
  if (!quiet_) say(words);
}

}  // namespace darm

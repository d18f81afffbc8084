#include "daemon/accuracy/progress.hpp"

#include <sys/ioctl.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <utility>

namespace darm::accuracy {
namespace {

constexpr std::size_t kBar = 24;

std::size_t terminal_width() {
  winsize size{};
  return ::ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 20 ? size.ws_col : 80;
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

Progress::Progress(std::string name, bool quiet)
    : name_(std::move(name)), quiet_(quiet), terminal_(::isatty(STDERR_FILENO) == 1) {}

Progress::~Progress() { clear(); }

void Progress::clear() {
  if (std::exchange(drawn_, false)) std::fputs("\r\x1b[K", stderr);
}

void Progress::show(double part, const std::string& words) {
  const auto now = std::chrono::steady_clock::now();
  if (quiet_ || !terminal_ || now - drawn_at_ < std::chrono::milliseconds(100)) return;
  drawn_at_ = now;
  drawn_ = true;
  const double share = total_ > 0 ? (done_ + part) / total_ : 0;
  std::fprintf(stderr, "\r\x1b[K%s", progress_bar(share, words, terminal_width() - 1).c_str());
}

void Progress::done(double worth, const std::string& words) {
  done_ += worth;
  if (quiet_) return;
  clear();
  std::fprintf(stderr, "%s: %s\n", name_.c_str(), words.c_str());
}

void Progress::warn(const std::string& words) {
  clear();
  std::fprintf(stderr, "%s: warning: %s\n", name_.c_str(), words.c_str());
}

}  // namespace darm::accuracy

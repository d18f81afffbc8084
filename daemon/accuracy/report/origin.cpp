#include "daemon/accuracy/report/origin.hpp"

#include <algorithm>
#include <cmath>
#include <ctime>

#include "daemon/accuracy/report/text.hpp"

namespace darm::accuracy {
namespace {

// Within one run: what a short look at the machine's speed is uncertain by, generously.
constexpr double kSlower = 0.7, kFaster = 1 / kSlower;

double figure_or_0(const Measurement& m, const char* name) {
  const auto it = m.figures.find(name);
  return it == m.figures.end() || !std::isfinite(it->second) ? 0 : it->second;
}

std::string date_text(double seconds_since_1970) {
  constexpr double kYear10000 = 253402300800;
  if (!(seconds_since_1970 > 0 && seconds_since_1970 < kYear10000)) return {};
  const auto time = static_cast<std::time_t>(seconds_since_1970);
  std::tm utc{};
  char out[32];
  if (gmtime_r(&time, &utc) == nullptr || std::strftime(out, sizeof out, "%Y-%m-%d %H:%M UTC", &utc) == 0) return {};
  return out;
}

}  // namespace

Origins::Origins(const Report& report) {
  for (const auto& m : report.measurements) last_ = std::max(last_, figure_or_0(m, figure::kRunBegan));
  std::vector<double> speeds;
  for (const auto& m : report.measurements)
    if (const double speed = figure_or_0(m, figure::kRaysPerSecond); speed > 0 && is_of_last_run(m))
      speeds.push_back(speed);
  if (speeds.empty()) return;
  const auto middle = speeds.begin() + static_cast<std::ptrdiff_t>(speeds.size() / 2);
  std::nth_element(speeds.begin(), middle, speeds.end());
  speed_ = *middle;
}

bool Origins::is_of_last_run(const Measurement& m) const { return figure_or_0(m, figure::kRunBegan) == last_; }

// 1 where it is not known.
double Origins::speed_ratio(const Measurement& m) const {
  const double speed = figure_or_0(m, figure::kRaysPerSecond);
  return speed > 0 && speed_ > 0 ? speed / speed_ : 1;
}

bool Origins::is_apart(const Measurement& m) const {
  const double ratio = speed_ratio(m);
  return !is_of_last_run(m) || ratio < kSlower || ratio > kFaster;
}

std::string Origins::name_of(const Measurement& m) const { return m.variant + (is_apart(m) ? " *" : ""); }

std::string Origins::words_of(const Measurement& m) const {
  const auto date = date_text(figure_or_0(m, figure::kRunBegan));
  std::string out = is_of_last_run(m) ? "last run" : date.empty() ? "earlier, it is not known when" : date;
  if (is_apart(m) && figure_or_0(m, figure::kRaysPerSecond) > 0 && speed_ > 0)
    out += ", rays at " + ratio_text(speed_ratio(m)) + " times " + (is_of_last_run(m) ? "its" : "the last run's") +
           " usual speed";
  return out;
}

std::string Origins::when() const {
  const auto date = date_text(last_);
  return date.empty() ? date : "Measured " + date;
}

}  // namespace darm::accuracy

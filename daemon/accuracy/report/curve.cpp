#include "daemon/accuracy/report/curve.hpp"

#include <algorithm>
#include <cmath>

namespace darm::accuracy {

std::optional<double> time_to(const std::vector<Point>& curve, double db) {
  if (curve.empty() || curve.back().db < db) return std::nullopt;
  std::size_t above = curve.size() - 1;
  while (above > 0 && curve[above - 1].db >= db) --above;
  const Point& b = curve[above];
  if (above == 0) return b.seconds;
  const Point& a = curve[above - 1];
  const double share = b.db > a.db ? std::clamp((db - a.db) / (b.db - a.db), 0.0, 1.0) : 1.0;
  if (!(a.seconds > 0) || !(b.seconds > a.seconds)) return b.seconds;
  return a.seconds * std::pow(b.seconds / a.seconds, share);
}

std::vector<DecibelPrice> decibel_prices(const std::vector<Point>& curve) {
  std::vector<DecibelPrice> prices;
  if (curve.empty() || !std::isfinite(curve.front().db) || !std::isfinite(curve.back().db)) return prices;
  const int first = static_cast<int>(std::ceil(std::clamp(curve.front().db, -10.0, 110.0)));
  const int last = static_cast<int>(std::floor(std::clamp(curve.back().db, -10.0, 110.0)));
  for (int db = first; db < last; ++db) {
    const auto from = time_to(curve, db);
    const auto to = time_to(curve, db + 1);
    if (!from || !to) continue;
    prices.push_back({db, *to, std::max(*to - *from, 0.0)});
  }
  return prices;
}

std::optional<double> time_ratio(const std::vector<Point>& curve, const std::vector<Point>& other, double db) {
  const auto a = time_to(curve, db);
  const auto b = time_to(other, db);
  if (!a || !b || !(*b > 0)) return std::nullopt;
  return *a / *b;
}

}  // namespace darm::accuracy

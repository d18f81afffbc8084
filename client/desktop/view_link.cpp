#include "client/desktop/view_link.hpp"

#include <fmt/format.h>

#include <array>
#include <charconv>
#include <cmath>
#include <glm/geometric.hpp>

namespace darm::client::desktop {
namespace {

constexpr std::string_view kMark = "#view=";
constexpr double kFarthest = 1e9;  // metres

// `text` is N finite numbers with `separators` (one character each) between them, and nothing else.
template <std::size_t N>
bool read_numbers(std::string_view text, const char (&separators)[N], std::array<double, N>& out) {
  const char* at = text.data();
  const char* last = at + text.size();
  for (std::size_t i = 0; i < N; ++i) {
    const auto [end, error] = std::from_chars(at, last, out[i]);
    if (error != std::errc() || !std::isfinite(out[i])) return false;
    at = end;
    if (i + 1 == N) break;
    if (at == last || *at != separators[i]) return false;
    ++at;
  }
  return at == last;
}

}  // namespace

std::string to_link(const UprightView& view) {
  return fmt::format("{}{:.9g},{:.9g},{:.9g},{:.7g},{:.7g},{:.7g}", kMark, view.position.x, view.position.y,
                     view.position.z, view.yaw / kDegree, view.pitch / kDegree, view.fovy / kDegree);
}

std::optional<UprightView> from_link(std::string_view text) {
  const auto mark = text.rfind(kMark);
  if (mark == std::string_view::npos) return std::nullopt;
  std::array<double, 6> v{};
  if (!read_numbers(text.substr(mark + kMark.size()), ",,,,,", v)) return std::nullopt;
  UprightView view{{v[0], v[1], v[2]}, v[3] * kDegree, v[4] * kDegree, v[5] * kDegree};
  if (!(glm::length(view.position) <= kFarthest) || std::abs(v[4]) > 90) return std::nullopt;
  if (view.fovy < kNarrowest * 0.999 || view.fovy > kWidest * 1.001) return std::nullopt;
  return tidy(view);
}

Result<UprightView> read_view(std::string_view text) {
  if (const auto linked = from_link(text)) return *linked;
  std::array<double, 7> v{};
  if (read_numbers(text, ",, ,, ", v)) {
    const glm::dvec3 position(v[0], v[1], v[2]), target(v[3], v[4], v[5]);
    if (glm::length(position) <= kFarthest && glm::length(target) <= kFarthest && v[6] * kDegree >= kNarrowest &&
        v[6] * kDegree <= kWidest)
      return upright(look_at(position, target, v[6], 1, 1));
  }
  return fail(
      fmt::format("--camera {}: expected \"px,py,pz tx,ty,tz fovy\" or a link that ends in "
                  "\"#view=x,y,z,yaw,pitch,fovy\" (metres, degrees; fovy 1 to 150)",
                  text));
}

}  // namespace darm::client::desktop

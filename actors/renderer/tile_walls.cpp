#include "actors/renderer/tile_walls.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <optional>

namespace darm::renderer {
namespace {

constexpr float kLift = 0.25f;     // texels
constexpr float kOverRise = 2.0f;  // of what the surface rises over the line as seen at its middle
constexpr int kShortest = 6;       // texels: shorter lines are foliage and trim, which cost most and lose least
constexpr int kMostLooks = 1024;

// Points of a line: the tile's border before its first texel, its texels' middles, the border after its last.
constexpr int kPoints = kTileSize + 2;

class Line {
 public:
  Line(const atlas::TileTexels& texels, const trace::RayScene& rays, int number, bool row)
      : texels_(texels), rays_(rays), number_(number), row_(row) {}

  [[nodiscard]] std::uint32_t walls(int& looks_left) {
    std::uint32_t found = 0;
    for (int first = 0; first < kTileSize;) {
      int end = first + 1;
      while (end < kTileSize && goes_on(end)) ++end;
      if (end - first >= kShortest && !gutter(first))
        search_line(
            first == 0 ? 0 : first + 1, end == kTileSize ? kPoints - 1 : end,
            [&](int a, int b) { return --looks_left < 0 || clear(a, b); }, [&](int k) { found |= 1u << k; });
      first = end;
    }
    return found;
  }

 private:
  [[nodiscard]] int x(int i) const { return row_ ? i : number_; }
  [[nodiscard]] int y(int i) const { return row_ ? number_ : i; }
  [[nodiscard]] bool gutter(int i) const {
    return texels_.patch_at(x(i), y(i)) == kNoPatch || texels_.is_gutter(x(i), y(i));
  }
  // Texel i is of the same patch and kind as that before it.
  [[nodiscard]] bool goes_on(int i) const {
    return texels_.patch_at(x(i), y(i)) == texels_.patch_at(x(i - 1), y(i - 1)) && gutter(i) == gutter(i - 1);
  }

  [[nodiscard]] const std::optional<trace::Surface>& at(int point) {
    const auto p = static_cast<std::size_t>(point);
    if (known_[p]) return points_[p];
    known_[p] = true;
    const int texel = std::clamp(point - 1, 0, kTileSize - 1);
    const float along = point == 0 ? 0.0f : point == kPoints - 1 ? 1.0f : 0.5f;
    const auto found = texels_.sample(x(texel), y(texel), row_ ? glm::vec2(along, 0.5f) : glm::vec2(0.5f, along));
    if (found) points_[p] = trace::make_unbent_surface(rays_, trace::off_edges(rays_, *found));
    return points_[p];
  }

  [[nodiscard]] bool clear(int first, int last) {
    const auto& a = at(first);
    const auto& b = at(last);
    if (!a || !b) return true;
    const float length = glm::length(b->position - a->position);
    float lift = kLift * length / static_cast<float>(last - first);
    if (last - first > 1) {
      const int middle = first + (last - first) / 2;
      const auto& m = at(middle);
      if (!m) return true;
      const float part = static_cast<float>(middle - first) / static_cast<float>(last - first);
      const glm::vec3 line = glm::mix(a->position, b->position, part);
      lift += kOverRise * std::abs(glm::dot(m->position - line, m->geometric_normal));
    }
    return !(lift > 0) || !parted(rays_, *a, *b, lift);
  }

  const atlas::TileTexels& texels_;
  const trace::RayScene& rays_;
  int number_;
  bool row_;
  std::array<bool, kPoints> known_{};
  std::array<std::optional<trace::Surface>, kPoints> points_;
};

}  // namespace

bool parted(const trace::RayScene& rays, const trace::Surface& a, const trace::Surface& b, float lift) {
  const float over = lift + std::max(a.offset, b.offset);
  trace::Ray look;
  look.origin = a.position + a.geometric_normal * over;
  look.direction = b.position + b.geometric_normal * over - look.origin;
  look.tmax = 1;
  return rays.occluded(look);
}

TileWalls find_walls(const atlas::TileTexels& texels, const trace::RayScene& rays) {
  TileWalls walls;
  int looks_left = kMostLooks;
  for (int i = 0; i < kTileSize; ++i) {
    walls.rows[static_cast<std::size_t>(i)] = Line(texels, rays, i, true).walls(looks_left);
    walls.columns[static_cast<std::size_t>(i)] = Line(texels, rays, i, false).walls(looks_left);
  }
  return walls;
}

}  // namespace darm::renderer

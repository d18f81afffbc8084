#include "actors/atlas/pack.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <map>

#include "actors/atlas/strip.hpp"

namespace darm::atlas {
namespace {

/// A group holds this share of a level: of Sponza at q=64 two thousand tiles, about what one view shows.
constexpr std::uint64_t kGroups = 16;
/// Patches over this share of a level go before all groups, longest first: what sticks out of a group is never filled
/// well. They fill tiles of their own, so little locality is lost.
constexpr std::uint64_t kBigShare = 8000;
constexpr std::int32_t kPreferredWidth = 64 * kTileSize;

std::uint64_t spread_bits(std::uint64_t v) {  // 21 bits, two zeros between
  v = (v | v << 32) & 0x1f00000000ffffull;
  v = (v | v << 16) & 0x1f0000ff0000ffull;
  v = (v | v << 8) & 0x100f00f00f00f00full;
  v = (v | v << 4) & 0x10c30c30c30c30c3ull;
  return (v | v << 2) & 0x1249249249249249ull;
}

struct PatchPlace {
  glm::dvec3 centre{0.0};
  glm::dvec3 normal{0.0};
  double area = 0;
};

/// Area-weighted centre and normal of the local patches of one instance, in world space.
std::vector<PatchPlace> places_of(const scene::Scene& scene, const Charts& charts, std::size_t instance) {
  const auto& chart = charts.charts[charts.instances[instance].chart];
  const auto& mesh = scene.meshes[chart.mesh];
  const glm::dmat4 to_world(scene.instances[instance].to_world);
  std::vector<PatchPlace> out(chart.patch_count);
  for (std::size_t t = 0; t < mesh.triangles.size(); ++t) {
    if (chart.local_patch[t] == kDroppedTriangle) continue;
    const auto at = [&](int c) { return glm::dvec3(to_world * glm::dvec4(mesh.positions[mesh.triangles[t][c]], 1.0)); };
    const glm::dvec3 a = at(0), b = at(1), c = at(2);
    const glm::dvec3 n = glm::cross(b - a, c - a);
    const double area = glm::length(n);
    auto& p = out[chart.local_patch[t]];
    p.centre += (a + b + c) * (area / 3);
    p.normal += n;
    p.area += area;
  }
  for (auto& p : out)
    if (p.area > 0) p.centre /= p.area;
  return out;
}

std::uint64_t bin_of(const glm::dvec3& n) {
  const glm::dvec3 a = glm::abs(n);
  const int axis = a.x >= a.y && a.x >= a.z ? 0 : a.y >= a.z ? 1 : 2;
  return static_cast<std::uint64_t>(axis * 2 + (n[axis] < 0 ? 1 : 0));
}

std::int32_t round_up(std::int32_t v, std::int32_t step) { return (v + step - 1) / step * step; }

/// Class of shapes that fit and fail alike: where one found no hole, the next need not look again.
std::uint32_t class_of(const Footprint& f) {
  // Finer steps for large shapes: they are few, and a missed hole costs more.
  const auto step = [](std::int32_t v) {
    const float octaves = std::log2(static_cast<float>(v));
    if (v <= 6) return static_cast<std::uint32_t>(v);
    return static_cast<std::uint32_t>(v <= 64 ? 1 + octaves * 2 : octaves * 4 - 11);
  };
  const auto full = static_cast<double>(f.texels) / (static_cast<double>(f.width) * f.height);
  return step(f.width) << 16 | step(f.height) << 8 | static_cast<std::uint32_t>(full * 3.999);
}

}  // namespace

PackOrder order_patches(const scene::Scene& scene, const Charts& charts) {
  PackOrder order;
  order.shape_of.resize(charts.patch_count);
  std::vector<std::uint32_t> first_shape(charts.charts.size() + 1, 0);
  for (std::size_t c = 0; c < charts.charts.size(); ++c)
    first_shape[c + 1] = first_shape[c] + charts.charts[c].patch_count;

  const glm::dvec3 low(scene.bounds_min);
  const glm::dvec3 size = glm::dvec3(scene.bounds_max) - low;
  const double extent = std::max({size.x, size.y, size.z, 1e-9});
  std::vector<std::pair<std::uint64_t, std::uint32_t>> keyed;
  keyed.reserve(charts.patch_count);
  for (std::size_t i = 0; i < charts.instances.size(); ++i) {
    const auto& use = charts.instances[i];
    const auto places = places_of(scene, charts, i);
    for (std::uint32_t local = 0; local < places.size(); ++local) {
      const auto cell = [&](int axis) {
        const double f = (places[local].centre[axis] - low[axis]) / extent;
        return static_cast<std::uint64_t>(std::isfinite(f) ? std::clamp(f, 0.0, 1.0) * 1023 : 0);
      };
      const std::uint64_t morton = spread_bits(cell(0)) | spread_bits(cell(1)) << 1 | spread_bits(cell(2)) << 2;
      const auto bin = bin_of(places[local].normal);
      // Direction parts the cells of about an eighth of the scene, place the rest.
      const auto key = [&](std::uint64_t b) { return (morton >> 21) << 33 | b << 30 | (morton & 0x1fffff); };
      keyed.emplace_back(key(bin), use.front_base + local);
      order.shape_of[use.front_base + local] = first_shape[use.chart] + local;
      if (use.has_back()) {
        keyed.emplace_back(key(bin ^ 1), use.back_base + local);
        order.shape_of[use.back_base + local] = first_shape[use.chart] + local;
      }
    }
  }
  std::sort(keyed.begin(), keyed.end());
  for (const auto& [key, patch] : keyed) order.patches.push_back(patch);
  return order;
}

FootprintSet footprints_at(const Charts& charts, const std::vector<PatchTriangles>& triangles, const PackOrder& order,
                           float density) {
  FootprintSet out;
  for (std::size_t c = 0; c < charts.charts.size(); ++c)
    for (std::uint32_t p = 0; p < charts.charts[c].patch_count; ++p)
      out.shapes.push_back(footprint_of(charts.charts[c], triangles[c], p, density));
  for (const auto s : order.shape_of) out.texels += out.shapes[s].texels;
  return out;
}

Level pack_level(const Charts& charts, const PackOrder& order, const FootprintSet& footprints, float density) {
  const auto shape = [&](std::uint32_t patch) -> const Footprint& { return footprints.shapes[order.shape_of[patch]]; };
  std::int32_t widest = 1;
  for (const auto& s : footprints.shapes) widest = std::max(widest, s.width);
  const auto square = static_cast<std::int32_t>(std::sqrt(static_cast<double>(footprints.texels)));
  const auto wanted = std::max(std::min(square, kPreferredWidth), square / 4);
  Strip strip(round_up(std::max(widest, wanted), kTileSize));

  const std::uint64_t big = std::max<std::uint64_t>(footprints.texels / kBigShare, 4);
  const std::uint64_t group_texels = footprints.texels / kGroups;
  const auto longer = [&](std::uint32_t a, std::uint32_t b) {
    const auto &x = shape(a), &y = shape(b);
    const auto round_x = x.height + x.width, round_y = y.height + y.width;
    return round_x != round_y ? round_x > round_y : x.height > y.height;
  };
  std::vector<std::uint32_t> sequence;
  sequence.reserve(order.patches.size());
  for (const auto p : order.patches)
    if (shape(p).texels >= big) sequence.push_back(p);
  std::stable_sort(sequence.begin(), sequence.end(), longer);
  std::size_t group = sequence.size();
  std::uint64_t in_group = 0;
  const auto close_group = [&] {
    std::stable_sort(sequence.begin() + static_cast<std::ptrdiff_t>(group), sequence.end(), longer);
    group = sequence.size();
    in_group = 0;
  };
  for (const auto p : order.patches) {
    if (shape(p).texels >= big) continue;
    sequence.push_back(p);
    in_group += shape(p).texels;
    if (in_group >= group_texels) close_group();
  }
  close_group();

  Level level;
  level.density = density;
  level.placements.resize(charts.patch_count);
  std::map<std::uint32_t, std::int32_t> start;
  for (const auto p : sequence) {
    const auto& f = shape(p);
    auto& from = start[class_of(f)];
    const Place place = strip.first_fit(f, from);
    from = place.y;
    strip.take(f, place);
    level.placements[p] = {static_cast<std::uint32_t>(place.x), static_cast<std::uint32_t>(place.y), f.scale};
  }
  level.width = static_cast<std::uint32_t>(strip.width());
  level.height = static_cast<std::uint32_t>(round_up(std::max(strip.height(), 1), kTileSize));
  level.tiles_x = level.width / kTileSize;
  level.tiles_y = level.height / kTileSize;
  level.occupancy =
      static_cast<float>(charts.surface_area * density * density / (static_cast<double>(level.width) * level.height));
  return level;
}

}  // namespace darm::atlas

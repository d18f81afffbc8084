#include "actors/atlas/pack.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <deque>
#include <glm/geometric.hpp>
#include <glm/vec4.hpp>
#include <map>
#include <optional>

#include "actors/atlas/strip.hpp"

namespace darm::atlas {
namespace {

/// Groups of a level. Fewer fill better; patches of over a third of a tile gain little from closer company.
constexpr std::uint64_t kGroups = 4;
/// Patches over this share of a level go before all groups, longest first: what sticks out of a group is never filled
/// well. They fill tiles of their own, so little locality is lost.
constexpr std::uint64_t kBigShare = 8000;
constexpr std::int32_t kPreferredWidth = 64 * kTileSize;
/// Patches under this go into pages.
constexpr std::uint64_t kSmallTexels = kTileTexels / 3;
constexpr std::int32_t kPageTiles = 2;
/// A patch tries the pages that were begun last: more fill better, fewer keep neighbours closer.
constexpr std::size_t kOpenPages = 3;
/// Shapes whose shorter side is at least this are looked up by cells: the rounding costs them next to nothing.
constexpr std::int32_t kCellSearchSide = 160;

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

std::uint64_t facing_bin(const glm::dvec3& n) {
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

/// Orders one level's patches for the packer.
class Sequence {
 public:
  Sequence(const PackOrder& order, const FootprintSet& footprints) : order_(order), footprints_(footprints) {}

  [[nodiscard]] const Footprint& shape(std::uint32_t patch) const { return footprints_.shapes[order_.shape_of[patch]]; }
  /// Big ones first, longest first; then groups of `group_texels` in the given order, each longest first.
  [[nodiscard]] std::vector<std::uint32_t> grouped(const std::vector<std::uint32_t>& patches, std::uint64_t big,
                                                   std::uint64_t group_texels) const {
    std::vector<std::uint32_t> out;
    out.reserve(patches.size());
    for (const auto p : patches)
      if (shape(p).texels >= big) out.push_back(p);
    sort_from(out, 0);
    std::size_t group = out.size();
    std::uint64_t in_group = 0;
    for (const auto p : patches) {
      if (shape(p).texels >= big) continue;
      out.push_back(p);
      in_group += shape(p).texels;
      if (in_group < group_texels) continue;
      sort_from(out, group);
      group = out.size();
      in_group = 0;
    }
    sort_from(out, group);
    return out;
  }

 private:
  void sort_from(std::vector<std::uint32_t>& patches, std::size_t first) const {
    std::stable_sort(patches.begin() + static_cast<std::ptrdiff_t>(first), patches.end(),
                     [&](std::uint32_t a, std::uint32_t b) {
                       const auto &x = shape(a), &y = shape(b);
                       const auto round_x = x.height + x.width, round_y = y.height + y.width;
                       return round_x != round_y ? round_x > round_y : x.height > y.height;
                     });
  }

  const PackOrder& order_;
  const FootprintSet& footprints_;
};

/// Where shapes of a class found their last place: none of them fits before it.
class Starts {
 public:
  std::int32_t& of(const Footprint& f) { return start_[class_of(f)]; }

 private:
  std::map<std::uint32_t, std::int32_t> start_;
};

/// Puts small patches into square pages of a few tiles, in order, so that what is seen together shares tiles.
class Pages {
 public:
  explicit Pages(std::int32_t side) : side_(side) {}

  /// Index of the page, and the place in it.
  std::pair<std::size_t, Place> put(const Footprint& f) {
    for (auto& page : open_)
      if (const auto place = fit(page, f)) return {page.index, *place};
    if (open_.size() == kOpenPages) open_.pop_front();
    open_.push_back({count_++, Strip(side_), {}});
    return {open_.back().index, *fit(open_.back(), f)};
  }
  [[nodiscard]] std::size_t count() const { return count_; }

 private:
  struct Page {
    std::size_t index;
    Strip strip;
    Starts starts;
  };

  std::optional<Place> fit(Page& page, const Footprint& f) const {
    auto& from = page.starts.of(f);
    if (from + f.height > side_) return std::nullopt;
    const Place place = page.strip.first_fit(f, from);
    from = place.y;
    if (place.y + f.height > side_) return std::nullopt;
    page.strip.take(f, place);
    return place;
  }

  std::int32_t side_;
  std::size_t count_ = 0;
  std::deque<Page> open_;
};

/// A level as it fills.
class LevelPacker {
 public:
  LevelPacker(const Sequence& sequence, std::int32_t width, std::uint32_t patches)
      : sequence_(sequence), strip_(width, true), placements_(patches) {}

  void put_large(const std::vector<std::uint32_t>& patches) {
    Starts starts;
    for (const auto p : patches) {
      const auto& f = sequence_.shape(p);
      auto& from = starts.of(f);
      Place place;
      if (std::min(f.width, f.height) >= kCellSearchSide) {
        place = strip_.coarse_fit(f, from);
      } else {
        place = strip_.first_fit(f, from);
        from = place.y;
      }
      settle(p, place);
    }
  }

  /// Fills pages in order, then puts each on the first free tiles after the page before it.
  void put_small(const std::vector<std::uint32_t>& patches, std::int32_t side) {
    Pages pages(side);
    std::vector<std::vector<std::pair<std::uint32_t, Place>>> content;
    for (const auto p : patches) {
      const auto [page, in_page] = pages.put(sequence_.shape(p));
      content.resize(pages.count());
      content[page].emplace_back(p, in_page);
    }
    Place at;
    for (const auto& page : content) {
      while (!strip_.is_free(at, side, side)) {
        at.x += kTileSize;
        if (at.x + side > strip_.width()) at = {0, at.y + kTileSize};
      }
      for (const auto& [p, in_page] : page) settle(p, {at.x + in_page.x, at.y + in_page.y});
    }
  }

  [[nodiscard]] const Strip& strip() const { return strip_; }
  [[nodiscard]] std::vector<Placement> take_placements() { return std::move(placements_); }

 private:
  void settle(std::uint32_t patch, Place place) {
    const auto& f = sequence_.shape(patch);
    strip_.take(f, place);
    placements_[patch] = {static_cast<std::uint32_t>(place.x), static_cast<std::uint32_t>(place.y), f.scale};
  }

  const Sequence& sequence_;
  Strip strip_;
  std::vector<Placement> placements_;
};

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
      const auto bin = facing_bin(places[local].normal);
      // Direction parts the cells of about an eighth of the scene, place the rest.
      const auto key = [&](std::uint64_t b) { return (morton >> 27) << 33 | b << 30 | (morton & 0x7ffffff); };
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
  const Sequence sequence(order, footprints);
  std::int32_t widest = 1;
  for (const auto& s : footprints.shapes) widest = std::max(widest, s.width);
  const auto square = static_cast<std::int32_t>(std::sqrt(static_cast<double>(footprints.texels)));
  const auto wanted = std::max({std::min(square, kPreferredWidth), square / 4, kTileSize});
  LevelPacker packer(sequence, round_up(std::max(widest, wanted), kTileSize), charts.patch_count);

  // Small levels have small pages, else the last ones would weigh too much.
  const std::int32_t side = std::clamp(square / 8 / kTileSize, 1, kPageTiles) * kTileSize;
  const auto page_texels = static_cast<std::uint64_t>(side) * static_cast<std::uint64_t>(side);
  std::vector<std::uint32_t> small, large;
  for (const auto p : order.patches) {
    const auto& f = sequence.shape(p);
    const bool in_page = f.texels < std::min(kSmallTexels, page_texels / 4) && f.width <= side && f.height <= side;
    (in_page ? small : large).push_back(p);
  }
  packer.put_large(
      sequence.grouped(large, std::max<std::uint64_t>(footprints.texels / kBigShare, 4), footprints.texels / kGroups));
  packer.put_small(sequence.grouped(small, ~std::uint64_t{0}, page_texels), side);

  Level level;
  level.density = density;
  level.width = static_cast<std::uint32_t>(packer.strip().width());
  level.height = static_cast<std::uint32_t>(round_up(std::max(packer.strip().height(), 1), kTileSize));
  level.tiles_x = level.width / kTileSize;
  level.tiles_y = level.height / kTileSize;
  level.occupancy =
      static_cast<float>(charts.surface_area * density * density / (static_cast<double>(level.width) * level.height));
  level.placements = packer.take_placements();
  return level;
}

}  // namespace darm::atlas

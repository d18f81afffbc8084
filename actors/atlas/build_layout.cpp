#include "actors/atlas/build_layout.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec3.hpp>
#include <mutex>

#include "actors/atlas/charts.hpp"
#include "actors/atlas/pack.hpp"
#include "actors/atlas/parallel.hpp"

namespace darm::atlas {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

std::uint64_t texels_of(const Level& l) { return std::uint64_t{l.width} * l.height; }

bool ends_levels(const Level& l) {
  return texels_of(l) < kCoarseTexels && l.width <= kCoarseSide && l.height <= kCoarseSide;
}

/// Packs levels of one scene at any density.
class Packer {
 public:
  Packer(const scene::Scene& scene, const Charts& charts) : charts_(charts), order_(order_patches(scene, charts)) {
    triangles_.reserve(charts.charts.size());
    for (const auto& c : charts.charts) {
      triangles_.emplace_back(c);
      for (const auto& size : c.patch_size) length_ += double{std::max(size.x, size.y)};
    }
  }

  [[nodiscard]] Level pack(float density) const {
    return pack_level(charts_, order_, footprints_at(charts_, triangles_, order_, density), density);
  }
  /// Own texels at a density without packing; the level is larger by what the packer wastes.
  [[nodiscard]] std::uint64_t own_texels(float density) const {
    return footprints_at(charts_, triangles_, order_, density).texels;
  }
  /// Texels by area and length alone: a lower bound that costs nothing. A patch has a texel in every row of its long
  /// side, so that needles, which have next to no area, are not laid out at a density that takes hours.
  [[nodiscard]] double least_texels(float density) const {
    return std::max(
        {charts_.surface_area * density * density, length_ * density, static_cast<double>(charts_.patch_count)});
  }

 private:
  const Charts& charts_;
  PackOrder order_;
  std::vector<PatchTriangles> triangles_;
  double length_ = 0;  // of the long sides of all charts' patches, world units
};

/// Exponent of the densest q that is worth a look: 16 suits rooms and halls, and a scene of less than 256 m has as
/// many texels from end to end as one of 256 m (a needle without area is as long as that in every level).
int most_exponent(const scene::Scene& scene) {
  constexpr int kUsual = 16;
  constexpr int kMost = 40;
  const double extent = glm::length(glm::dvec3(scene.bounds_max) - glm::dvec3(scene.bounds_min));
  if (!(extent > 0)) return kUsual;
  return kUsual + static_cast<int>(std::clamp(8 - std::ceil(std::log2(extent)), 0.0, double{kMost - kUsual}));
}

/// Largest power of two whose level 0 stays under the bound, by own texels and the packer's usual waste.
float choose_q(const scene::Scene& scene, const Packer& packer) {
  constexpr double kUsualFill = 0.88;
  for (int exponent = most_exponent(scene); exponent >= -40; --exponent) {
    const float q = std::ldexp(1.0f, exponent);
    if (packer.least_texels(q) > static_cast<double>(kAutoTexels)) continue;
    if (static_cast<double>(packer.own_texels(q)) < kUsualFill * static_cast<double>(kAutoTexels)) return q;
  }
  return std::ldexp(1.0f, -40);
}

/// Largest q whose level 0 fits, rounded down to two digits.
float largest_q(const Packer& packer, float too_large, std::uint64_t max_texels) {
  constexpr double kSafeFill = 0.75;
  const double bound = kSafeFill * static_cast<double>(max_texels);
  float q = too_large;
  for (int i = 0; i < 200; ++i) {
    if (packer.least_texels(q) <= bound && static_cast<double>(packer.own_texels(q)) <= bound) break;
    q *= 0.93f;
  }
  const float digit = std::pow(10.0f, std::floor(std::log10(q)) - 1);
  return std::floor(q / digit) * digit;
}

Result<Level> finest_level(const scene::Scene& scene, const Packer& packer, const LayoutOptions& options, float q) {
  const auto refuse = [&] {
    return fail(fmt::format("{}: q={} needs more than max_texels={}; the largest q that fits is {}", scene.path, q,
                            options.max_texels, largest_q(packer, q, options.max_texels)));
  };
  if (packer.least_texels(q) > static_cast<double>(options.max_texels)) return refuse();
  if (packer.own_texels(q) > options.max_texels) return refuse();
  Level level = packer.pack(q);
  if (texels_of(level) > options.max_texels) return refuse();
  return level;
}

/// Automatic q: drops finest levels, which halves q each time, until level 0 is under its bound.
Result<void> drop_to_bound(const scene::Scene& scene, const Packer& packer, const LayoutOptions& options, float& q,
                           std::vector<Level>& levels) {
  const auto bound = std::min(kAutoTexels, options.max_texels);
  for (int attempt = 0; attempt < 3; ++attempt, q /= 2) {
    if (levels.empty()) levels.push_back(packer.pack(q));
    if (texels_of(levels.front()) <= bound) return {};
    levels.erase(levels.begin());
  }
  return fail(fmt::format("{}: no q puts level 0 under {} texels; raise max_texels", scene.path, bound));
}

/// All levels. With more than one thread the coarser ones are packed beside level 0, as many as its area suggests.
Result<std::vector<Level>> pack_levels(const scene::Scene& scene, const Packer& packer, const LayoutOptions& options,
                                       float& q) {
  const auto report = [&, guard = std::make_shared<std::mutex>(), done = std::make_shared<int>(0)] {
    if (!options.progress) return;
    const std::lock_guard lock(*guard);
    options.progress("pack", 1.0f - std::ldexp(1.0f, -++*done));
  };
  std::vector<Level> levels;
  if (options.progress) options.progress("pack", 0);
  if (options.q == 0) q = choose_q(scene, packer);
  const auto finest = [&]() -> Result<Level> {
    if (options.q > 0) return finest_level(scene, packer, options, q);
    return packer.pack(q);
  };
  // Guess the count from area; what is missing is packed below, what is too many is dropped.
  std::size_t guess = 1;
  if (options.threads > 1 && packer.least_texels(q) < static_cast<double>(options.max_texels))
    while (guess < kMaxLevels && packer.least_texels(std::ldexp(q, -static_cast<int>(guess) + 1)) > 0.8 * kCoarseTexels)
      ++guess;
  std::vector<Result<Level>> packed(guess, Level{});
  parallel_for(guess, options.threads, [&](std::size_t l) {
    packed[l] = l == 0 ? finest() : packer.pack(std::ldexp(q, -static_cast<int>(l)));
    report();
  });
  for (auto& p : packed) {
    if (!p) return std::unexpected(p.error());
    levels.push_back(std::move(*p));
  }
  if (options.q == 0)
    if (auto bounded = drop_to_bound(scene, packer, options, q, levels); !bounded)
      return std::unexpected(bounded.error());
  const auto is_last = [](std::size_t l, const Level& level) {
    return ends_levels(level) && (l > 0 || texels_of(level) <= kSingleLevelTexels);
  };
  for (std::size_t l = 0; l < kMaxLevels; ++l) {
    if (l == levels.size()) {
      levels.push_back(packer.pack(std::ldexp(q, -static_cast<int>(l))));
      report();
    }
    if (is_last(l, levels[l])) {
      levels.resize(l + 1);
      return levels;
    }
  }
  return fail(fmt::format("{}: {} levels do not bring the coarsest under {} texels; lower q, or join meshes",
                          scene.path, kMaxLevels, kCoarseTexels));
}

}  // namespace

Result<std::shared_ptr<const Layout>> build_layout(const scene::Scene& scene, const LayoutOptions& options,
                                                   LayoutTimes* times) {
  if (!std::isfinite(options.q) || options.q < 0 || options.q > 1e6f)
    return fail(fmt::format("q={}: must be 0 (automatic) or between 0 and 1e6 texels per unit", options.q));
  if (times) *times = {};
  const auto begin = Clock::now();
  auto charts = build_charts(scene, options.threads, options.progress);
  if (!charts) return std::unexpected(charts.error());
  if (charts->patch_count == 0) return fail(scene.path + ": there is no surface to put in an atlas");
  if (!std::isfinite(charts->surface_area) || !(charts->surface_area > 0))
    return fail(scene.path + ": the surface area is not a finite number; scale the scene down");
  if (times) times->parameterise = seconds_since(begin);

  const auto packing = Clock::now();
  float q = options.q;
  const Packer packer(scene, *charts);
  auto levels = pack_levels(scene, packer, options, q);
  if (!levels) return std::unexpected(levels.error());
  if (times) times->pack = seconds_since(packing);
  if (options.progress) options.progress("pack", 1.0f);

  auto layout = std::make_shared<Layout>();
  layout->hash = layout_hash(scene, options);
  layout->q = q;
  layout->charts = std::move(charts->charts);
  layout->instances = std::move(charts->instances);
  layout->patch_count = charts->patch_count;
  layout->levels = std::move(*levels);
  layout->surface_area = charts->surface_area;
  layout->dropped = std::move(charts->dropped);
  return std::shared_ptr<const Layout>(std::move(layout));
}

}  // namespace darm::atlas

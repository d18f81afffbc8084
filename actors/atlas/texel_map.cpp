#include "actors/atlas/texel_map.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace darm::atlas {

/// Fills the tile patch by patch: spans of own texels first, then the candidates of every texel.
class TileTexelsBuilder {
 public:
  TileTexelsBuilder(const Layout& layout, TileId id) : level_(layout.levels[static_cast<std::size_t>(id.level())]) {
    left_ = static_cast<int>(id.index() % level_.tiles_x) * kTileSize;
    top_ = static_cast<int>(id.index() / level_.tiles_x) * kTileSize;
    out_->patches_.assign(kTileTexels, kNoPatch);
    out_->flags_.assign(kTileTexels, TileTexels::kGutter);
  }

  void add_patch(const Chart& chart, std::span<const std::uint32_t> triangles, std::uint32_t instance, bool front,
                 PatchId patch) {
    const auto& place = level_.placements[index_of(patch)];
    const glm::ivec2 offset(static_cast<int>(place.x) - left_, static_cast<int>(place.y) - top_);
    if (place.scale == 0) return add_single(chart, triangles, instance, front, patch, offset);
    const float scale = place.scale * level_.density;
    // The tile's texels in the patch's own coordinates, where texel k has its centre at k.
    const glm::vec2 low(-offset), high(glm::ivec2(kTileSize) - offset);
    for (const auto t : triangles) {
      const auto& uv = chart.uv[t];
      const std::array<glm::vec2, 3> c{uv[0] * scale, uv[1] * scale, uv[2] * scale};
      if (std::min({c[0].x, c[1].x, c[2].x}) > high.x + 1 || std::max({c[0].x, c[1].x, c[2].x}) < low.x - 2 ||
          std::min({c[0].y, c[1].y, c[2].y}) > high.y + 1 || std::max({c[0].y, c[1].y, c[2].y}) < low.y - 2)
        continue;
      add_triangle(c, offset, {instance, t, front}, patch);
    }
  }

  std::shared_ptr<const TileTexels> finish() {
    auto& t = *out_;
    // Candidates that overlap the square come first; a texel without any is gutter and keeps the near ones.
    for (const auto& n : near_)
      if (n.overlaps) t.flags_[n.texel] &= static_cast<std::uint8_t>(~TileTexels::kGutter);
    t.first_.assign(kTileTexels + 1, 0);
    const auto counts = [&](const Near& n) { return n.overlaps || (t.flags_[n.texel] & TileTexels::kGutter); };
    for (const auto& n : near_)
      if (counts(n)) ++t.first_[n.texel + 1];
    for (std::size_t i = 0; i < kTileTexels; ++i) t.first_[i + 1] += t.first_[i];
    t.candidates_.resize(t.first_.back());
    auto cursor = t.first_;
    for (const auto& n : near_)
      if (counts(n)) t.candidates_[cursor[n.texel]++] = n.fragment;
    for (std::size_t i = 0; i < kTileTexels; ++i)
      if (t.patches_[i] == kNoPatch) t.flags_[i] &= static_cast<std::uint8_t>(~TileTexels::kGutter);
    t.fragments_.shrink_to_fit();
    t.corners_.shrink_to_fit();
    return std::move(out_);
  }

 private:
  struct Near {
    std::uint16_t texel;
    bool overlaps;
    std::uint32_t fragment;
  };

  /// The same arithmetic as footprint_of, in the patch's own coordinates: a texel is claimed here if and only if the
  /// packer kept it for the patch.
  void add_triangle(const std::array<glm::vec2, 3>& c, glm::ivec2 offset, const TexelFragment& f, PatchId patch) {
    constexpr float reach = 1.0f + kFootprintMargin;
    const auto fragment = static_cast<std::uint32_t>(out_->fragments_.size());
    const std::size_t before = near_.size();
    const float low = std::min({c[0].y, c[1].y, c[2].y});
    const float high = std::max({c[0].y, c[1].y, c[2].y});
    const int first = std::max({0, -offset.y, static_cast<int>(std::floor(low - reach)) + 1});
    const int last = std::min(kTileSize - 1 - offset.y, static_cast<int>(std::ceil(high + reach)) - 1);
    for (int k = first; k <= last; ++k) {
      const auto row = static_cast<float>(k);
      float lo = 0, hi = 0;
      if (!extent_in_slab(c, row - reach, row + reach, lo, hi)) continue;
      float inner_lo = 1, inner_hi = 0;
      const bool inner = extent_in_slab(c, row - 0.5f, row + 0.5f, inner_lo, inner_hi);
      const int own_first = std::max(0, static_cast<int>(std::floor(lo - reach)) + 1);
      const int own_last = std::max(static_cast<int>(std::ceil(hi + reach)) - 1, own_first);
      for (int j = std::max(own_first, -offset.x); j <= std::min(own_last, kTileSize - 1 - offset.x); ++j) {
        const auto texel = static_cast<std::uint16_t>((k + offset.y) * kTileSize + j + offset.x);
        const auto column = static_cast<float>(j);
        const bool overlaps = inner && inner_hi >= column - 0.5f && inner_lo <= column + 0.5f;
        out_->patches_[texel] = patch;
        near_.push_back({texel, overlaps, fragment});
      }
    }
    if (near_.size() == before) return;
    const glm::vec2 shift = glm::vec2(offset) + 0.5f;
    out_->fragments_.push_back(f);
    out_->corners_.push_back({c[0] + shift, c[1] + shift, c[2] + shift});
  }

  /// A patch of one texel: every triangle is a candidate, chosen by area.
  void add_single(const Chart& chart, std::span<const std::uint32_t> triangles, std::uint32_t instance, bool front,
                  PatchId patch, glm::ivec2 at) {
    if (at.x < 0 || at.y < 0 || at.x >= kTileSize || at.y >= kTileSize) return;
    const auto texel = static_cast<std::uint16_t>(at.y * kTileSize + at.x);
    out_->patches_[texel] = patch;
    out_->flags_[texel] |= TileTexels::kWholePatch;
    double total = 0;
    const auto area = [&](std::uint32_t t) {
      const auto& uv = chart.uv[t];
      const glm::dvec2 a(uv[1] - uv[0]), b(uv[2] - uv[0]);
      return std::max(0.0, a.x * b.y - a.y * b.x);
    };
    for (const auto t : triangles) total += area(t);
    double running = 0;
    std::size_t i = 0;
    for (const auto t : triangles) {
      running += area(t);
      ++i;
      const double share = total > 0 ? running / total : static_cast<double>(i) / static_cast<double>(triangles.size());
      near_.push_back({texel, true, static_cast<std::uint32_t>(out_->fragments_.size())});
      out_->fragments_.push_back({instance, t, front});
      out_->corners_.push_back({glm::vec2(static_cast<float>(share), 0), glm::vec2(0), glm::vec2(0)});
    }
  }

  const darm::atlas::Level& level_;
  int left_ = 0;
  int top_ = 0;
  std::shared_ptr<TileTexels> out_ = std::make_shared<TileTexels>();
  std::vector<Near> near_;
};

LevelIndex::LevelIndex(const Layout& layout, int level) {
  const auto& l = layout.levels[static_cast<std::size_t>(level)];
  const auto tiles = static_cast<std::size_t>(l.tiles_x) * l.tiles_y;
  first_.assign(tiles + 1, 0);
  const auto for_each = [&](const auto& visit) {
    for (const auto& use : layout.instances) {
      const auto& chart = layout.charts[use.chart];
      for (const auto base : {use.front_base, use.back_base}) {
        if (base == 0xffffffffu) continue;
        for (std::uint32_t p = 0; p < chart.patch_count; ++p) {
          const auto& place = l.placements[base + p];
          const glm::vec2 size = chart.patch_size[p] * (l.density * place.scale);
          const auto last = [](std::uint32_t at, float extent, std::uint32_t limit) {
            const auto own = static_cast<std::uint32_t>(std::ceil(extent + 1 + kFootprintMargin));
            return std::min((at + own - 1) / kTileSize, limit - 1);
          };
          const auto x1 = last(place.x, size.x, l.tiles_x);
          const auto y1 = last(place.y, size.y, l.tiles_y);
          for (auto y = place.y / kTileSize; y <= y1; ++y)
            for (auto x = place.x / kTileSize; x <= x1; ++x)
              visit(static_cast<std::size_t>(y) * l.tiles_x + x, base + p);
        }
      }
    }
  };
  for_each([&](std::size_t tile, std::uint32_t) { ++first_[tile + 1]; });
  for (std::size_t t = 0; t < tiles; ++t) first_[t + 1] += first_[t];
  patches_.resize(first_.back());
  auto cursor = first_;
  for_each([&](std::size_t tile, std::uint32_t patch) { patches_[cursor[tile]++] = patch; });
}

TexelMapper::TexelMapper(std::shared_ptr<const scene::Scene> scene, std::shared_ptr<const Layout> layout,
                         std::size_t cache_bytes)
    : scene_(std::move(scene)), layout_(std::move(layout)), cache_bytes_(cache_bytes) {
  triangles_.reserve(layout_->charts.size());
  for (const auto& c : layout_->charts) triangles_.emplace_back(c);
  for (std::uint32_t i = 0; i < layout_->instances.size(); ++i) {
    const auto& use = layout_->instances[i];
    if (layout_->charts[use.chart].patch_count == 0) continue;
    bases_.emplace_back(use.front_base, i * 2);
    if (use.has_back()) bases_.emplace_back(use.back_base, i * 2 + 1);
  }
  std::sort(bases_.begin(), bases_.end());
}

TexelMapper::~TexelMapper() = default;

TexelMapper::PatchOwner TexelMapper::owner_of(PatchId patch) const {
  auto it = std::upper_bound(bases_.begin(), bases_.end(), std::pair(index_of(patch), 0xffffffffu));
  --it;
  return {it->second / 2, index_of(patch) - it->first, it->second % 2 == 0};
}

const LevelIndex& TexelMapper::index_of_level(int level) const {
  const auto l = static_cast<std::size_t>(level);
  std::call_once(index_once_[l], [&] { index_[l] = std::make_unique<LevelIndex>(*layout_, level); });
  return *index_[l];
}

std::shared_ptr<const TileTexels> TexelMapper::make(TileId id) const {
  const auto& level = layout_->levels[static_cast<std::size_t>(id.level())];
  TileTexelsBuilder builder(*layout_, id);
  if (id.index() < level.tiles_x * level.tiles_y) {
    for (const auto patch : index_of_level(id.level()).patches_in(id.index())) {
      const auto owner = owner_of(PatchId{patch});
      const auto chart = layout_->instances[owner.instance].chart;
      builder.add_patch(layout_->charts[chart], triangles_[chart].of(owner.local), owner.instance, owner.front,
                        PatchId{patch});
    }
  }
  return builder.finish();
}

std::shared_ptr<const TileTexels> TexelMapper::tile(TileId id) const {
  if (id.level() >= static_cast<int>(layout_->levels.size())) {
    static const auto nothing = [] {
      Layout empty;
      auto& level = empty.levels.emplace_back();
      level.tiles_x = level.tiles_y = 1;
      return TileTexelsBuilder(empty, TileId(0, 0)).finish();
    }();
    return nothing;
  }
  {
    const std::lock_guard lock(guard_);
    if (const auto it = kept_.find(id); it != kept_.end()) {
      ages_.splice(ages_.begin(), ages_, it->second.age);
      return it->second.tile;
    }
  }
  auto made = make(id);  // outside the lock; two threads may make the same tile, one is kept
  const std::lock_guard lock(guard_);
  const auto [it, fresh] = kept_.try_emplace(id);
  if (!fresh) return it->second.tile;
  ages_.push_front(id);
  it->second = {made, ages_.begin()};
  bytes_ += made->bytes();
  while (bytes_ > cache_bytes_ && ages_.size() > 1) {
    const auto old = kept_.find(ages_.back());
    bytes_ -= old->second.tile->bytes();
    kept_.erase(old);
    ages_.pop_back();
  }
  return made;
}

std::size_t TexelMapper::cached_bytes() const {
  const std::lock_guard lock(guard_);
  return bytes_;
}

}  // namespace darm::atlas

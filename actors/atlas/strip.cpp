#include "actors/atlas/strip.hpp"

#include <algorithm>
#include <bit>

namespace darm::atlas {
namespace {

/// Bits [begin, end) of word `w` of a row.
std::uint64_t bits_of(std::int32_t w, std::int32_t begin, std::int32_t end) {
  const int lo = std::max(begin - w * 64, 0);
  const int hi = std::min(end - w * 64, 64);
  return (hi == 64 ? ~std::uint64_t{0} : (std::uint64_t{1} << hi) - 1) & ~std::uint64_t{0} << lo;
}

/// The cells that a shape at `place` touches, relative to the cell of `place`.
Footprint cells_of(const Footprint& shape, Place place) {
  const std::int32_t dx = place.x % kCell, dy = place.y % kCell;
  Footprint out;
  out.width = (dx + shape.width + kCell - 1) / kCell;
  out.height = (dy + shape.height + kCell - 1) / kCell;
  std::size_t first_band = 0;
  std::vector<Span> row;
  for (std::int32_t cell = 0; cell < out.height; ++cell) {
    const auto top = cell * kCell - dy, bottom = top + kCell;
    while (first_band < shape.bands.size() && shape.bands[first_band].row + shape.bands[first_band].rows <= top)
      ++first_band;
    row.clear();
    for (auto b = first_band; b < shape.bands.size() && shape.bands[b].row < bottom; ++b)
      for (const auto& s : shape.spans_of(shape.bands[b]))
        row.push_back({(s.begin + dx) / kCell, (s.end + dx + kCell - 1) / kCell});
    if (row.empty()) continue;
    std::sort(row.begin(), row.end(), [](const Span& a, const Span& b) { return a.begin < b.begin; });
    std::size_t kept = 0;
    for (const auto& s : row) {
      if (kept > 0 && s.begin <= row[kept - 1].end)
        row[kept - 1].end = std::max(row[kept - 1].end, s.end);
      else
        row[kept++] = s;
    }
    row.resize(kept);
    if (!out.bands.empty()) {
      auto& last = out.bands.back();
      const auto before = out.spans_of(last);
      if (last.row + last.rows == cell && std::equal(before.begin(), before.end(), row.begin(), row.end())) {
        ++last.rows;
        continue;
      }
    }
    out.bands.push_back(
        {cell, 1, static_cast<std::uint32_t>(out.spans.size()), static_cast<std::uint32_t>(row.size())});
    out.spans.insert(out.spans.end(), row.begin(), row.end());
  }
  return out;
}

}  // namespace

Strip::Strip(std::int32_t width, bool with_cells)
    : width_(width),
      words_((static_cast<std::size_t>(width) + 63) / 64),
      and_(words_),
      eroded_(words_),
      mask_(words_),
      coarse_(with_cells ? std::make_unique<Strip>((width + kCell - 1) / kCell) : nullptr) {}

void Strip::grow(std::int32_t rows) {
  const auto have = static_cast<std::int32_t>(longest_run_.size());
  if (rows <= have) return;
  rows = std::max(rows, have + have / 2);
  free_.resize(static_cast<std::size_t>(rows) * words_, ~std::uint64_t{0});
  if (const int tail = width_ % 64; tail != 0)
    for (auto y = have; y < rows; ++y)
      free_[static_cast<std::size_t>(y + 1) * words_ - 1] = (std::uint64_t{1} << tail) - 1;
  longest_run_.resize(static_cast<std::size_t>(rows), width_);
}

std::int32_t Strip::longest_run(const std::uint64_t* words) const {
  std::int32_t best = 0, open = 0;  // `open`: free texels that run up to the current position
  for (std::size_t i = 0; i < words_; ++i) {
    std::uint64_t w = words[i];
    if (w == ~std::uint64_t{0}) {
      open += 64;
      continue;
    }
    int at = 0;
    while (w != 0) {
      const int taken = std::countr_zero(w);
      if (taken > 0) best = std::max(best, open), open = 0, w >>= taken, at += taken;
      const int run = std::countr_one(w);
      open += run, at += run;
      w = run < 64 ? w >> run : 0;
    }
    if (at < 64) best = std::max(best, open), open = 0;
  }
  return std::max(best, open);
}

/// eroded_ bit x becomes: the `length` texels from x on are free in and_.
void Strip::erode(std::int32_t length) {
  std::copy(and_.begin(), and_.end(), eroded_.begin());
  for (std::int32_t have = 1; have < length;) {
    const std::int32_t step = std::min(have, length - have);
    const auto jump = static_cast<std::size_t>(step / 64);
    const int bits = step % 64;
    auto* e = eroded_.data();
    if (bits == 0) {
      for (std::size_t i = 0; i + jump < words_; ++i) e[i] &= e[i + jump];
      for (std::size_t i = words_ - std::min(jump, words_); i < words_; ++i) e[i] = 0;
    } else {
      const std::size_t whole = words_ > jump + 1 ? words_ - jump - 1 : 0;
      for (std::size_t i = 0; i < whole; ++i) e[i] &= e[i + jump] >> bits | e[i + jump + 1] << (64 - bits);
      if (words_ > jump) e[whole] &= e[whole + jump] >> bits;
      for (std::size_t i = words_ > jump ? whole + 1 : 0; i < words_; ++i) e[i] = 0;
    }
    have += step;
  }
}

/// mask_ keeps x only where eroded_ has x + shift.
void Strip::keep_shifted(std::int32_t shift) {
  const auto jump = static_cast<std::size_t>(shift / 64);
  const int bits = shift % 64;
  for (std::size_t i = 0; i < words_; ++i) {
    const std::uint64_t low = i + jump < words_ ? eroded_[i + jump] : 0;
    const std::uint64_t high = i + jump + 1 < words_ ? eroded_[i + jump + 1] : 0;
    mask_[i] &= bits == 0 ? low : low >> bits | high << (64 - bits);
  }
}

bool Strip::mask_empty() const {
  std::uint64_t any = 0;
  for (const auto w : mask_) any |= w;
  return any == 0;
}

/// A big rectangle that the shape owns: where it does not fit, the shape does not. Its test can skip many rows.
Strip::Core Strip::core_of(const Footprint& shape) {
  Core best;
  std::int64_t best_area = 0;
  for (const int eighths : {8, 7, 6, 4, 2, 1}) {
    const auto rows = std::max<std::int32_t>(1, shape.height * eighths / 8);
    const auto first = (shape.height - rows) / 2;
    Span common{0, shape.width};
    std::int32_t covered = 0;
    for (const auto& band : shape.bands) {
      const auto overlap = std::min(first + rows, band.row + band.rows) - std::max(first, band.row);
      if (overlap <= 0) continue;
      covered += overlap;
      Span widest{};
      for (const auto& s : shape.spans_of(band))
        if (s.end - s.begin > widest.end - widest.begin) widest = s;
      common = {std::max(common.begin, widest.begin), std::min(common.end, widest.end)};
    }
    const std::int64_t area = static_cast<std::int64_t>(common.end - common.begin) * rows;
    if (covered == rows && common.end > common.begin && area > best_area)
      best_area = area, best = {common, first, rows};
  }
  return best;
}

void Strip::plan(const Footprint& shape, const Core& core) {
  probes_.clear();
  if (core.rows > 0) probes_.push_back({core.row, core.rows, &core.span, 1, core.span.end - core.span.begin});
  const bool core_is_all = shape.bands.size() == 1 && shape.bands[0].span_count == 1;
  if (core_is_all && core.rows == shape.height) return;
  const std::size_t n = shape.bands.size();
  // Far apart rows first: neighbours mostly agree, so they are poor witnesses.
  const std::size_t bits = static_cast<std::size_t>(std::bit_width(n - 1));
  for (std::size_t i = 0; i < std::size_t{1} << bits; ++i) {
    std::size_t reversed = 0;
    for (std::size_t b = 0; b < bits; ++b) reversed |= (i >> b & 1) << (bits - 1 - b);
    if (reversed >= n) continue;
    const auto& band = shape.bands[reversed];
    const auto spans = shape.spans_of(band);
    std::int32_t longest = 0;
    for (const auto& s : spans) longest = std::max(longest, s.end - s.begin);
    probes_.push_back({band.row, band.rows, spans.data(), spans.size(), longest});
  }
}

/// Narrows mask_ by a probe at y. Returns 0 if something is left, else how far y must move before it can fit.
std::int32_t Strip::test(const Probe& probe, std::int32_t y) {
  const auto last = probe.row + probe.rows - 1;
  const auto limit = static_cast<std::int32_t>(longest_run_.size());
  // From the last row up: rows k..last that cannot hold the span stay inside the shape until y has passed row k.
  for (auto r = last; r >= probe.row; --r)
    if (y + r < limit && longest_run_[static_cast<std::size_t>(y + r)] < probe.longest) return r - probe.row + 1;
  bool any = false;
  std::int32_t pending = 0;
  for (auto r = last; r >= probe.row; --r) {
    if (y + r >= height_) continue;
    const auto* words = row(y + r);
    if (!any) {
      std::copy(words, words + words_, and_.begin());
      any = true;
    } else {
      for (std::size_t i = 0; i < words_; ++i) and_[i] &= words[i];
    }
    if (++pending == 16 && r > probe.row) {
      pending = 0;
      if (longest_run(and_.data()) < probe.longest) return r - probe.row + 1;
    }
  }
  if (!any) return 0;
  std::int32_t eroded_by = -1;
  for (std::size_t s = 0; s < probe.count; ++s) {
    const auto length = probe.spans[s].end - probe.spans[s].begin;
    if (length != eroded_by) erode(length);
    eroded_by = length;
    keep_shifted(probe.spans[s].begin);
  }
  return mask_empty() ? 1 : 0;
}

Place Strip::first_fit(const Footprint& shape, std::int32_t from_y) {
  const Core core = core_of(shape);
  plan(shape, core);
  const auto positions = width_ - shape.width + 1;
  for (auto y = from_y;;) {
    if (y >= height_) return {0, y};
    for (std::size_t i = 0; i < words_; ++i) {
      const auto left = positions - static_cast<std::int32_t>(i * 64);
      mask_[i] = left >= 64 ? ~std::uint64_t{0} : left <= 0 ? 0 : (std::uint64_t{1} << left) - 1;
    }
    std::int32_t skip = 0;
    for (const auto& probe : probes_) {
      skip = test(probe, y);
      if (skip != 0) break;
    }
    if (skip == 0) {
      for (std::size_t i = 0; i < words_; ++i)
        if (mask_[i] != 0) return {static_cast<std::int32_t>(i * 64) + std::countr_zero(mask_[i]), y};
    }
    y += std::max(skip, 1);
  }
}

bool Strip::fits(const Footprint& shape, Place place) const {
  for (const auto& band : shape.bands)
    for (const auto& s : shape.spans_of(band))
      if (!is_free({place.x + s.begin, place.y + band.row}, s.end - s.begin, band.rows)) return false;
  return true;
}

bool Strip::is_free(Place place, std::int32_t width, std::int32_t height) const {
  const auto begin = place.x, end = place.x + width;
  if (begin < 0 || place.y < 0 || end > width_) return false;
  for (auto y = place.y; y < std::min(place.y + height, height_); ++y) {
    const auto* words = row(y);
    for (auto w = begin / 64; w <= (end - 1) / 64; ++w)
      if ((~words[w] & bits_of(w, begin, end)) != 0) return false;
  }
  return true;
}

Place Strip::coarse_fit(const Footprint& shape, std::int32_t& from_y) {
  const auto cells = cells_of(shape, {});
  if (cells.width * kCell > width_) {  // too wide for the grid, not for the strip
    const Place place = first_fit(shape, from_y);
    from_y = place.y;
    return place;
  }
  const Place found = coarse_->first_fit(cells, from_y / kCell);
  Place place{found.x * kCell, found.y * kCell};
  from_y = place.y;
  constexpr int kMoves = 2 * kCell;
  for (int i = 0; i < kMoves && fits(shape, {place.x, place.y - 1}); ++i) --place.y;
  for (int i = 0; i < kMoves && fits(shape, {place.x - 1, place.y}); ++i) --place.x;
  for (int i = 0; i < kMoves && fits(shape, {place.x, place.y - 1}); ++i) --place.y;
  return place;
}

void Strip::take(const Footprint& shape, Place place) {
  if (coarse_) coarse_->take(cells_of(shape, place), {place.x / kCell, place.y / kCell});
  grow(place.y + shape.height);
  height_ = std::max(height_, place.y + shape.height);
  for (const auto& band : shape.bands) {
    for (std::int32_t r = 0; r < band.rows; ++r) {
      const auto y = place.y + band.row + r;
      auto* words = free_.data() + static_cast<std::size_t>(y) * words_;
      for (const auto& s : shape.spans_of(band)) {
        const auto begin = place.x + s.begin;
        const auto end = place.x + s.end;
        for (auto w = begin / 64; w <= (end - 1) / 64; ++w) words[w] &= ~bits_of(w, begin, end);
      }
      longest_run_[static_cast<std::size_t>(y)] = longest_run(words);
    }
  }
}

}  // namespace darm::atlas

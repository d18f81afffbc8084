#include "actors/renderer/patch_sums.hpp"

#include <algorithm>

namespace darm::renderer {
namespace {

// to[i] = from[i] + link[i] * other[i]; where the time goes, and so apart.
void add_linked(const float* __restrict from, const float* __restrict other, const float* __restrict link,
                float* __restrict to, int count) {
  for (int i = 0; i < count; ++i) to[i] = from[i] + link[i] * other[i];
}

void gather_linked(const float* __restrict other, const float* __restrict link, float* __restrict to, int count) {
  for (int i = 0; i < count; ++i) to[i] += link[i] * other[i];
}

int steps_of(int radius) { return radius <= 1 ? 1 : radius <= 3 ? 2 : 3; }

}  // namespace

void PatchSums::connect(const std::vector<std::uint32_t>& in_rows, const std::vector<std::uint32_t>& in_columns,
                        int size, std::uint32_t nobody) {
  size_ = size;
  for (auto& links : row_links_) links.assign(static_cast<std::size_t>(size * kStride), 0.0f);
  for (auto& links : column_links_) links.assign(in_columns.size(), 0.0f);
  for (int y = 0; y < size; ++y) {
    const std::uint32_t* r = &in_rows[static_cast<std::size_t>(y * size)];
    const std::uint32_t* c = &in_columns[static_cast<std::size_t>(y * size)];
    float* row = &row_links_[0][static_cast<std::size_t>(y * kStride + kPad)];
    float* column = &column_links_[0][static_cast<std::size_t>(y * size)];
    for (int x = 0; x + 1 < size; ++x) row[x] = r[x] == r[x + 1] && r[x] != nobody ? 1.0f : 0.0f;
    if (y + 1 < size)
      for (int x = 0; x < size; ++x) column[x] = c[x] == c[x + size] && c[x] != nobody ? 1.0f : 0.0f;
  }
  for (std::size_t step = 1; step < kSteps; ++step) {
    const int half = 1 << (step - 1);
    const float* short_row = row_links_[step - 1].data();
    float* long_row = row_links_[step].data();
    for (int i = 0; i + half < size * kStride; ++i) long_row[i] = short_row[i] * short_row[i + half];
    const float* short_column = column_links_[step - 1].data();
    float* long_column = column_links_[step].data();
    for (int i = 0; i + half * size < size * size; ++i)
      long_column[i] = short_column[i] * short_column[i + half * size];
  }
}

void PatchSums::sum_rows(std::vector<float>& plane, int steps) const {
  std::array<std::array<float, kStride>, 2> after{}, before{};
  for (int y = 0; y < size_; ++y) {
    float* row = &plane[static_cast<std::size_t>(y * size_)];
    if (std::all_of(row, row + size_, [](float v) { return v == 0; })) continue;
    std::copy(row, row + size_, &after[0][kPad]);
    std::copy(row, row + size_, &before[0][kPad]);
    std::size_t now = 0;
    for (int step = 0; step < steps; ++step, now ^= 1) {
      const int far = 1 << step;
      const float* link = row_links(step, y);
      const float* a = &after[now][kPad];
      const float* b = &before[now][kPad];
      add_linked(a, a + far, link, &after[now ^ 1][kPad], size_);
      add_linked(b, b - far, link - far, &before[now ^ 1][kPad], size_);
    }
    const float* a = &after[now][kPad];
    const float* b = &before[now][kPad];
    for (int x = 0; x < size_; ++x) row[x] = a[x] + (b[x] - row[x]);
  }
}

void PatchSums::sum_columns(std::vector<float>& plane, int steps) {
  after_ = plane;
  before_ = plane;
  const auto at = [&](int y) { return static_cast<std::size_t>(y * size_); };
  for (int step = 0; step < steps; ++step) {
    const int far = 1 << step;
    const float* links = column_links_[static_cast<std::size_t>(step)].data();
    for (int y = 0; y + far < size_; ++y)  // what is read lies ahead, and is of the step before
      gather_linked(&after_[at(y + far)], links + at(y), &after_[at(y)], size_);
    for (int y = size_ - 1; y >= far; --y)
      gather_linked(&before_[at(y - far)], links + at(y - far), &before_[at(y)], size_);
  }
  for (std::size_t i = 0; i < plane.size(); ++i) plane[i] = after_[i] + (before_[i] - plane[i]);
}

void PatchSums::sum(std::vector<float>& plane, int radius) {
  sum_rows(plane, steps_of(radius));
  sum_columns(plane, steps_of(radius));
}

void PatchSums::reach(std::array<std::vector<float>, 4>& out) const {
  for (auto& plane : out) plane.assign(static_cast<std::size_t>(size_ * size_), 0.0f);
  const auto next = [](float link, float reached) { return link * std::min(reached + 1, float{kMaxSumRadius}); };
  for (int y = 0; y < size_; ++y) {
    const auto row = static_cast<std::size_t>(y * size_);
    const float* link = row_links(0, y);
    for (int x = 1; x < size_; ++x) out[0][row + x] = next(link[x - 1], out[0][row + x - 1]);
    for (int x = size_ - 2; x >= 0; --x) out[1][row + x] = next(link[x], out[1][row + x + 1]);
    const auto above = row - static_cast<std::size_t>(y > 0 ? size_ : 0);
    if (y > 0)
      for (int x = 0; x < size_; ++x) out[2][row + x] = next(column_links_[0][above + x], out[2][above + x]);
  }
  for (int y = size_ - 2; y >= 0; --y) {
    const auto row = static_cast<std::size_t>(y * size_);
    for (int x = 0; x < size_; ++x) out[3][row + x] = next(column_links_[0][row + x], out[3][row + size_ + x]);
  }
}

}  // namespace darm::renderer

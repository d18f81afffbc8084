// The unfinished reference picture: sums per quarter pixel and half, and its file.
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <vector>

#include "actors/renderer/picture_io.hpp"
#include "actors/types/error.hpp"

namespace darm::renderer {

inline constexpr std::size_t kQuarters = 4;

/// Running mean of the radiance that reached one quarter of a pixel, exposed but not clamped.
struct QuarterMean {
  glm::vec3 mean{0.0f};
  std::uint32_t count = 0;
  void add(const glm::vec3& x) {
    ++count;
    mean += (x - mean) * (1.0f / static_cast<float>(count));
  }
};

struct ReferenceState {
  std::uint64_t job_hash = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t passes = 0;  ///< samples per pixel of each half
  double seconds = 0;
  std::array<std::vector<QuarterMean>, 2> halves;  ///< width * height * kQuarters, pixel by pixel

  ReferenceState(std::uint64_t hash, std::uint32_t picture_width, std::uint32_t picture_height);
  /// Picture of one half, or of both together for `half` 2. A quarter is white (1) where both halves' mean is, in all
  /// three pictures. Elsewhere a half keeps what its noise has above white: clamped by itself it would be darker than
  /// the truth by some of its noise, in both halves alike, which cancels nowhere.
  [[nodiscard]] Picture picture(int half) const;
  /// Share of the light, 0..1, that picture(2) cuts at white where the halves do not agree that it is white: rare
  /// bright samples, for the most part, by which the picture may be too dark. The halves have the same cut, so that
  /// their difference does not show it.
  [[nodiscard]] double doubtful_cut() const;
};

/// Writes beside `path` and renames, so that a reader sees the old state or the new one. Errors: disk; nothing is left
/// beside it.
[[nodiscard]] Result<void> save_state(const std::filesystem::path& path, const ReferenceState& state);
/// Fills `state` (made for the job at hand) from `path`. Errors: another job, another size, damage; state is untouched.
[[nodiscard]] Result<void> load_state(const std::filesystem::path& path, ReferenceState& state);

}  // namespace darm::renderer

// A strip of texels, free or taken, and the search for the first place where a shape fits.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "actors/atlas/footprint.hpp"

namespace darm::atlas {

struct Place {
  std::int32_t x = 0;
  std::int32_t y = 0;
};

/// Side of the cells in which large shapes are looked up, texels.
inline constexpr std::int32_t kCell = 4;

/// Bitmap of fixed width that grows downwards as shapes are placed. Not thread-safe.
class Strip {
 public:
  /// `with_cells`: coarse_fit may be called.
  explicit Strip(std::int32_t width, bool with_cells = false);
  Strip(Strip&&) noexcept = default;
  Strip& operator=(Strip&&) noexcept = default;
  ~Strip() = default;

  /// Lowest y >= `from_y`, and in it lowest x, where no own texel of the footprint is taken. Always ends: below the
  /// last taken row everything is free. The footprint must not be wider than the strip.
  [[nodiscard]] Place first_fit(const Footprint& shape, std::int32_t from_y);
  /// A place at or after `from_y` for a large shape, found many times faster: first fit on a grid of kCell texels,
  /// where a cell is free if all its texels are, then moved up and left until something is in the way. `from_y` becomes
  /// the row where the next search for such a shape may start.
  [[nodiscard]] Place coarse_fit(const Footprint& shape, std::int32_t& from_y);
  /// True if all texels of the box are free.
  [[nodiscard]] bool is_free(Place place, std::int32_t width, std::int32_t height) const;
  /// Marks the texels of a footprint as taken.
  void take(const Footprint& shape, Place place);

  [[nodiscard]] std::int32_t width() const { return width_; }
  /// Rows up to the last taken one.
  [[nodiscard]] std::int32_t height() const { return height_; }

 private:
  using Row = std::vector<std::uint64_t>;
  /// Rows of a shape that are tested in one go: `row`..`row + rows` with these spans.
  struct Probe {
    std::int32_t row;
    std::int32_t rows;
    const Span* spans;
    std::size_t count;
    std::int32_t longest;
  };
  struct Core {
    Span span;
    std::int32_t row = 0;
    std::int32_t rows = 0;
  };

  [[nodiscard]] static Core core_of(const Footprint& shape);
  void plan(const Footprint& shape, const Core& core);
  [[nodiscard]] std::int32_t test(const Probe& probe, std::int32_t y);
  void erode(std::int32_t length);
  void keep_shifted(std::int32_t shift);
  [[nodiscard]] bool mask_empty() const;
  [[nodiscard]] const std::uint64_t* row(std::int32_t y) const {
    return free_.data() + static_cast<std::size_t>(y) * words_;
  }
  void grow(std::int32_t rows);
  [[nodiscard]] bool fits(const Footprint& shape, Place place) const;
  [[nodiscard]] std::int32_t longest_run(const std::uint64_t* words) const;

  std::int32_t width_;
  std::size_t words_;
  std::int32_t height_ = 0;
  std::vector<std::uint64_t> free_;        ///< 1: free; bits from width_ on are 0
  std::vector<std::int32_t> longest_run_;  ///< per row, of free texels
  Row and_, eroded_, mask_;                ///< scratch
  std::vector<Probe> probes_;
  std::unique_ptr<Strip> coarse_;  ///< one texel per cell; only with cells
};

}  // namespace darm::atlas

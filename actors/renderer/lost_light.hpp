// Where the light goes that outliers are held down by.
#pragma once

#include <array>
#include <cstdint>
#include <glm/vec3.hpp>
#include <vector>

#include "actors/renderer/outliers.hpp"

namespace darm::renderer {

/// How much of what a patch's texels lost is shared out, 0..1. What one texel lost says little of the others, and in
/// full it would show as a bright spot: it may at most double their light. `taken`, `squares`: sum of what texels lost,
/// and of its squares; `left`: sum of what all of the patch have left. With n texels that lost alike: 1 - 1 / n, and
/// left / taken. Doubles: of one texel's 1 - squares / taken^2 is to be nothing, not a rounding error that is much
/// beside `left`.
[[nodiscard]] float share_to_trust(double taken, double squares, double left);

/// Rooms that are lit by a small bright spot have most of their light in rare samples, and would stay a fifth too dark
/// for as long as these are held down. So the light goes to all texels of the patch that have samples, but smoothly:
/// a texel is given the mean of what those around it lost, tile by tile, in weights of a quadratic B-spline over a tile
/// and its eight neighbours. As many texels as a square of 50 give to one, and tiles that meet give the same to both
/// sides of their border. What is not trusted is not shown until there are more samples.
class LostLight {
 public:
  struct Share {
    glm::vec3 irradiance{0.0f};  ///< all that was lost, a texel
    float grey = 0;              ///< its luminance
    float trusted = 0;           ///< so much of it is to be shown, 0..1
    float error = 0;             ///< what is shown of it is off by: luminance, RMS
  };

  void clear() { patches_.clear(); }
  /// `tile`: 0..8, row-major, the middle one is that which is drawn; `grey`: luminance of `irradiance`.
  void take(int tile, std::uint32_t patch, const glm::vec3& irradiance, float grey);
  /// After all is taken; the square is of the nine tiles, as it was measured.
  void measure(const LightSquare& nine);
  [[nodiscard]] bool empty() const { return patches_.empty(); }
  /// Of a texel of the middle tile's slot, `x` and `y` 0..31. Rows in order are cheap.
  [[nodiscard]] Share at(std::uint32_t patch, int x, int y);

 private:
  // Of the texels of a patch in one tile, or a weighted sum of such.
  struct Sums {
    double texels = 0;  // that have samples: among these it is shared out
    double left = 0;    // their grey, less what was lost
    double lost = 0;    // grey
    double squares = 0;
    std::array<double, 3> irradiance{};
    void add(const Sums& other, double weight);
  };
  struct Patch {
    std::uint32_t patch = 0;
    std::array<Sums, 9> tiles{};
    int row = -1;  // `columns` are of this row of texels
    std::array<Sums, 3> columns{};
  };
  Patch* find(std::uint32_t patch);

  std::vector<Patch> patches_;  // few: nearly always none
};

}  // namespace darm::renderer

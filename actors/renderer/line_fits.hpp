// Weighted means and lines of best fit along a line of texels, for four texels side by side.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <cstring>

namespace darm::renderer {

/// One value for each of four texels (GCC's and clang's vectors: no loop of four vectorises reliably).
inline constexpr int kLanes = 4;
using Lanes = float __attribute__((vector_size(kLanes * sizeof(float))));
using LaneNames = std::uint32_t __attribute__((vector_size(kLanes * sizeof(std::uint32_t))));

inline Lanes load(const float* from) {
  Lanes lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
inline LaneNames load(const std::uint32_t* from) {
  LaneNames lanes;
  std::memcpy(&lanes, from, sizeof lanes);
  return lanes;
}
inline Lanes higher(Lanes a, Lanes b) { return a > b ? a : b; }
inline Lanes lower(Lanes a, Lanes b) { return a < b ? a : b; }

/// 1 when alike within the noise, 1/2 at 2.5 standard errors, falling with the fourth power.
inline Lanes likeness(Lanes difference, Lanes variance) {
  const Lanes x = difference * difference / (6.25f * variance + 1e-30f);
  return 1.0f / (1.0f + x * x);
}

/// What the four are compared by, and the Gaussian each has: its value at distance 1.
struct FitCentres {
  LaneNames stretch;
  Lanes mean;
  Lanes variance;
  Lanes first;
};

/// The texels at one distance of those. Values of weight 0 must be finite.
struct FitTexels {
  LaneNames stretch;
  Lanes mean;      ///< what they are compared by
  Lanes variance;  ///< of that
  Lanes weight;
  std::array<Lanes, 3> value;
  Lanes noise;  ///< variance of the value's luminance
};

/// Values at distance 0. Weight under kLeastFitWeight: nothing is known.
struct Fitted {
  Lanes weight;
  std::array<Lanes, 3> value;
  Lanes noise;
};
inline constexpr float kLeastFitWeight = 1e-6f;  // of weights times counts: its square is divided by

/// At a border all texels lie on one side, and their mean is the light some way inside (the boundary bias of kernel
/// regression; Fan and Gijbels, Local Polynomial Modelling, 1996, section 3.2.5): the line's value at distance 0 is
/// not. The slope counts as far as it stands out of its own noise.
class LineFits {
 public:
  /// `with_slope`: of first passes only the mean is wanted.
  LineFits(const FitCentres& centres, bool with_slope)
      : centres_(centres), with_slope_(with_slope), ratio_(centres.first), square_(centres.first * centres.first) {}

  /// Calls `add_at(distance)` for 0, 1, -1, ... `reach`, -`reach`, which may add() the texels there.
  template <class AddAt>
  void along(int reach, const AddAt& add_at) {
    add_at(0);
    for (int d = 1; d <= reach; ++d) {
      step();
      add_at(d);
      add_at(-d);
    }
  }
  /// Within along() only: texels at the distance it is at.
  void add(const FitTexels& texels, float distance);
  /// `samples` a texel: few say little of their noise.
  void solve(const float* samples, Fitted& out) const;

 private:
  static constexpr float kLeastGaussian = 0.02f;

  // The Gaussian's value at the next distance, 0 where that is under its least. g(d + 1) = g(d) ratio(d),
  // ratio(d + 1) = ratio(d) g(1)^2, from ratio(0) = g(1).
  void step() {
    const Lanes next = gaussian_ * ratio_;
    gaussian_ = next >= kLeastGaussian ? next : Lanes{};
    ratio_ *= square_;
  }

  FitCentres centres_;
  bool with_slope_;
  Lanes gaussian_ = Lanes{} + 1.0f;
  Lanes ratio_, square_;  // of the next distance over this; of the ratio's change
  Lanes weight_{}, first_{}, second_{};
  std::array<Lanes, 3> sum_{}, moment_{};
  Lanes noise_{}, noise1_{}, noise2_{};
};

inline void LineFits::add(const FitTexels& texels, float distance) {
  const Lanes alike = likeness(texels.mean - centres_.mean, texels.variance + centres_.variance);
  const Lanes all = gaussian_ * alike * texels.weight;
  const Lanes weight = texels.stretch == centres_.stretch ? all : Lanes{};
  const Lanes noise = weight * weight * texels.noise;
  weight_ += weight;
  noise_ += noise;
  for (std::size_t c = 0; c < 3; ++c) sum_[c] += weight * texels.value[c];
  if (!with_slope_ || distance == 0) return;
  const Lanes weight1 = weight * distance;
  const Lanes noise1 = noise * distance;
  first_ += weight1;
  second_ += weight1 * distance;
  noise1_ += noise1;
  noise2_ += noise1 * distance;
  for (std::size_t c = 0; c < 3; ++c) moment_[c] += weight1 * texels.value[c];
}

}  // namespace darm::renderer

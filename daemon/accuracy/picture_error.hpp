// How far pictures are apart, free of the noise of what they are measured with. Pure.
#pragma once

#include <vector>

#include "actors/renderer/picture_io.hpp"
#include "daemon/accuracy/software_view.hpp"

namespace darm::accuracy {

/// A picture as two independent halves of equal effort.
struct Halves {
  renderer::Picture a, b;
};

/// A reference as it is shown: display RGB, 1 is white, which a half may be above by its noise; three numbers a pixel.
/// Made once: it is compared with many pictures.
struct ShownHalves {
  explicit ShownHalves(const Halves& halves);
  std::vector<float> a, b;
};

/// dB of a mean squared error of display RGB; at most 100.
[[nodiscard]] double psnr(double mse);

/// PSNR of the 8-bit display of `picture` (linear, display-referred) against a reference: MSE = mean((p - a)(p - b)),
/// so that the noise of the halves cancels. Sizes must agree; 100 dB where nothing counts.
[[nodiscard]] double psnr_to(const renderer::Picture& picture, const ShownHalves& reference, const PixelMask& counted);

/// PSNR between two pictures as they are shown.
[[nodiscard]] double psnr_between(const renderer::Picture& p, const renderer::Picture& q, const PixelMask& counted);

/// Mean squared difference of what two pairs of halves converge to: mean((p.a - q.a)(p.b - q.b)); its own standard
/// error tells whether it is more than noise. Display RGB.
struct Difference {
  double mse = 0;
  double standard_error = 0;
};
[[nodiscard]] Difference difference(const Halves& p, const Halves& q, const PixelMask& counted);

}  // namespace darm::accuracy

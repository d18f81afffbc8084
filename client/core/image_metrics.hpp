// How close a picture is to a reference that is itself a Monte Carlo estimate. Pure.
#pragma once

#include "client/core/picture_files.hpp"
#include "client/core/result.hpp"

namespace darm::client {

/// A reference as two independent halves of equal effort (DESIGN section 4 "Reference"), linear and display-referred:
/// 1 is white, and a half may be above it by its noise.
struct Reference {
  ImageF a, b;
};

struct PictureScore {
  double psnr = 0;   ///< dB
  double mssim = 0;  ///< -1..1
  double rmse = 0;   ///< of display RGB, 0..1
};

/// MSE = mean((p - a)(p - b)) over display RGB (sRGB-encoded, 0..1): the noise of the halves is independent, so it
/// cancels. Not positive (noise larger than the distance): clamped to 1e-10 (100 dB). MSSIM (Wang et al. 2004): 11x11
/// Gaussian window, sigma 1.5, K1 = 0.01, K2 = 0.03, luma of display values in 0..255, against the mean of the halves,
/// windows wholly inside the picture. Pictures under 11x11 give an error.
[[nodiscard]] Result<PictureScore> compare(const Image8& picture, const Reference& reference);
/// Own accuracy of the mean of the halves, dB: its MSE is mean((a - b)^2) / 4.
[[nodiscard]] Result<double> reference_psnr(const Reference& reference);
/// -10 log10(mse), mse clamped to 1e-10.
[[nodiscard]] double psnr_of(double mse);

}  // namespace darm::client

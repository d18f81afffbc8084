#include "daemon/accuracy/picture_error.hpp"

#include <algorithm>
#include <cmath>

#include "actors/renderer/display_curve.hpp"

namespace darm::accuracy {
namespace {

// A half may be above white by its noise, which the other half's cancels: cut off, it would not.
double display(float linear) {
  const double x = std::isfinite(linear) ? std::max(static_cast<double>(linear), 0.0) : 0.0;
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

double shown(float linear) { return renderer::srgb_code(linear) / 255.0; }

}  // namespace

ShownHalves::ShownHalves(const Halves& halves) {
  const auto convert = [](const renderer::Picture& from, std::vector<float>& to) {
    to.reserve(from.pixels.size() * 3);
    for (const auto& p : from.pixels)
      for (int c = 0; c < 3; ++c) to.push_back(static_cast<float>(display(p[c])));
  };
  convert(halves.a, a);
  convert(halves.b, b);
}

double psnr(double mse) { return -10.0 * std::log10(std::max(mse, 1e-10)); }

double psnr_to(const renderer::Picture& picture, const ShownHalves& reference, const PixelMask& counted) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < counted.size(); ++i) {
    if (counted[i] == 0) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      const double p = shown(picture.pixels[i][static_cast<int>(c)]);
      sum += (p - double{reference.a[i * 3 + c]}) * (p - double{reference.b[i * 3 + c]});
    }
    count += 3;
  }
  return psnr(count > 0 ? sum / count : 0);
}

double psnr_between(const renderer::Picture& p, const renderer::Picture& q, const PixelMask& counted) {
  double sum = 0, count = 0;
  for (std::size_t i = 0; i < counted.size(); ++i) {
    if (counted[i] == 0) continue;
    for (int c = 0; c < 3; ++c) {
      const double d = shown(p.pixels[i][c]) - shown(q.pixels[i][c]);
      sum += d * d;
    }
    count += 3;
  }
  return psnr(count > 0 ? sum / count : 0);
}

Difference difference(const Halves& p, const Halves& q, const PixelMask& counted) {
  double sum = 0, squares = 0, n = 0;
  for (std::size_t i = 0; i < counted.size(); ++i) {
    if (counted[i] == 0) continue;
    double product = 0;  // of the three channels: they share a pixel's paths
    for (int c = 0; c < 3; ++c)
      product += (display(p.a.pixels[i][c]) - display(q.a.pixels[i][c])) *
                 (display(p.b.pixels[i][c]) - display(q.b.pixels[i][c]));
    product /= 3;
    sum += product;
    squares += product * product;
    n += 1;
  }
  if (n < 2) return {};
  const double mean = sum / n;
  return {mean, std::sqrt(std::max(squares / n - mean * mean, 0.0) / (n - 1))};
}

}  // namespace darm::accuracy

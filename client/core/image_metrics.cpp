#include "client/core/image_metrics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include "client/core/scene_model.hpp"

namespace darm::client {
namespace {

constexpr int kWindow = 11;
constexpr double kSigma = 1.5;

// A half may be above white by its noise, which the other half's cancels: cut off, it would not.
double display(float linear) { return linear_to_srgb(std::max(linear, 0.0f)); }

double luma(double r, double g, double b) { return 0.2126 * r + 0.7152 * g + 0.0722 * b; }

struct Plane {
  int width = 0, height = 0;
  std::vector<double> v;
};

std::array<double, kWindow> gaussian() {
  std::array<double, kWindow> g{};
  double sum = 0;
  for (int i = 0; i < kWindow; ++i) {
    const double d = i - kWindow / 2;
    sum += g[static_cast<std::size_t>(i)] = std::exp(-d * d / (2 * kSigma * kSigma));
  }
  for (double& w : g) w /= sum;
  return g;
}

// Separable Gaussian over windows wholly inside the plane.
Plane blur(const Plane& in) {
  static const auto weights = gaussian();
  Plane rows{in.width - kWindow + 1, in.height, {}};
  rows.v.resize(static_cast<std::size_t>(rows.width) * rows.height);
  for (int y = 0; y < in.height; ++y) {
    for (int x = 0; x < rows.width; ++x) {
      double sum = 0;
      const double* p = in.v.data() + static_cast<std::size_t>(y) * in.width + x;
      for (int k = 0; k < kWindow; ++k) sum += weights[static_cast<std::size_t>(k)] * p[k];
      rows.v[static_cast<std::size_t>(y) * rows.width + x] = sum;
    }
  }
  Plane out{rows.width, in.height - kWindow + 1, {}};
  out.v.assign(static_cast<std::size_t>(out.width) * out.height, 0.0);
  for (int y = 0; y < out.height; ++y) {
    for (int k = 0; k < kWindow; ++k) {
      const double w = weights[static_cast<std::size_t>(k)];
      const double* p = rows.v.data() + static_cast<std::size_t>(y + k) * rows.width;
      double* o = out.v.data() + static_cast<std::size_t>(y) * out.width;
      for (int x = 0; x < out.width; ++x) o[x] += w * p[x];
    }
  }
  return out;
}

Plane product(const Plane& a, const Plane& b) {
  Plane out{a.width, a.height, std::vector<double>(a.v.size())};
  for (std::size_t i = 0; i < a.v.size(); ++i) out.v[i] = a.v[i] * b.v[i];
  return out;
}

double mssim(const Plane& a, const Plane& b) {
  constexpr double c1 = (0.01 * 255) * (0.01 * 255);
  constexpr double c2 = (0.03 * 255) * (0.03 * 255);
  const Plane ma = blur(a), mb = blur(b);
  const Plane aa = blur(product(a, a)), bb = blur(product(b, b)), ab = blur(product(a, b));
  double sum = 0;
  for (std::size_t i = 0; i < ma.v.size(); ++i) {
    const double va = aa.v[i] - ma.v[i] * ma.v[i];
    const double vb = bb.v[i] - mb.v[i] * mb.v[i];
    const double cov = ab.v[i] - ma.v[i] * mb.v[i];
    sum += ((2 * ma.v[i] * mb.v[i] + c1) * (2 * cov + c2)) /
           ((ma.v[i] * ma.v[i] + mb.v[i] * mb.v[i] + c1) * (va + vb + c2));
  }
  return sum / static_cast<double>(ma.v.size());
}

bool same_shape(const Reference& r) {
  return r.a.width == r.b.width && r.a.height == r.b.height && r.a.rgb.size() == r.b.rgb.size() &&
         r.a.rgb.size() == std::size_t{r.a.width} * r.a.height * 3 && !r.a.rgb.empty();
}

}  // namespace

double psnr_of(double mse) { return -10.0 * std::log10(std::max(mse, 1e-10)); }

Result<PictureScore> compare(const Image8& picture, const Reference& reference) {
  if (!same_shape(reference)) return fail("reference: its halves differ in size");
  if (picture.width != reference.a.width || picture.height != reference.a.height ||
      picture.rgb.size() != reference.a.rgb.size()) {
    return fail("reference: its size differs from the picture's");
  }
  if (picture.width < kWindow || picture.height < kWindow) return fail("reference: picture is smaller than 11x11");
  Plane ours{static_cast<int>(picture.width), static_cast<int>(picture.height), {}};
  Plane truth = ours;
  const std::size_t pixels = picture.rgb.size() / 3;
  ours.v.resize(pixels);
  truth.v.resize(pixels);
  double sum = 0;
  for (std::size_t i = 0; i < pixels; ++i) {
    std::array<double, 3> p{}, m{};
    for (std::size_t c = 0; c < 3; ++c) {
      const float a = reference.a.rgb[i * 3 + c], b = reference.b.rgb[i * 3 + c];
      p[c] = picture.rgb[i * 3 + c] / 255.0;
      sum += (p[c] - display(a)) * (p[c] - display(b));
      m[c] = display(std::min(0.5f * (a + b), 1.0f));
    }
    ours.v[i] = 255 * luma(p[0], p[1], p[2]);
    truth.v[i] = 255 * luma(m[0], m[1], m[2]);
  }
  const double mse = std::max(sum / static_cast<double>(picture.rgb.size()), 1e-10);
  return PictureScore{psnr_of(mse), mssim(ours, truth), std::sqrt(mse)};
}

Result<double> reference_psnr(const Reference& reference) {
  if (!same_shape(reference)) return fail("reference: its halves differ in size");
  double sum = 0;
  for (std::size_t i = 0; i < reference.a.rgb.size(); ++i) {
    const double d = display(reference.a.rgb[i]) - display(reference.b.rgb[i]);
    sum += d * d;
  }
  return psnr_of(sum / static_cast<double>(reference.a.rgb.size()) / 4);
}

}  // namespace darm::client

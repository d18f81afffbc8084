#include "actors/renderer/line_fits.hpp"

namespace darm::renderer {
namespace {

constexpr float kCentred = 0.05f;    // texels: no slope moves the value then
constexpr float kLeastWidth = 0.1f;  // texels squared: one texel, in effect
constexpr float kMostChange = 3.0f;

}  // namespace

void LineFits::solve(const float* samples, Fitted& out) const {
  const Lanes scale = 1.0f / higher(weight_, Lanes{} + kLeastFitWeight);
  out.weight = weight_;
  for (std::size_t c = 0; c < 3; ++c) out.value[c] = sum_[c] * scale;
  out.noise = noise_ * scale * scale;
  if (!with_slope_) return;
  const Lanes centre = first_ * scale;
  const Lanes width = second_ - first_ * centre;
  const Lanes least = kLeastWidth * higher(weight_, Lanes{} + kLeastFitWeight);
  const Lanes aside = centre * centre > kCentred * kCentred ? 1.0f / higher(width, least) : Lanes{};
  const Lanes over = width > least ? aside : Lanes{};
  std::array<Lanes, 3> slope;
  for (std::size_t c = 0; c < 3; ++c) slope[c] = (moment_[c] - centre * sum_[c]) * over;
  const Lanes grey = 0.2126f * slope[0] + 0.7152f * slope[1] + 0.0722f * slope[2];
  const Lanes spread = noise2_ - 2.0f * centre * noise1_ + centre * centre * noise_;
  const Lanes noise = higher(spread, Lanes{}) * over * over;
  const Lanes covariance = (noise1_ - centre * noise_) * scale * over;
  const Lanes doubt = 1.0f + 2.0f / higher(load(samples), Lanes{} + 0.25f);
  const Lanes shift = centre * (1.0f - likeness(grey, doubt * noise));
  for (std::size_t c = 0; c < 3; ++c) {
    const Lanes mean = out.value[c];
    out.value[c] = lower(higher(mean - shift * slope[c], mean * (1 / kMostChange)), mean * kMostChange);
  }
  out.noise = higher(out.noise + shift * shift * noise - 2.0f * shift * covariance, Lanes{});
}

}  // namespace darm::renderer

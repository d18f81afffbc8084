// links: darm_daemon darm_client_core
// Light that ends in what is stored, against the unbiased path tracer, at the same texels of a still view.
//   light_bench SETUP.toml SCENE CAMERA STATE_DIR Q ROUNDS TEXELS SAMPLES
// Lights the coarse level to ROUNDS samples a texel (from the store in STATE_DIR where it is there), then takes SAMPLES
// samples of TEXELS random visible texels in either way. Prints one JSON object:
//   us      time of a sample
//   rmse    of one sample of soft light in display units (linear, exposed), as its own variance says
//   gain    how much sooner stored light is at an equal error: ratio of us * rmse^2
//   bias_db -20 log10 of the RMS difference of display values, noise of both sides cancelled by independent halves
//           (null: nothing is left)
//   bias_db_bound  the same with two standard errors more: with 97.7 % confidence there is no more bias
#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "tests/bench/lit_view.hpp"

namespace {

using namespace darm;
using namespace darm::bench;

struct Estimate {
  glm::dvec3 half[2]{};      // means of sharp + soft, exposed
  double soft_variance = 0;  // of one sample, mean of channels
};

struct Tally {
  std::vector<Estimate> texels;
  double seconds = 0;
};

Estimate estimate(const Halves& halves, const TexelName& name, std::uint32_t samples, float exposure) {
  Estimate e;
  glm::dvec3 mean(0.0), m2(0.0);
  std::uint32_t taken = 0;
  const int texel = name.second;
  glm::vec3 albedo(0.0f);
  for (std::size_t h = 0; h < halves.size(); ++h) {
    const auto surface = halves[h]->tile(name.first);
    for (std::uint32_t i = 0; i < 8 && h == 0; ++i)
      albedo += surface->albedo(texel, i).value_or(glm::vec3(0.0f)) / 8.0f;
    for (std::uint32_t i = 0; i < samples / 2; ++i) {
      const auto sharp = surface->sharp(texel, i), soft = surface->soft(texel, i);
      if (!sharp || !soft) continue;
      e.half[h] += glm::dvec3((*sharp + *soft) * albedo) * double(exposure) * 2.0 / double(samples);
      const glm::dvec3 x = glm::dvec3(*soft * albedo) * double(exposure);
      const glm::dvec3 d = x - mean;
      mean += d / double(++taken);
      m2 += d * (x - mean);
    }
  }
  if (taken > 1) e.soft_variance = (m2.x + m2.y + m2.z) / (3.0 * double(taken - 1));
  return e;
}

Tally sample_all(const Halves& halves, const std::vector<TexelName>& texels, std::uint32_t samples, float exposure) {
  Tally tally;
  tally.texels.resize(texels.size());
  std::vector<double> seconds(texels.size());
  atlas::parallel_for(texels.size(), kThreads, [&](std::size_t i) {
    const renderer::trace::DenormalsAreZero denormals;
    const auto begin = std::chrono::steady_clock::now();
    tally.texels[i] = estimate(halves, texels[i], samples, exposure);
    seconds[i] = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  });
  for (const double s : seconds) tally.seconds += s;
  return tally;
}

double shown(double linear) {
  const double c = std::clamp(linear, 0.0, 1.0);
  return c <= 0.0031308 ? 12.92 * c : 1.055 * std::pow(c, 1 / 2.4) - 0.055;
}

// Mean square difference of display values over texels, and its standard error.
std::pair<double, double> square_bias(const Tally& a, const Tally& b) {
  double mean = 0, m2 = 0;
  for (std::size_t i = 0; i < a.texels.size(); ++i) {
    double square = 0;
    for (int c = 0; c < 3; ++c)
      square += (shown(a.texels[i].half[0][c]) - shown(b.texels[i].half[0][c])) *
                (shown(a.texels[i].half[1][c]) - shown(b.texels[i].half[1][c])) / 3;
    const double d = square - mean;
    mean += d / double(i + 1);
    m2 += d * (square - mean);
  }
  const auto n = double(a.texels.size());
  return {mean, n > 1 ? std::sqrt(m2 / (n - 1) / n) : 1.0};
}

std::string decibels(double square) { return square > 0 ? fmt::format("{:.1f}", -10 * std::log10(square)) : "null"; }

double ratio_of_means(const Tally& a, const Tally& b) {
  double sums[2] = {0, 0};
  for (const auto& t : a.texels) sums[0] += t.half[0].y + t.half[1].y;
  for (const auto& t : b.texels) sums[1] += t.half[0].y + t.half[1].y;
  return sums[0] / sums[1];
}

double rmse(const Tally& tally) {
  double sum = 0;
  for (const auto& t : tally.texels) sum += t.soft_variance;
  return std::sqrt(sum / double(tally.texels.size()));
}

Result<void> run(char** argv) {
  LitView view;
  if (auto opened = open_view(view, argv[1], argv[2], argv[3], argv[4], std::strtod(argv[5], nullptr)); !opened)
    return opened;
  const auto samples = static_cast<std::uint32_t>(std::strtoul(argv[8], nullptr, 10));
  const auto texels = random_texels(view, std::strtoul(argv[7], nullptr, 10), true);
  if (texels.empty() || samples < 4) return fail("nothing is seen, or SAMPLES is under 4");
  const auto plain = make_halves(view, 1);
  const auto fast = make_halves(view, 2);
  const auto begin = std::chrono::steady_clock::now();
  fast[1]->use_stored_light(
      light_coarse(view, *fast[0], static_cast<std::uint32_t>(std::strtoul(argv[6], nullptr, 10))));
  const double lit = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  const auto a = sample_all(fast, texels, samples, view.world.exposure);
  const auto b = sample_all(plain, texels, samples, view.world.exposure);
  const double n = double(texels.size()) * samples;
  const auto [square, error] = square_bias(a, b);
  std::printf("{\"camera\": \"%s\", \"q\": %g, \"texels\": %zu, \"samples\": %u, \"coarse_seconds\": %.2f, ", argv[3],
              double(view.world.layout->q), texels.size(), samples, lit);
  std::printf("\"stored\": {\"us\": %.2f, \"rmse\": %.4f}, \"traced\": {\"us\": %.2f, \"rmse\": %.4f}, ",
              a.seconds / n * 1e6, rmse(a), b.seconds / n * 1e6, rmse(b));
  std::printf("\"gain\": %.2f, \"mean_ratio\": %.4f, \"bias_db\": %s, \"bias_db_bound\": %s}\n",
              b.seconds * rmse(b) * rmse(b) / (a.seconds * rmse(a) * rmse(a)), ratio_of_means(a, b),
              decibels(square).c_str(), decibels(square + 2 * error).c_str());
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 9) {
    std::fprintf(stderr, "usage: %s SETUP.toml SCENE CAMERA STATE_DIR Q ROUNDS TEXELS SAMPLES\n", argv[0]);
    return 2;
  }
  if (const auto done = run(argv); !done) {
    std::fprintf(stderr, "%s\n", done.error().message.c_str());
    return 1;
  }
  return 0;
}

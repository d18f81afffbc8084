// links: darm_daemon darm_client_core
// What texels without samples show, and the error they are said to have, against their light.
//   guess_bench SETUP.toml SCENE CAMERA STATE_DIR Q ROUNDS TEXELS SAMPLES
// Lights the coarse level to ROUNDS samples a texel, has TEXELS random visible texels of finer levels guessed from it,
// then takes SAMPLES samples of each. Prints one JSON object; errors are RMS of display values, by how much light
// varies among the coarse texels around, as a share of the guess: true (noise cancelled by independent halves) and
// said.
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/sampling.hpp"
#include "tests/bench/lit_view.hpp"

namespace {

using namespace darm;
using namespace darm::bench;

struct Guessed {
  float variation = -1;        // none: nothing is known there
  double said = 0, truth = 0;  // square errors, display values
};

std::optional<renderer::LightGuess> guess_of(const LitView& view, const renderer::StoredLight& coarse,
                                             const renderer::TileFacts& facts, const TexelName& name) {
  const auto [tile, t] = name;
  const std::uint32_t patch = facts.patch[static_cast<std::size_t>(t)];
  if (patch == renderer::kNobody) return std::nullopt;
  const auto tiles = renderer::level_tiles_of(*view.world.layout)[static_cast<std::size_t>(tile.level())];
  const glm::vec2 at(static_cast<float>(tile.index() % tiles.x * kTileSize + t % kTileSize) + 0.5f,
                     static_cast<float>(tile.index() / tiles.x * kTileSize + t / kTileSize) + 0.5f);
  return coarse.guess(PatchId{patch}, tile.level(), at);
}

// Mean over both signs of the error, as TileDisplay counts it.
double said_of(float grey, float variance) {
  const float off = std::sqrt(variance), middle = renderer::srgb(grey);
  const float above = renderer::srgb(grey + off) - middle, below = renderer::srgb(std::max(grey - off, 0.0f)) - middle;
  return 0.5 * (double{above} * double{above} + double{below} * double{below});
}

Guessed compare(const renderer::LightGuess& guess, const Halves& halves, const TexelName& name, std::uint32_t samples,
                float exposure) {
  Guessed out;
  std::array<glm::dvec3, 2> half{};
  glm::vec3 albedo(0.0f);
  for (std::size_t h = 0; h < half.size(); ++h) {
    const auto surface = halves[h]->tile(name.first);
    for (std::uint32_t i = 0; i < 8 && h == 0; ++i)
      albedo += surface->albedo(name.second, i).value_or(glm::vec3(0.0f)) / 8.0f;
    for (std::uint32_t i = 0; i < samples / 2; ++i) {
      const auto sharp = surface->sharp(name.second, i), soft = surface->soft(name.second, i);
      if (!sharp || !soft) return out;
      half[h] += glm::dvec3(*sharp + *soft) * 2.0 / double(samples);
    }
  }
  const float scale = renderer::luminance(albedo) * exposure;
  const float all = renderer::luminance(guess.sharp + guess.soft);
  const float variance = renderer::sharp_of(guess).variance + renderer::soft_of(guess).variance;
  const auto off = [&](const glm::dvec3& light) {
    return double{renderer::srgb(all * scale)} - double{renderer::srgb(renderer::luminance(glm::vec3(light)) * scale)};
  };
  out.variation = all > 0 ? std::sqrt(guess.sharp_around + guess.soft_around) / all : 0;
  out.said = said_of(all * scale, variance * scale * scale);
  out.truth = off(half[0]) * off(half[1]);
  return out;
}

double rms(double sum, std::size_t n) { return n > 0 ? std::copysign(std::sqrt(std::abs(sum) / double(n)), sum) : 0; }

std::string bin(const std::vector<Guessed>& all, float low, float high) {
  double said = 0, truth = 0;
  std::size_t n = 0;
  for (const auto& g : all) {
    if (!(g.variation >= low && g.variation < high)) continue;
    said += g.said;
    truth += g.truth;
    ++n;
  }
  return fmt::format("{{\"under\": {}, \"texels\": {}, \"true\": {:.4f}, \"said\": {:.4f}}}", high, n, rms(truth, n),
                     rms(said, n));
}

Result<void> run(char** argv) {
  LitView view;
  if (auto opened = open_view(view, argv[1], argv[2], argv[3], argv[4], std::strtod(argv[5], nullptr)); !opened)
    return opened;
  const auto samples = static_cast<std::uint32_t>(std::strtoul(argv[8], nullptr, 10));
  const auto texels = random_texels(view, std::strtoul(argv[7], nullptr, 10), false);
  if (texels.empty() || samples < 4) return fail("nothing is seen, or SAMPLES is under 4");
  const Halves halves = make_halves(view, 2);
  const auto coarse = light_coarse(view, *halves[0], static_cast<std::uint32_t>(std::strtoul(argv[6], nullptr, 10)));
  if (!coarse) return fail("ROUNDS is under 1");
  halves[1]->use_stored_light(coarse);
  std::vector<Guessed> all(texels.size());
  renderer::TileFactsCache facts(texels.size() + 16);
  atlas::parallel_for(texels.size(), kThreads, [&](std::size_t i) {
    const renderer::trace::DenormalsAreZero denormals;
    const TileId tile = texels[i].first;
    const auto known = facts.get(tile, *halves[0], *view.world.store);
    const auto guess = known ? guess_of(view, *coarse, *known, texels[i]) : std::nullopt;
    if (guess) all[i] = compare(*guess, halves, texels[i], samples, view.world.exposure);
  });
  std::string bins;
  constexpr std::array kEdges{0.0f, 0.02f, 0.05f, 0.1f, 0.2f, 0.4f, 0.8f, 1e9f};
  for (std::size_t i = 0; i + 1 < kEdges.size(); ++i) bins += (i > 0 ? ", " : "") + bin(all, kEdges[i], kEdges[i + 1]);
  std::printf("{\"camera\": \"%s\", \"all\": %s, \"by_variation\": [%s]}\n", argv[3],
              bin(all, 0, kEdges.back()).c_str(), bins.c_str());
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

#include "actors/renderer/bright_samples.hpp"

#include <algorithm>
#include <bit>
#include <cmath>

namespace darm::renderer {
namespace {

constexpr double kAbout = 1.25;           // times the tolerance: not worth another look
constexpr double kGain = 0.7;             // what is left of the square has to be less, or it is not worth it
constexpr double kMostOfTexel = 1 << 12;  // samples a texel

}  // namespace

std::uint32_t bright_samples(std::span<const BrightMeasure> texels, float tolerance) {
  double flux = 0, squares = 0, square_now = 0;
  for (const auto& t : texels) {
    const double square = double{t.deviation} * double{t.deviation};
    flux += double{t.flux};
    squares += square;
    square_now += square / std::max(double{t.samples}, 1.0);
  }
  const double allowed = double{tolerance} * flux;
  if (!(allowed > 0) || !(square_now > kAbout * kAbout * allowed * allowed)) return 0;
  const double most = std::min(kSamplesOfBright / static_cast<double>(texels.size()), kMostOfTexel);
  const auto wanted = std::bit_ceil(static_cast<std::uint32_t>(std::min(squares / (allowed * allowed), most)) | 1u);
  double square_then = 0;
  for (const auto& t : texels)
    square_then += double{t.deviation} * double{t.deviation} / std::max(double{t.samples}, static_cast<double>(wanted));
  return square_then < kGain * square_now ? wanted : 0;
}

std::vector<BrightMeasure> measure_bright(const BrightTexels& bright, const atlas::RadianceStore& store, int level) {
  std::vector<BrightMeasure> measures;
  for (std::size_t i = 0; i < bright.size(); ++i) {
    const auto place = bright.place(i);
    const auto view = store.read(TileId(level, place.tile));
    const float n = view ? view->count(atlas::Layer::kSoft, place.texel) : 0.0f;
    float deviation = place.soft;  // not known: as large as the value
    if (n > 1) deviation = place.share * std::sqrt(n * view->variance_of_mean(atlas::Layer::kSoft, place.texel, 0));
    measures.push_back({place.flux, deviation, n});
  }
  return measures;
}

std::vector<CoarseRequest> requests_of(const BrightTexels& bright) {
  std::vector<CoarseRequest> requests;
  for (std::size_t i = 0; i < bright.size(); ++i) {
    const auto place = bright.place(i);
    requests.push_back({place.tile, {}});
    requests.back().mask.set(place.texel % kTileSize, place.texel / kTileSize);
  }
  return requests;
}

}  // namespace darm::renderer

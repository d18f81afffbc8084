#include "actors/renderer/view_tile.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/renderer/tile_fill.hpp"
#include "actors/renderer/tile_surface.hpp"

namespace darm::renderer {
namespace {

constexpr float kTamedUpTo = 256;       // samples; see tamed()
constexpr float kTamedFloor = 0.02f;    // linear display value below which nothing is an outlier
constexpr float kFadeOfForgotten = 0.5f;  // a picture counts so much less after the eye moved a little

}  // namespace

void ViewTile::want(const SlotMask& mask) {
  if (mask == mask_) return;
  mask_ = mask;
  survey();
}

void ViewTile::survey() {
  least_ = 0;
  double sum = 0;
  live_ = 0;
  for (int at = 0; at < kSlotTexels; ++at) {
    if (!mask_.test(at) || dead_.test(at)) continue;
    const float n = texels_[static_cast<std::size_t>(at)].count;
    least_ = live_ == 0 ? n : std::min(least_, n);
    sum += double{n};
    ++live_;
  }
  mean_ = live_ > 0 ? static_cast<float>(sum / live_) : 0.0f;
}

void ViewTile::see_from(const glm::vec3& eye, const ViewTileOptions& options) {
  const float moved = glm::length(eye - eye_);
  if (distance_ <= 0) eye_ = eye;  // no samples yet
  if (distance_ <= 0 || moved <= options.least_turn * distance_) return;
  const float turn = moved / distance_;
  const float kept = std::clamp(1.0f - turn / (options.lobe_share * alpha_), 0.0f, 1.0f);
  eye_ = eye;
  for (auto& t : texels_) {
    t.count = t.count * kept < 0.5f ? 0.0f : t.count * kept;
    t.m2 = t.count > 0 ? t.m2 * kept : 0.0f;
    if (kept <= 0) t.drawn = 0;
  }
  if (kept <= 0) {
    ++sequence_;
    alpha_ = 1;
    distance_ = 0;
  }
  error_ = 1;
  survey();
  if (pictured_ >= 0) pictured_ = std::min(pictured_ * kept, mean_) * kFadeOfForgotten;
}

bool ViewTile::finished(const ViewTileOptions& options) const {
  if (live_ == 0) return true;
  return least_ >= options.max_samples || (pictured_ > 0 && least_ >= 16 && error_ < options.target_error);
}

void ViewTile::add(Texel& texel, const ViewDependentLight& light) {
  alpha_ = std::min(alpha_, light.ggx_alpha);
  if (light.distance > 0) distance_ = distance_ > 0 ? std::min(distance_, light.distance) : light.distance;
  texel.count += 1;
  texel.shown = true;
  if (texel.count <= 1) {
    texel.mean = light.radiance;
    texel.m2 = 0;
    return;
  }
  const glm::vec3 before = texel.mean;
  texel.mean += (light.radiance - before) * (1.0f / texel.count);
  texel.m2 += luminance(light.radiance - before) * luminance(light.radiance - texel.mean);
}

std::uint32_t ViewTile::shade(ViewSurface& surface, std::uint32_t passes) {
  const float goal = least_ + static_cast<float>(passes);
  std::uint32_t taken = 0;
  for (int at = 0; at < kSlotTexels; ++at) {
    if (!mask_.test(at) || dead_.test(at)) continue;
    auto& texel = texels_[static_cast<std::size_t>(at)];
    for (std::uint32_t i = 0; i < passes && texel.count + 0.5f < goal; ++i) {
      const auto light = surface.light(at, eye_, sequence_, texel.drawn++);
      if (!light) {
        dead_.set_row(at / kSlotSize, at % kSlotSize, at % kSlotSize);
        break;
      }
      ++taken;
      const glm::vec3& l = light->radiance;
      add(texel, std::isfinite(l.x + l.y + l.z) ? *light : ViewDependentLight{});
    }
  }
  if (pictured_ > 0 && least_ <= 0) pictured_ = 0;  // texels seen for the first time
  survey();
  return taken;
}

bool ViewTile::picture_due(const ViewTileOptions& options) const {
  if (live_ == 0 || least_ < 0.5f) return false;
  return pictured_ <= 0 || mean_ >= options.publish_growth * pictured_;
}

// A lone bright texel among few samples is held to a multiple of its brightest neighbour, for the picture alone; the
// multiple grows with the samples until it stands for itself (as for the shared light: outliers.hpp).
glm::vec3 ViewTile::tamed(int at) const {
  const auto& texel = texels_[static_cast<std::size_t>(at)];
  if (texel.count >= kTamedUpTo) return texel.mean;
  float most = 0;
  const int x = at % kSlotSize;
  const int y = at / kSlotSize;
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, kSlotSize - 1); ++j)
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, kSlotSize - 1); ++i) {
      const auto& other = texels_[static_cast<std::size_t>(j * kSlotSize + i)];
      if ((i != x || j != y) && other.shown) most = std::max(most, luminance(other.mean));
    }
  const float own = luminance(texel.mean);
  const float limit = (2.0f + texel.count / 8.0f) * most;
  return own > limit && most > 0 ? texel.mean * (limit / own) : texel.mean;
}

float ViewTile::error_of(const TileImage& image, const ViewTileOptions& options) const {
  double squares = 0;
  int texels = 0;
  for (int at = 0; at < kSlotTexels; ++at) {
    if (!mask_.test(at) || dead_.test(at)) continue;
    const auto& t = texels_[static_cast<std::size_t>(at)];
    ++texels;
    if (t.count < 2) {
      squares += 0.25 * 0.25;
      continue;
    }
    const std::uint8_t* rgb = &image.rgb[static_cast<std::size_t>(at) * 3];
    const auto code = static_cast<std::uint8_t>(std::lround(0.2126f * rgb[0] + 0.7152f * rgb[1] + 0.0722f * rgb[2]));
    const double variance = double{t.m2} / (double{t.count} * std::max(1.0, double{t.count} - 1));
    const double e = double{srgb_slope(code)} * double{options.exposure} * std::sqrt(std::max(variance, 0.0));
    squares += std::min(e * e, 0.25);
  }
  return texels > 0 ? static_cast<float>(std::sqrt(squares / texels)) : 0.0f;
}

TilePicture ViewTile::draw(ViewSurface& surface, const ViewTileOptions& options) {
  SlotFill<3> fill;
  for (int at = 0; at < kSlotTexels; ++at) {
    fill.patch[static_cast<std::size_t>(at)] = surface.patch(at);
    const auto& texel = texels_[static_cast<std::size_t>(at)];
    if (!texel.shown || dead_.test(at)) continue;
    const glm::vec3 light = (luminance(texel.mean) * options.exposure > kTamedFloor ? tamed(at) : texel.mean);
    const glm::vec3 shown = glm::max(light, glm::vec3(0.0f)) * options.exposure;
    fill.set(at, {shown.x, shown.y, shown.z});
  }
  // Other patches in the tile may have nothing private: filled across, they would get light that is not theirs.
  fill.run_within_patches();
  auto image = std::make_shared<TileImage>();
  for (std::size_t at = 0; at < kSlotTexels; ++at)
    for (std::size_t c = 0; c < 3; ++c) image->rgb[at * 3 + c] = srgb_code(fill.value[at][c]);
  convert_to_planes(*image);
  if (!through_known_) through_ = surface.through();
  through_known_ = true;
  image->through = through_;
  TilePicture picture;
  picture.error = error_ = error_of(*image, options);
  picture.samples = pictured_ = mean_;
  picture.image = std::move(image);
  return picture;
}

}  // namespace darm::renderer

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

constexpr float kTamedUpTo = 1024;        // samples; see tamed()
constexpr float kTamedFloor = 0.02f;      // linear display value below which nothing is an outlier
constexpr float kPedestal = 0.01f;        // linear display value
constexpr float kWideLobe = 0.2f;         // GGX alpha from which neighbouring texels reflect much the same
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
  double variance = 0;
  live_ = 0;
  for (int at = 0; at < kSlotTexels; ++at) {
    if (!mask_.test(at) || dead_.test(at)) continue;
    const auto& texel = texels_[static_cast<std::size_t>(at)];
    const float n = texel.count;
    variance += n >= 2 ? double{variance_of(texel)} : 1.0;
    least_ = live_ == 0 ? n : std::min(least_, n);
    sum += double{n};
    ++live_;
  }
  mean_ = live_ > 0 ? static_cast<float>(sum / live_) : 0.0f;
  display_variance_ = live_ > 0 ? static_cast<float>(variance / live_) : 1.0f;
}

// Of one sample, in display values: on top of what is known of the shared layer there, and at least a little.
float ViewTile::variance_of(const Texel& texel) const {
  const float linear = std::max(luminance(texel.mean) + texel.beneath, 0.0f) * exposure_ + kPedestal;
  const float slope = srgb_slope(srgb_code(linear)) * exposure_;
  return texel.m2 / std::max(texel.count - 1.0f, 1.0f) * slope * slope;
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

bool ViewTile::finished(const ViewTileOptions& options, float target_error) const {
  if (live_ == 0) return true;
  return least_ >= options.max_samples || (pictured_ > 0 && least_ >= 16 && error_ < target_error);
}

void ViewTile::add(Texel& texel, const ViewDependentLight& light) {
  alpha_ = std::min(alpha_, light.ggx_alpha);
  if (light.distance > 0) distance_ = distance_ > 0 ? std::min(distance_, light.distance) : light.distance;
  texel.count += 1;
  texel.shown = true;
  texel.beneath = light.beneath;
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
// multiple grows with the samples until it stands for itself. As for the shared light (outliers.hpp), but slower: paths
// begin at a mirror, so that rare bright ones are commoner, and no filter spreads them.
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
  const float limit = (2.0f + texel.count / 32.0f) * most;
  return own > limit && most > 0 ? texel.mean * (limit / own) : texel.mean;
}

// A wide lobe reflects smoothly: while samples are few the picture is of the mean around each texel. Gone with 256.
// What a mirror shows is noise at a sample or two, and the eye that has so few is moving: there a blur of a pixel is
// better.
int ViewTile::filter_radius() const {
  if (alpha_ < kWideLobe) return mean_ < 2 ? 2 : mean_ < 8 ? 1 : 0;
  return mean_ < 64 ? 2 : mean_ < 256 ? 1 : 0;
}

// RMS over the wanted texels, in display values, of what a pixel shows that reads about five of them: noise of the mean
// over the filter's square, and what that smears: by how much more than their noise the texels differ from what is
// shown instead. `light`: nits; `shown`: the same filtered, exposed.
float ViewTile::error_of(const std::vector<glm::vec3>& light, const std::vector<glm::vec3>& shown) const {
  const auto side = static_cast<double>(2 * filter_radius() + 1);
  const double gathered = side * side;
  double noise = 0, smear = 0;
  int texels = 0;
  for (int at = 0; at < kSlotTexels; ++at) {
    if (!mask_.test(at) || dead_.test(at)) continue;
    const auto& t = texels_[static_cast<std::size_t>(at)];
    ++texels;
    const auto display = [&](const glm::vec3& v) { return double{srgb(luminance(v) + t.beneath * exposure_)}; };
    const auto i = static_cast<std::size_t>(at);
    const double sample = display(light[i] * exposure_);
    // One sample tells nothing of its error: as much as it brings.
    const double guess = sample - display(glm::vec3(0.0f));
    const double own = t.count < 2 ? guess * guess : std::min(double{variance_of(t)} / double{t.count}, 0.25);
    noise += own / (gathered + kPixelTexels - 1);
    const double apart = sample - display(shown[i]);
    smear += t.count < 2 ? 0.0 : apart * apart - own * (1 - 1 / gathered);
  }
  return texels > 0 ? static_cast<float>(std::sqrt((noise + std::max(smear, 0.0)) / texels)) : 0.0f;
}

TilePicture ViewTile::draw(ViewSurface& surface) {
  SlotFill<3> fill;
  std::vector<glm::vec3> light(kSlotTexels, glm::vec3(0.0f));
  std::vector<glm::vec3> filtered(kSlotTexels, glm::vec3(0.0f));
  for (int at = 0; at < kSlotTexels; ++at) {
    fill.patch[static_cast<std::size_t>(at)] = surface.patch(at);
    const auto& texel = texels_[static_cast<std::size_t>(at)];
    if (!texel.shown || dead_.test(at)) continue;
    light[static_cast<std::size_t>(at)] = luminance(texel.mean) * exposure_ > kTamedFloor ? tamed(at) : texel.mean;
  }
  const int radius = filter_radius();
  for (int at = 0; at < kSlotTexels; ++at) {
    if (!texels_[static_cast<std::size_t>(at)].shown || dead_.test(at)) continue;
    glm::vec3 sum(0.0f);
    float weight = 0;
    const int x = at % kSlotSize;
    const int y = at / kSlotSize;
    for (int j = std::max(y - radius, 0); j <= std::min(y + radius, kSlotSize - 1); ++j)
      for (int i = std::max(x - radius, 0); i <= std::min(x + radius, kSlotSize - 1); ++i) {
        const auto other = static_cast<std::size_t>(j * kSlotSize + i);
        if (fill.patch[other] != fill.patch[static_cast<std::size_t>(at)] || !texels_[other].shown) continue;
        const float w = std::max(texels_[other].count, 0.5f);
        sum += light[other] * w;
        weight += w;
      }
    const glm::vec3 shown = sum * (exposure_ / std::max(weight, 1e-6f));
    filtered[static_cast<std::size_t>(at)] = shown;
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
  picture.error = error_ = error_of(light, filtered);
  picture.samples = pictured_ = mean_;
  picture.image = std::move(image);
  return picture;
}

}  // namespace darm::renderer

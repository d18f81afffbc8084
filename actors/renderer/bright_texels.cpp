#include "actors/renderer/bright_texels.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/renderer/stored_light.hpp"

namespace darm::renderer {
namespace {

constexpr float kStandsOut = 6.0f;             // times the mean, what is not known taken for dark
constexpr std::size_t kMostBright = 1u << 17;  // texels
constexpr float kOfMean = 0.5f;                // what surfaces reflect, where only roughly needed
constexpr float kWorth = 0.125f;      // over the spread of what rays find, squared, of its mean: the chance of a draw
constexpr float kLeastChance = 0.5f;  // less is not worth its time
constexpr float kLeastLight = 0.25f;  // of what bright texels would send there, if nothing stood between
constexpr float kWideSpread = 4.0f;
constexpr float kWorthwhile = 0.85f;      // of what is sent, to receivers with a wide spread
constexpr std::uint32_t kFirstLook = 16;  // one texel of so many tells whether there is anything to aim at
constexpr std::size_t kReceivers = 256;
constexpr float kGroupTexels = 4.0f;  // half the extent of a group to begin with

// The value above which light stands out, and the mean of those below.
struct Threshold {
  float least = 0;
  float rest = 0;
};

Threshold threshold_of(std::vector<float> values, std::size_t all) {
  double sum = 0;
  for (const float v : values) sum += double{v};
  Threshold out;
  out.least = kStandsOut * static_cast<float>(sum / static_cast<double>(std::max(all, std::size_t{1})));
  if (kMostBright < values.size()) {
    const auto nth = values.begin() + static_cast<std::ptrdiff_t>(kMostBright);
    std::ranges::nth_element(values, nth, std::greater<>());
    out.least = std::max(*nth, out.least);
  }
  double rest = 0, count = 0;
  for (const float v : values)
    if (!(v > out.least)) rest += double{v}, ++count;
  out.rest = count > 0 ? static_cast<float>(rest / count) : 0.0f;
  return out;
}

float light_of(const StoredTexel& texel) { return texel.known ? luminance(texel.sharp + texel.soft) : 0.0f; }

// Where paths end in stored light, and nowhere pass.
bool ends_paths(const scene::Material& m) {
  return m.alpha_mode == scene::AlphaMode::kOpaque && !m.unlit && !m.emits() && !(m.transmission > 0);
}

}  // namespace

struct BrightTexels::Found {
  Texel texel;
  std::uint32_t at = 0;  // of the level, row-major
  glm::vec3 position{0.0f}, normal{0, 0, 1};
  float radiance = 0, area = 0;
  std::uint64_t cell = 0;
};

BrightTexels::BrightTexels(const StoredLight& light, const atlas::TexelMapper& mapper,
                           const LightTransport& transport) {
  BrightTexels few;
  few.build(light, mapper, transport, kFirstLook);
  if (!few.empty() && few.share_of_wide(light, mapper, transport) > kWorthwhile) build(light, mapper, transport, 1);
}

void BrightTexels::build(const StoredLight& light, const atlas::TexelMapper& mapper, const LightTransport& transport,
                         std::uint32_t stride) {
  layout_ = light.layout();
  auto found = find(light, mapper, transport, stride);
  if (found.empty()) return;
  group(found);
  number_.assign(light.texels().size(), 0);
  texels_.reserve(found.size());
  for (auto first = found.begin(); first != found.end();) {
    const auto end = std::find_if(first, found.end(), [&](const Found& f) { return f.cell != first->cell; });
    add_group(&*first, &*first + (end - first));
    first = end;
  }
  first_.push_back(static_cast<std::uint32_t>(texels_.size()));
}

// Of what bright texels send to receivers all over the scene: how much goes to those that find it by chance only. Not
// of the receivers: the outside of a closed room faces a few by the roughness of groups, and is dark.
float BrightTexels::share_of_wide(const StoredLight& light, const atlas::TexelMapper& mapper,
                                  const LightTransport& transport) const {
  const auto texels = light.texels();
  const auto& level = layout_->levels.back();
  const std::size_t step = std::max(texels.size() / (2 * kReceivers), std::size_t{1}) | 1;  // half are nobody's
  double wide = 0, all = 0;
  for (std::size_t at = step / 2; at < texels.size(); at += step) {
    const auto x = static_cast<int>(at % level.width), y = static_cast<int>(at / level.width);
    const auto tile =
        static_cast<std::uint32_t>(y / kTileSize) * level.tiles_x + static_cast<std::uint32_t>(x / kTileSize);
    const auto point = mapper.tile(TileId(layout_->coarse_level(), tile))->center(x % kTileSize, y % kTileSize);
    if (!point) continue;
    const auto surface = trace::make_unbent_surface(transport.rays(), *point);
    const float soft = texels[at].known ? luminance(texels[at].soft) : -1.0f;
    const Aim sent = aim(surface.position, surface.normal, soft);
    if (!(sent.spread > 0)) continue;
    all += double{sent.sum};
    if (sent.spread > kWideSpread) wide += double{sent.sum};
  }
  return all > 0 ? static_cast<float>(wide / all) : 0.0f;
}

std::vector<BrightTexels::Found> BrightTexels::find(const StoredLight& light, const atlas::TexelMapper& mapper,
                                                    const LightTransport& transport, std::uint32_t stride) {
  const auto texels = light.texels();
  std::vector<float> values;
  for (const auto& texel : texels)
    if (texel.known) values.push_back(light_of(texel));
  const Threshold threshold = threshold_of(std::move(values), texels.size());
  rest_ = kOfMean * threshold.rest;
  std::vector<Found> found;
  if (!(threshold.least > 0)) return found;
  const auto& level = layout_->levels.back();
  std::vector<std::uint32_t> known_tile(std::size_t{level.tiles_x} * level.tiles_y, 0);
  std::uint32_t number = 0;
  for (std::uint32_t at = 0; at < texels.size(); ++at) {
    const float value = light_of(texels[at]);
    if (!(value > threshold.least) || number++ % stride != 0) continue;
    const std::uint32_t x = at % level.width, y = at / level.width;
    const std::uint32_t index = y / kTileSize * level.tiles_x + x / kTileSize;
    if (known_tile[index] == 0) {
      tiles_.push_back(mapper.tile(TileId(layout_->coarse_level(), index)));
      tile_index_.push_back(index);
      known_tile[index] = static_cast<std::uint32_t>(tiles_.size());
    }
    Found f;
    f.at = at;
    f.texel.tile = known_tile[index] - 1;
    f.texel.x = static_cast<std::uint16_t>(x % kTileSize);
    f.texel.y = static_cast<std::uint16_t>(y % kTileSize);
    const auto& tile = *tiles_[f.texel.tile];
    if (tile.is_gutter(f.texel.x, f.texel.y)) continue;
    const auto point = tile.center(f.texel.x, f.texel.y);
    if (!point) continue;
    const float scale = level.placements[index_of(tile.patch_at(f.texel.x, f.texel.y))].scale * level.density;
    const auto surface = trace::make_unbent_surface(transport.rays(), *point);
    if (!(scale > 0) || !ends_paths(*surface.placed->material)) continue;
    f.position = surface.position;
    f.normal = surface.geometric_normal;
    f.radiance = value * luminance(transport.diffuse_albedo(*point));
    f.area = static_cast<float>(stride) / (scale * scale);
    f.texel.flux = f.radiance * f.area;
    f.texel.share = f.texel.flux / value;
    f.texel.soft = f.texel.share * luminance(texels[at].soft);
    if (f.texel.flux > 0 && std::isfinite(f.texel.flux)) found.push_back(f);
  }
  cell_ = kGroupTexels / level.density;
  return found;
}

// Cells of space and six facings, as small as make no more groups than may be.
void BrightTexels::group(std::vector<Found>& found) {
  glm::vec3 low = found.front().position, high = low;
  for (const auto& f : found) low = glm::min(low, f.position), high = glm::max(high, f.position);
  const glm::vec3 extent = high - low;
  cell_ = std::max(cell_, std::max({extent.x, extent.y, extent.z}) * 0x1p-18f);  // a coordinate has 20 bits
  while (true) {
    for (auto& f : found) {
      const glm::vec3 at = (f.position - low) / (2 * cell_);
      const glm::vec3 size = glm::abs(f.normal);
      const int axis = size.x > size.y ? (size.x > size.z ? 0 : 2) : (size.y > size.z ? 1 : 2);
      const auto facing = static_cast<std::uint64_t>(2 * axis + (f.normal[axis] > 0 ? 1 : 0));
      f.cell = ((static_cast<std::uint64_t>(at.x) << 20 | static_cast<std::uint64_t>(at.y)) << 20 |
                static_cast<std::uint64_t>(at.z))
                   << 3 |
               facing;
    }
    std::ranges::sort(found,
                      [](const Found& a, const Found& b) { return std::pair(a.cell, a.at) < std::pair(b.cell, b.at); });
    std::size_t groups = 1;
    for (std::size_t i = 1; i < found.size(); ++i) groups += found[i].cell != found[i - 1].cell ? 1 : 0;
    if (groups <= kMostGroups) return;
    cell_ *= 2;
  }
}

void BrightTexels::add_group(const Found* first, const Found* end) {
  double flux = 0, area = 0;
  glm::dvec3 position(0.0), normal(0.0);
  for (const Found* f = first; f != end; ++f) {
    const double power = double{f->radiance} * double{f->area};
    flux += power;
    area += double{f->area};
    position += power * glm::dvec3(f->position);
    normal += power * glm::dvec3(f->normal);
  }
  position /= flux;
  const double length = glm::length(normal);
  normal = length > 1e-9 * flux ? normal / length : glm::dvec3(first->normal);
  double square = 0, depth = 0, least_cosine = 1;
  const auto group = static_cast<std::uint32_t>(x_.size());
  first_.push_back(static_cast<std::uint32_t>(texels_.size()));
  double reached = 0;
  for (const Found* f = first; f != end; ++f) {
    const double share = double{f->radiance} * double{f->area} / flux;
    const glm::dvec3 off = glm::dvec3(f->position) - position;
    square += share * (glm::dot(off, off) + double{f->area} / 6);
    depth = std::max(depth, std::abs(glm::dot(off, normal)));
    least_cosine = std::min(least_cosine, glm::dot(glm::dvec3(f->normal), normal));
    reached += share;
    Texel texel = f->texel;
    texel.group = group;
    texel.probability = static_cast<float>(share);
    texel.reached = f + 1 == end ? 1.0f : static_cast<float>(reached);
    texels_.push_back(texel);
    number_[f->at] = static_cast<std::uint32_t>(texels_.size());
  }
  x_.push_back(static_cast<float>(position.x));
  y_.push_back(static_cast<float>(position.y));
  z_.push_back(static_cast<float>(position.z));
  normal_x_.push_back(static_cast<float>(normal.x));
  normal_y_.push_back(static_cast<float>(normal.y));
  normal_z_.push_back(static_cast<float>(normal.z));
  flux_.push_back(static_cast<float>(flux * double{kInversePi}));
  radiance_.push_back(static_cast<float>(flux / area));
  square_.push_back(static_cast<float>(square));
  const double half = std::sqrt(0.5 * square);
  half_.push_back(static_cast<float>(half));
  depth_.push_back(static_cast<float>(depth + half * std::sqrt(std::max(1 - least_cosine * least_cosine, 0.0))));
}

BrightTexels::Place BrightTexels::place(std::size_t i) const {
  const Texel& texel = texels_[i];
  return {tile_index_[texel.tile], texel.y * kTileSize + texel.x, texel.flux, texel.soft, texel.share};
}

BrightTexels::Aim BrightTexels::aim(const glm::vec3& position, const glm::vec3& normal, float light) const {
  Aim aim;
  const std::size_t n = x_.size();
  float sum = 0, squares = 0;
  for (std::size_t i = 0; i < n; ++i) {
    const float x = x_[i] - position.x, y = y_[i] - position.y, z = z_[i] - position.z;
    const float square = x * x + y * y + z * z + 2 * square_[i];
    // Parts of a group may stand above a horizon that its middle is below: above the receiver's as far as it reaches
    // along the normal there, above its own as far as it is not flat.
    const float facing = normal.x * normal_x_[i] + normal.y * normal_y_[i] + normal.z * normal_z_[i];
    const float reach = half_[i] * std::sqrt(std::max(1 - facing * facing, 0.0f)) + depth_[i];
    const float here = std::max(x * normal.x + y * normal.y + z * normal.z + reach, 0.0f);
    const float there = std::max(depth_[i] - (x * normal_x_[i] + y * normal_y_[i] + z * normal_z_[i]), 0.0f);
    const float weight = flux_[i] * std::min(here * there / square, 1.0f) / square;
    aim.weights[i] = weight;
    sum += weight;
    squares += weight * radiance_[i];
  }
  aim.sum = sum;
  if (!(sum > 0) || !std::isfinite(sum)) return aim;
  const float mean = light >= 0 ? std::max(light, kLeastLight * sum) : sum + rest_;
  const float arrives = std::min(1.0f, mean / sum);  // no more than all
  aim.spread = squares * arrives / (mean * mean);
  const float chance = kWorth * aim.spread;
  if (chance >= kLeastChance) aim.chance = std::min(chance, 1.0f);
  return aim;
}

float BrightTexels::texels_per_area(const SurfacePoint& point, float triangle_area) const {
  const PatchId patch = layout_->patch_of(point.instance, point.triangle, point.front);
  const auto& level = layout_->levels.back();
  const float scale = level.placements[index_of(patch)].scale * level.density;
  const auto& uv = layout_->charts[layout_->instances[point.instance].chart].uv[point.triangle];
  const glm::vec2 a = (uv[1] - uv[0]) * scale, b = (uv[2] - uv[0]) * scale;
  const float flat = 0.5f * std::abs(a.x * b.y - a.y * b.x);
  const float density = flat / triangle_area;
  return std::isfinite(density) ? density : 0.0f;
}

std::optional<SurfacePoint> BrightTexels::draw(const Aim& aim, float xi, const glm::vec2& place) const {
  float left = xi * aim.sum;
  std::size_t group = 0;
  for (; group + 1 < x_.size() && left >= aim.weights[group]; ++group) left -= aim.weights[group];
  const float weight = aim.weights[group];
  if (!(weight > 0)) return std::nullopt;  // rounding at the last group's end
  const float rest = std::clamp(left / weight, 0.0f, 0.99999994f);
  const auto begin = texels_.begin() + first_[group], end = texels_.begin() + first_[group + 1];
  const auto found = std::upper_bound(begin, end - 1, rest, [](float x, const Texel& t) { return x < t.reached; });
  const Texel& texel = *found;
  const auto point = tiles_[texel.tile]->sample(texel.x, texel.y, place);
  if (!point) return std::nullopt;
  // Where the texel's place is nobody's the nearest point was given.
  const PatchId patch = layout_->patch_of(point->instance, point->triangle, point->front);
  if (patch == kNoPatch) return std::nullopt;
  const auto& level = layout_->levels.back();
  const glm::vec2 corner(static_cast<float>(tile_index_[texel.tile] % level.tiles_x * kTileSize + texel.x),
                         static_cast<float>(tile_index_[texel.tile] / level.tiles_x * kTileSize + texel.y));
  const glm::vec2 off = layout_->texel_at(patch, layout_->coarse_level(),
                                          layout_->patch_uv(point->instance, point->triangle, point->u, point->v)) -
                        corner - place;
  if (!(glm::dot(off, off) < 1e-4f)) return std::nullopt;
  return point;
}

float BrightTexels::pdf_area(const Aim& aim, const SurfacePoint& point, float triangle_area) const {
  const PatchId patch = layout_->patch_of(point.instance, point.triangle, point.front);
  if (patch == kNoPatch) return 0;
  const glm::vec2 at = layout_->texel_at(patch, layout_->coarse_level(),
                                         layout_->patch_uv(point.instance, point.triangle, point.u, point.v));
  const auto& level = layout_->levels.back();
  if (!(at.x >= 0 && at.y >= 0)) return 0;
  const auto x = static_cast<std::size_t>(at.x), y = static_cast<std::size_t>(at.y);
  if (x >= level.width || y >= level.height) return 0;
  const std::uint32_t number = number_[y * level.width + x];
  if (number == 0) return 0;
  const Texel& texel = texels_[number - 1];
  return aim.weights[texel.group] / aim.sum * texel.probability * texels_per_area(point, triangle_area);
}

}  // namespace darm::renderer

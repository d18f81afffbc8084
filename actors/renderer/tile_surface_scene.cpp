#include "actors/renderer/tile_surface_scene.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "actors/renderer/sampler.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/renderer/surface_world.hpp"

namespace darm::renderer {

namespace {

constexpr std::uint64_t kAlbedoSeed = 0xa1bed0;
constexpr std::uint32_t kEmitterSeed = 0xe317;
constexpr std::uint32_t kEmitterRays = 4096;
constexpr float kOffEmitter = 1e-5f;   // of the largest coordinate
constexpr double kConcentrated = 100;  // times as many rays meet where another did as if they went to all texels alike
constexpr std::uint64_t kSoftSeed = 0x50f7;  // the two layers draw apart

class SceneTile : public TileSurface {
 public:
  SceneTile(TileId id, std::shared_ptr<const SurfaceWorld> world, std::shared_ptr<const StoredLight> stored)
      : id_(id), world_(std::move(world)), stored_(std::move(stored)), texels_(world_->mapper->tile(id)) {}

  [[nodiscard]] std::uint32_t patch(int texel) const override {
    return index_of(texels_->patch_at(texel % kTileSize, texel / kTileSize));
  }

  [[nodiscard]] std::optional<glm::vec3> sharp(int texel, std::uint32_t sample) const override {
    Sampler sampler(world_->seed, hash_pair(id_.packed, static_cast<std::uint32_t>(texel)), sample);
    const auto point = covered_point(texel, sampler);
    if (!point) return std::nullopt;
    return world_->transport->sharp_light(*point, sampler);
  }

  [[nodiscard]] std::optional<glm::vec3> soft(int texel, std::uint32_t sample) const override {
    Sampler sampler(world_->seed + kSoftSeed, hash_pair(id_.packed, static_cast<std::uint32_t>(texel)), sample);
    const auto point = covered_point(texel, sampler);
    if (!point) return std::nullopt;
    return world_->transport->soft_light(*point, sampler, stored_.get());
  }

  [[nodiscard]] std::optional<glm::vec3> albedo(int texel, std::uint32_t sample) const override {
    Sampler sampler(kAlbedoSeed, hash_pair(id_.packed, static_cast<std::uint32_t>(texel)), sample);
    const auto point = covered_point(texel, sampler);
    if (!point) return std::nullopt;
    return world_->transport->diffuse_albedo(*point);
  }

  [[nodiscard]] glm::vec3 emission(int texel, std::uint32_t sample) const override {
    Sampler sampler(kAlbedoSeed, hash_pair(id_.packed, static_cast<std::uint32_t>(texel)), sample);
    const auto point = covered_point(texel, sampler);
    return point ? world_->transport->emission(*point) : glm::vec3(0.0f);
  }

  [[nodiscard]] bool emits() const override {
    return std::any_of(texels_->fragments().begin(), texels_->fragments().end(), [this](const auto& f) {
      const auto& material = world_->material_of(f.instance);
      return material.emits() || material.unlit;
    });
  }

  [[nodiscard]] std::optional<float> alpha(int texel, std::uint32_t sample) const override {
    const auto candidates = texels_->candidates(texel % kTileSize, texel / kTileSize);
    if (candidates.empty()) return std::nullopt;
    // A texel belongs to one patch, a patch to one mesh, a mesh has one material.
    const auto& material = world_->material_of(texels_->fragment(candidates.front()).instance);
    if (material.alpha_mode == scene::AlphaMode::kOpaque) return 1.0f;
    Sampler sampler(kAlbedoSeed, hash_pair(id_.packed, static_cast<std::uint32_t>(texel)), sample);
    const auto point = texels_->sample(texel % kTileSize, texel / kTileSize, sampler.next_2d());
    if (!point) return std::nullopt;
    return world_->alpha(*point);
  }

  [[nodiscard]] bool translucent() const override {
    return std::any_of(texels_->fragments().begin(), texels_->fragments().end(), [this](const auto& f) {
      return world_->material_of(f.instance).alpha_mode != scene::AlphaMode::kOpaque;
    });
  }

  [[nodiscard]] bool divided(int texel) const override {
    constexpr std::array<glm::vec2, 4> kSides{{{0, 0.5f}, {1, 0.5f}, {0.5f, 0}, {0.5f, 1}}};
    const auto middle = surface_at(texel, glm::vec2(0.5f));
    return middle && std::ranges::any_of(kSides, [&](const glm::vec2& side) {
             const auto end = surface_at(texel, side);
             return end && parted(*middle, *end);
           });
  }

  [[nodiscard]] TileWalls walls() const override { return find_walls(*texels_, world_->transport->rays()); }

 private:
  [[nodiscard]] std::optional<trace::Surface> surface_at(int texel, const glm::vec2& xi) const {
    const auto point = texels_->sample(texel % kTileSize, texel / kTileSize, xi);
    if (!point) return std::nullopt;
    const auto& rays = world_->transport->rays();
    return trace::make_unbent_surface(rays, trace::off_edges(rays, *point));
  }

  // The look goes a quarter of its length above the surface: a curved one is no wall to itself.
  [[nodiscard]] bool parted(const trace::Surface& a, const trace::Surface& b) const {
    return renderer::parted(world_->transport->rays(), a, b, 0.25f * glm::length(b.position - a.position));
  }

  [[nodiscard]] std::optional<SurfacePoint> covered_point(int texel, Sampler& sampler) const {
    return world_->covered_point(*texels_, texel % kTileSize, texel / kTileSize, sampler);
  }

  TileId id_;
  std::shared_ptr<const SurfaceWorld> world_;
  std::shared_ptr<const StoredLight> stored_;
  std::shared_ptr<const atlas::TileTexels> texels_;
};

class SceneSurfaces : public TileSurfaces {
 public:
  explicit SceneSurfaces(std::shared_ptr<const SurfaceWorld> world) : world_(std::move(world)) {}
  [[nodiscard]] std::shared_ptr<const TileSurface> tile(TileId id) const override {
    const auto& levels = world_->mapper->layout().levels;
    if (static_cast<std::size_t>(id.level()) >= levels.size()) return nullptr;
    const auto& level = levels[static_cast<std::size_t>(id.level())];
    if (id.index() >= level.tiles_x * level.tiles_y) return nullptr;
    return std::make_shared<SceneTile>(id, world_, stored_);
  }
  [[nodiscard]] std::vector<CoarseRequest> shone_on() const override;
  [[nodiscard]] std::optional<glm::uvec2> shone_on(std::uint32_t ray) const;
  void find_bright(StoredLight& light) const override {
    light.give_bright(BrightTexels(light, *world_->mapper, *world_->transport));
  }
  void use_stored_light(std::shared_ptr<const StoredLight> light) override { stored_ = std::move(light); }

 private:
  std::shared_ptr<const SurfaceWorld> world_;
  std::shared_ptr<const StoredLight> stored_;
};

// Where a ray from a point of an emitter ends, in texels of the coarse level: each ray has as much light.
std::optional<glm::uvec2> SceneSurfaces::shone_on(std::uint32_t ray) const {
  Sampler sampler(world_->seed, kEmitterSeed, ray);
  const float pick = sampler.next_1d();
  const EmitterDraw from = world_->transport->lights().draw_emitter(pick, sampler.next_2d());
  if (!(from.pdf_area > 0)) return std::nullopt;
  const glm::vec3 normal = from.double_sided && sampler.next_1d() < 0.5f ? -from.normal : from.normal;
  glm::vec3 tangent, bitangent;
  trace::make_frame(normal, tangent, bitangent);
  const glm::vec3 d = sample_cosine(sampler.next_2d());
  const float off = kOffEmitter * trace::detail::largest_size(from.position) + trace::detail::kOffsetSmallest;
  trace::Hit hit;
  if (!world_->transport->rays().closest(
          {from.position + normal * off, 0.0f, tangent * d.x + bitangent * d.y + normal * d.z, 1e30f}, hit))
    return std::nullopt;
  const auto& layout = world_->mapper->layout();
  const PatchId patch = layout.patch_of(hit.instance, hit.triangle, hit.front);
  if (patch == kNoPatch) return std::nullopt;
  return glm::uvec2(
      layout.texel_at(patch, layout.coarse_level(), layout.patch_uv(hit.instance, hit.triangle, hit.u, hit.v)));
}

std::vector<CoarseRequest> SceneSurfaces::shone_on() const {
  const auto& lights = world_->transport->lights();
  // Of other light it is not known what it is beside theirs.
  if (!lights.has_emitters() || lights.has_punctual() || !lights.suns().empty() || world_->scene->sky.emits())
    return {};
  const auto& level = world_->mapper->layout().levels.back();
  std::map<std::uint32_t, double> met;  // texel, row-major -> rays
  for (std::uint32_t ray = 0; ray < kEmitterRays; ++ray)
    if (const auto at = shone_on(ray)) ++met[at->y * level.width + at->x];
  double pairs = 0;
  for (const auto& [texel, rays] : met) pairs += rays * (rays - 1);
  const double evenly = kEmitterRays * (kEmitterRays - 1.0) / (static_cast<double>(level.width) * level.height);
  if (pairs < kConcentrated * evenly) return {};
  std::vector<CoarseRequest> out;
  for (const auto& [texel, rays] : met) {
    const std::uint32_t x = texel % level.width, y = texel / level.width;
    out.push_back({y / kTileSize * level.tiles_x + x / kTileSize, {}});
    out.back().mask.set(static_cast<int>(x % kTileSize), static_cast<int>(y % kTileSize));
  }
  return out;
}

}  // namespace

std::shared_ptr<TileSurfaces> make_scene_surfaces(std::shared_ptr<const scene::Scene> scene,
                                                  std::shared_ptr<const atlas::TexelMapper> mapper,
                                                  std::shared_ptr<const LightTransport> transport, std::uint64_t seed) {
  auto world = std::make_shared<SurfaceWorld>();
  world->scene = std::move(scene);
  world->mapper = std::move(mapper);
  world->transport = std::move(transport);
  world->seed = seed;
  return std::make_shared<SceneSurfaces>(std::move(world));
}

std::vector<LevelTiles> level_tiles_of(const atlas::Layout& layout) {
  std::vector<LevelTiles> levels;
  for (const auto& l : layout.levels) levels.push_back({l.tiles_x, l.tiles_y});
  return levels;
}

}  // namespace darm::renderer

#include "client/core/scene_model.hpp"

#include <fmt/format.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <cmath>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <utility>

#include "client/core/inflate.hpp"
#include "proto/limits.hpp"

namespace darm::client {
namespace {

glm::vec3 unpack_linear(std::uint32_t rgb) {
  const auto channel = [&](int shift) { return srgb_to_linear(static_cast<float>((rgb >> shift) & 255u) / 255.0f); };
  return {channel(16), channel(8), channel(0)};
}

template <class Range>
bool all_finite(const Range& values) {
  return std::all_of(values.begin(), values.end(), [](auto v) { return std::isfinite(v); });
}

const unsigned char* packed_bytes(const std::string& s) { return reinterpret_cast<const unsigned char*>(s.data()); }

// The meshopt buffer of `count` records in `packed`; empty: `packed` is damaged, too large or too short for them.
std::string unpack_records(const std::string& packed, std::uint64_t count, std::uint32_t stride) {
  const auto at_most = std::min(proto::most_packed_records(count, stride), proto::most_inflated(packed.size()));
  auto bytes = inflate(packed, at_most);
  return bytes && count <= proto::most_records(bytes->size(), stride) ? std::move(*bytes) : std::string();
}

// A vertex as it comes, before its numbers are taken off the grid.
struct GridVertex {
  std::array<std::int32_t, 3> position;
  std::array<std::int32_t, 2> uv;
  std::uint32_t local_patch;
};
static_assert(sizeof(GridVertex) == sizeof(Vertex) && sizeof(GridVertex) == proto::kVertexBytes);

Vertex off_grid(const GridVertex& v, float position_step, float uv_step) {
  const auto at = [](std::int32_t n, float step) { return static_cast<float>(n) * step; };
  return {{at(v.position[0], position_step), at(v.position[1], position_step), at(v.position[2], position_step)},
          {at(v.uv[0], uv_step), at(v.uv[1], uv_step)},
          v.local_patch};
}

bool decode_vertices(const wire::GeometryChunk& info, std::vector<Vertex>& out) {
  if (info.vertex_count() == 0) return true;
  const auto bytes = unpack_records(info.vertices(), info.vertex_count(), sizeof(GridVertex));
  if (bytes.empty()) return false;
  std::vector<GridVertex> grid(info.vertex_count());
  if (meshopt_decodeVertexBuffer(grid.data(), grid.size(), sizeof(GridVertex), packed_bytes(bytes), bytes.size()) != 0)
    return false;
  out.reserve(grid.size());
  for (const auto& v : grid) out.push_back(off_grid(v, info.position_step(), info.uv_step()));
  return true;
}

bool decode_indices(const wire::GeometryChunk& info, std::vector<std::uint32_t>& out) {
  if (info.index_count() == 0) return true;
  const auto at_most =
      std::min(proto::most_packed_indices(info.index_count()), proto::most_inflated(info.indices().size()));
  const auto bytes = inflate(info.indices(), at_most);
  // The codec spends at least one byte on a triangle.
  if (!bytes || info.index_count() / 3 > bytes->size()) return false;
  out.resize(info.index_count());
  return meshopt_decodeIndexBuffer(out.data(), out.size(), 4, packed_bytes(*bytes), bytes->size()) == 0;
}

}  // namespace

float srgb_to_linear(float encoded) {
  return encoded <= 0.04045f ? encoded / 12.92f : std::pow((encoded + 0.055f) / 1.055f, 2.4f);
}

float linear_to_srgb(float linear) {
  return linear <= 0.0031308f ? linear * 12.92f : 1.055f * std::pow(linear, 1.0f / 2.4f) - 0.055f;
}

Result<SceneModel> SceneModel::from_manifest(const wire::SceneManifest& manifest, const SceneLimits& limits) {
  SceneModel model;
  model.limits_ = limits;
  model.scene_hash_ = manifest.scene_hash();
  model.tag_ = manifest.tag();
  for (const auto step : {&SceneModel::read_levels, &SceneModel::read_patches, &SceneModel::read_coarse_coverage,
                          &SceneModel::read_instances, &SceneModel::read_surroundings}) {
    if (auto read = (model.*step)(manifest); !read) return std::unexpected(read.error());
  }
  if (manifest.geometry_chunks() > limits.max_chunks) return fail("manifest: too many geometry chunks");
  model.expected_chunks_ = manifest.geometry_chunks();
  model.chunk_seen_.assign(model.expected_chunks_, false);
  return model;
}

Result<void> SceneModel::read_levels(const wire::SceneManifest& manifest) {
  q_ = manifest.q();
  if (!(std::isfinite(q_) && q_ > 0)) return fail("manifest: q is not a positive number");
  const auto count = static_cast<std::uint32_t>(manifest.levels_size());
  if (count == 0 || count > kMaxLevels)
    return fail(fmt::format("manifest: {} levels, expected 1 to {}", count, kMaxLevels));
  std::uint64_t tiles = 0;
  for (const auto& info : manifest.levels()) {
    LevelShape level{info.density(), info.width(),   info.height(),
                     info.tiles_x(), info.tiles_y(), static_cast<std::uint32_t>(tiles)};
    if (!(std::isfinite(level.density) && level.density > 0)) return fail("manifest: level without a density");
    if (level.tiles_x == 0 || level.tiles_y == 0 || std::uint64_t{level.tiles_x} * kTileSize != level.width ||
        std::uint64_t{level.tiles_y} * kTileSize != level.height) {
      return fail("manifest: a level is not a whole number of tiles");
    }
    tiles += std::uint64_t{level.tiles_x} * level.tiles_y;
    if (tiles > proto::kMaxTableEntries) return fail(fmt::format("manifest: over {} tiles", proto::kMaxTableEntries));
    levels_.push_back(level);
  }
  tile_count_ = static_cast<std::uint32_t>(tiles);
  return {};
}

Result<void> SceneModel::read_patches(const wire::SceneManifest& manifest) {
  patch_count_ = manifest.patch_count();
  const std::uint64_t entries = std::uint64_t{patch_count_} * levels_.size();
  if (patch_count_ == 0 || entries > proto::kMaxTableEntries)
    return fail(fmt::format("manifest: {} patches refused", patch_count_));
  const auto packed = unpack_records(manifest.patch_table(), entries, sizeof(PatchPlace));
  if (packed.empty()) return fail("manifest: patch table does not fit the number of patches");
  places_.resize(entries);
  if (meshopt_decodeVertexBuffer(places_.data(), entries, sizeof(PatchPlace), packed_bytes(packed), packed.size()) !=
      0) {
    return fail("manifest: patch table does not decode");
  }
  for (std::size_t i = 0; i < places_.size(); ++i) {
    const auto& level = levels_[i / patch_count_];
    const auto& place = places_[i];
    if (place.x >= level.width || place.y >= level.height || !std::isfinite(place.scale) || place.scale < 0) {
      return fail("manifest: a patch lies outside its level");
    }
  }
  return {};
}

Result<void> SceneModel::read_coarse_coverage(const wire::SceneManifest& manifest) {
  const auto& packed = manifest.coarse_coverage();
  if (packed.empty()) return {};
  const std::uint64_t texels = std::uint64_t{levels_.back().width} * levels_.back().height;
  const auto most = std::min<std::uint64_t>(proto::kMaxCoarseTexels, proto::most_inflated(packed.size()));
  auto bytes = texels <= most ? inflate(packed, texels) : std::nullopt;
  if (!bytes || bytes->size() != texels) return fail("manifest: coverage of CoarseTex does not fit the last level");
  coarse_coverage_ = std::move(*bytes);
  return {};
}

Result<void> SceneModel::read_instances(const wire::SceneManifest& manifest) {
  if (static_cast<std::uint64_t>(manifest.instances_size()) > limits_.max_instances)
    return fail("manifest: too many instances");
  if (manifest.chart_count() > limits_.max_instances) return fail("manifest: too many charts");
  highest_base_.assign(manifest.chart_count(), 0);
  instances_.reserve(static_cast<std::size_t>(manifest.instances_size()));
  for (const auto& info : manifest.instances()) {
    InstanceShape instance;
    instance.chart = info.chart();
    if (instance.chart >= manifest.chart_count()) return fail("manifest: an instance names no chart");
    if (info.to_world_size() != 16 || !all_finite(info.to_world()))
      return fail("manifest: an instance has no finite matrix");
    for (int i = 0; i < 16; ++i) instance.to_world[i / 4][i % 4] = info.to_world(i);
    instance.front_base = info.front_base();
    instance.back_base = info.back_base();
    if (instance.front_base >= patch_count_ || (instance.back_base != kNoBase && instance.back_base >= patch_count_)) {
      return fail("manifest: an instance's patches are out of range");
    }
    instance.flipped = info.flipped();
    if (info.alpha_mode() > 2) return fail("manifest: unknown alpha mode");
    instance.alpha_mode = static_cast<AlphaMode>(info.alpha_mode());
    has_alpha_ = has_alpha_ || instance.alpha_mode != AlphaMode::kOpaque;
    if (!std::isfinite(info.alpha_cutoff()) || !std::isfinite(info.transmission()) || !std::isfinite(info.f0()))
      return fail("manifest: NaN in an instance");
    instance.alpha_cutoff = info.alpha_cutoff();
    instance.transmission = std::clamp(info.transmission(), 0.0f, 1.0f);
    instance.tint = unpack_linear(info.tint_rgb());
    instance.f0 = std::clamp(info.f0(), 0.0f, 1.0f);
    has_clear_ = has_clear_ || instance.transmission > 0;
    instance.camera_sees_back = info.camera_sees_back();
    auto& highest = highest_base_[instance.chart];
    highest = std::max(highest, instance.front_base);
    if (instance.back_base != kNoBase) highest = std::max(highest, instance.back_base);
    instances_.push_back(instance);
  }
  return {};
}

Result<void> SceneModel::read_surroundings(const wire::SceneManifest& manifest) {
  origin_ = {manifest.origin().x(), manifest.origin().y(), manifest.origin().z()};
  if (!std::isfinite(origin_.x + origin_.y + origin_.z)) return fail("manifest: origin is not finite");
  if (manifest.bounds_size() != 6 || !all_finite(manifest.bounds()))
    return fail("manifest: bounds are not six finite numbers");
  low_ = {manifest.bounds(0), manifest.bounds(1), manifest.bounds(2)};
  high_ = {manifest.bounds(3), manifest.bounds(4), manifest.bounds(5)};
  if (manifest.sky_size() != 9 || !all_finite(manifest.sky()))
    return fail("manifest: the sky is not nine finite numbers");
  const auto sky = [&](int at) {
    return glm::max(glm::vec3(manifest.sky(at), manifest.sky(at + 1), manifest.sky(at + 2)), glm::vec3(0.0f));
  };
  background_.zenith = sky(0);
  background_.horizon = sky(3);
  background_.ground = sky(6);
  if (manifest.sun_size() == 0) return {};
  if (manifest.sun_size() != 7 || !all_finite(manifest.sun()))
    return fail("manifest: the sun is not seven finite numbers");
  const glm::vec3 direction(manifest.sun(0), manifest.sun(1), manifest.sun(2));
  if (glm::length(direction) < 1e-6f) return fail("manifest: the sun has no direction");
  background_.has_sun = true;
  background_.sun_direction = glm::normalize(direction);
  background_.sun_cos = manifest.sun(3);
  background_.sun_rgb = glm::max(glm::vec3(manifest.sun(4), manifest.sun(5), manifest.sun(6)), glm::vec3(0.0f));
  return {};
}

Result<Chunk> SceneModel::read_chunk(const wire::GeometryChunk& info) {
  const auto refuse = [&](const char* what) { return fail(fmt::format("geometry chunk {}: {}", info.index(), what)); };
  if (info.index() >= expected_chunks_) return refuse("index is out of range");
  if (chunk_seen_[info.index()]) return refuse("came twice");
  if (info.chart() >= highest_base_.size()) return refuse("names no chart");
  if (info.vertex_count() > limits_.max_chunk_vertices) return refuse("too many vertices");
  if (info.index_count() % 3 != 0 || info.index_count() > limits_.max_chunk_indices)
    return refuse("wrong number of indices");
  if (!(std::isfinite(info.position_step()) && std::isfinite(info.uv_step()))) return refuse("a step is not finite");
  const std::uint64_t bytes =
      std::uint64_t{info.vertex_count()} * sizeof(Vertex) + std::uint64_t{info.index_count()} * 4;
  if (geometry_bytes_ + bytes > limits_.max_geometry_bytes) return refuse("geometry is over the limit");

  Chunk chunk;
  chunk.chart = info.chart();
  chunk.index = info.index();
  if (!decode_vertices(info, chunk.vertices)) return refuse("vertices do not decode");
  if (!decode_indices(info, chunk.indices)) return refuse("indices do not decode");
  const std::uint32_t patches_left = patch_count_ - highest_base_[info.chart()];
  glm::vec3 low(INFINITY), high(-INFINITY);
  for (const auto& v : chunk.vertices) {
    if (!all_finite(v.position) || !all_finite(v.uv)) return refuse("a vertex is not finite");
    if (v.local_patch >= patches_left) return refuse("a patch is out of range");
    const glm::vec3 p(v.position[0], v.position[1], v.position[2]);
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  for (const auto i : chunk.indices) {
    if (i >= info.vertex_count()) return refuse("an index is out of range");
  }
  if (!chunk.vertices.empty()) {
    chunk.low = low;
    chunk.high = high;
  }
  geometry_bytes_ += bytes;
  chunk_seen_[info.index()] = true;
  ++chunks_read_;
  return chunk;
}

void SceneModel::keep_chunk(Chunk chunk) {
  triangles_ += chunk.indices.size() / 3;
  chunks_.push_back(std::move(chunk));
}

Result<void> SceneModel::add_chunk(const wire::GeometryChunk& info) {
  auto chunk = read_chunk(info);
  if (!chunk) return std::unexpected(chunk.error());
  keep_chunk(std::move(*chunk));
  return {};
}

bool SceneModel::page_entry(std::uint32_t tile, std::uint32_t& entry) const {
  const std::uint32_t level = tile >> 28;
  const std::uint32_t index = tile & 0x0fffffffu;
  if (level >= levels_.size() || index >= levels_[level].tiles_x * levels_[level].tiles_y) return false;
  entry = levels_[level].first_tile + index;
  return true;
}

}  // namespace darm::client

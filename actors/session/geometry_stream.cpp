#include "actors/session/geometry_stream.hpp"

#include <xxhash.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cmath>
#include <filesystem>
#include <functional>
#include <glm/common.hpp>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <thread>
#include <tuple>

#include "actors/scene/view_materials.hpp"
#include "actors/session/chart_geometry.hpp"
#include "actors/session/deflate.hpp"
#include "proto/darm.pb.h"
#include "proto/framing.hpp"
#include "proto/limits.hpp"

namespace darm::session {
namespace {

// Runs work(0) .. work(count - 1) on `threads` threads, this one included; they end before it returns.
void parallel(std::size_t count, unsigned threads, const std::function<void(std::size_t)>& work) {
  std::atomic<std::size_t> next{0};
  const auto loop = [&] {
    for (std::size_t i = next++; i < count; i = next++) work(i);
  };
  std::vector<std::jthread> others;
  for (unsigned t = 1; t < threads && t < count; ++t) others.emplace_back(loop);
  loop();
}

std::uint32_t to_srgb8(float linear) {
  const float v = std::clamp(linear, 0.0f, 1.0f);
  const float s = v <= 0.0031308f ? v * 12.92f : 1.055f * std::pow(v, 1.0f / 2.4f) - 0.055f;
  return static_cast<std::uint32_t>(std::lround(s * 255.0f));
}

std::uint32_t pack_srgb(const glm::vec3& linear) {
  return (to_srgb8(linear.x) << 16) | (to_srgb8(linear.y) << 8) | to_srgb8(linear.z);
}

SharedBytes framed(const wire::Envelope& envelope) { return std::make_shared<const Bytes>(proto::frame(envelope)); }

void put_levels(const atlas::Layout& layout, wire::SceneManifest& m) {
  struct Entry {
    std::uint32_t x, y;
    float scale;
  };
  static_assert(sizeof(Entry) == proto::kPatchEntryBytes);
  std::vector<Entry> table;
  table.reserve(std::size_t{layout.patch_count} * layout.levels.size());
  for (const auto& level : layout.levels) {
    auto* info = m.add_levels();
    info->set_density(level.density);
    info->set_width(level.width);
    info->set_height(level.height);
    info->set_tiles_x(level.tiles_x);
    info->set_tiles_y(level.tiles_y);
    for (const auto& p : level.placements) table.push_back({p.x, p.y, p.scale});
  }
  m.set_patch_count(layout.patch_count);
  const auto packed = deflate(encode_vertices(table.data(), table.size(), sizeof(Entry)), Effort::kOnceAScene);
  m.set_patch_table(packed.data(), packed.size());
}

void put_instances(const scene::Scene& scene, const atlas::Layout& layout, wire::SceneManifest& m) {
  const auto view = scene::view_materials(scene);
  for (std::size_t i = 0; i < scene.instances.size(); ++i) {
    const auto& instance = scene.instances[i];
    const auto& charts = layout.instances[i];
    const auto& material = scene.materials[scene.meshes[instance.mesh].material];
    auto* info = m.add_instances();
    info->set_chart(charts.chart);
    for (int c = 0; c < 4; ++c) {
      for (int r = 0; r < 4; ++r) info->add_to_world(instance.to_world[c][r]);
    }
    info->set_front_base(charts.front_base);
    info->set_back_base(charts.back_base);
    info->set_flipped(instance.flipped);
    info->set_alpha_mode(static_cast<std::uint32_t>(material.alpha_mode));
    // Coverage is the share of a texel that passes the material's own cutoff: half of it is where the edge runs.
    info->set_alpha_cutoff(0.5f);
    // Where no private tile says it point by point, all of the surface passes what it does in the mean.
    const glm::vec3 passage = scene::mean_passage(scene, material);
    const float most = std::max({passage.x, passage.y, passage.z});
    info->set_transmission(most);
    info->set_tint_rgb(pack_srgb(most > 0 ? passage / most : glm::vec3(1.0f)));
    // Own light is not dimmed by Fresnel's term; what glows and is glossy too keeps the average.
    const float ratio = (material.ior - 1.0f) / (material.ior + 1.0f);
    if (view[i].weight > 0 && !material.emits()) info->set_f0(ratio * ratio);
    info->set_object(instance.object);
    info->set_dynamic(instance.object < scene.objects.size() && scene.objects[instance.object].dynamic);
    info->set_camera_sees_back(material.double_sided);
  }
}

void put_surroundings(const scene::Scene& scene, float exposure, wire::SceneManifest& m) {
  constexpr float kMost = 1e30f;  // a product of two large numbers stays one
  for (const glm::vec3& light : {scene.sky.zenith, scene.sky.horizon, scene.sky.ground})
    for (int c = 0; c < 3; ++c) m.add_sky(std::clamp(light[c] * exposure, 0.0f, kMost));
  for (const auto& light : scene.lights) {
    if (light.kind != scene::LightKind::kDirectional || !(light.angular_diameter > 0)) continue;
    // The disc's radiance is its irradiance over its projected solid angle, pi sin^2 of the angular radius.
    const float sine = std::sin(light.angular_diameter * 0.5f);
    const glm::vec3 radiance = light.intensity / (3.14159265f * std::max(sine * sine, 1e-12f)) * exposure;
    for (int c = 0; c < 3; ++c) m.add_sun(-light.direction[c]);
    m.add_sun(std::cos(light.angular_diameter * 0.5f));
    for (int c = 0; c < 3; ++c) m.add_sun(radiance[c]);
    break;
  }
}

// The most that a length grows.
float stretch_of(const glm::mat4& m) {
  return std::max({glm::length(glm::vec3(m[0])), glm::length(glm::vec3(m[1])), glm::length(glm::vec3(m[2]))});
}

struct Piece {
  std::uint32_t chart;
  std::size_t first, count;  // of the chart's triangles in order
};

// Equal pieces of each chart, so that the last one is not a crumb.
std::vector<Piece> pieces_of(const std::vector<std::vector<std::uint32_t>>& order) {
  constexpr std::size_t kMost = GeometryStream::kTrianglesPerChunk;
  std::vector<Piece> pieces;
  for (std::uint32_t c = 0; c < order.size(); ++c) {
    const std::size_t parts = (order[c].size() + kMost - 1) / kMost;
    for (std::size_t p = 0; p < parts; ++p) {
      const auto first = order[c].size() * p / parts;
      pieces.push_back({c, first, order[c].size() * (p + 1) / parts - first});
    }
  }
  return pieces;
}

SharedBytes chunk_message(const ChunkGeometry& g, const GridSteps& steps, std::uint32_t chart, std::uint32_t index) {
  wire::Envelope envelope;
  auto* chunk = envelope.mutable_geometry();
  chunk->set_chart(chart);
  chunk->set_index(index);
  chunk->set_vertex_count(g.vertex_count);
  chunk->set_index_count(g.index_count);
  const auto vertices = deflate(g.vertices, Effort::kOnceAScene);
  const auto indices = deflate(g.indices, Effort::kOnceAScene);
  chunk->set_vertices(vertices.data(), vertices.size());
  chunk->set_indices(indices.data(), indices.size());
  chunk->set_position_step(steps.position);
  chunk->set_uv_step(steps.uv);
  return framed(envelope);
}

// Outward normals of what a picture shows: its four sides and the plane of the eye, all through the eye.
std::array<glm::vec3, 5> view_planes(const Camera& camera, const Viewport& viewport) {
  const float half = camera.fovy * 0.5f;
  const float wide =
      std::atan(std::tan(half) * static_cast<float>(viewport.width) / static_cast<float>(viewport.height));
  std::array<glm::vec3, 5> planes = {{{std::cos(wide), 0, std::sin(wide)},
                                      {-std::cos(wide), 0, std::sin(wide)},
                                      {0, std::cos(half), std::sin(half)},
                                      {0, -std::cos(half), std::sin(half)},
                                      {0, 0, 1}}};
  for (auto& p : planes) p = camera.orientation * p;
  return planes;
}

// Of all bytes a client is sent before the first picture.
std::uint64_t tag_of(const GeometryStream& stream) {
  std::uint64_t tag = XXH3_64bits(stream.manifest()->data(), stream.manifest()->size());
  for (std::uint32_t c = 0; c < stream.chunk_count(); ++c)
    tag = XXH3_64bits_withSeed(stream.chunk(c)->data(), stream.chunk(c)->size(), tag);
  return std::max<std::uint64_t>(tag, 1);
}

// What no client would take is said here, to the one who can do something about it.
Result<void> check_tables(const scene::Scene& scene, const atlas::Layout& layout) {
  const std::uint64_t places = std::uint64_t{layout.patch_count} * layout.levels.size();
  std::uint64_t tiles = 0;
  for (const auto& l : layout.levels) tiles += std::uint64_t{l.tiles_x} * l.tiles_y;
  if (places > proto::kMaxTableEntries)
    return fail("geometry: " + std::to_string(layout.patch_count) + " patches on " +
                std::to_string(layout.levels.size()) + " levels are more than the " +
                std::to_string(proto::kMaxTableEntries) +
                " places that clients take; a smaller q has fewer levels, a scene of larger connected surfaces fewer "
                "patches");
  if (tiles > proto::kMaxTableEntries)
    return fail("geometry: " + std::to_string(tiles) + " tiles are more than the " +
                std::to_string(proto::kMaxTableEntries) + " that clients take; a smaller q has fewer");
  if (scene.instances.size() > proto::kMaxInstances)
    return fail("geometry: " + std::to_string(scene.instances.size()) + " instances are more than the " +
                std::to_string(proto::kMaxInstances) + " that clients take; join some of them");
  return {};
}

Result<void> check(const scene::Scene& scene, const atlas::Layout& layout, float exposure) {
  if (!(std::isfinite(exposure) && exposure > 0)) return fail("geometry: exposure must be finite and above 0");
  if (layout.instances.size() != scene.instances.size()) {
    return fail("geometry: the layout was made for another scene");
  }
  for (const auto& i : layout.instances) {
    if (i.chart >= layout.charts.size()) return fail("geometry: the layout names a chart it does not have");
  }
  for (const auto& c : layout.charts) {
    if (c.mesh >= scene.meshes.size() || c.local_patch.size() != scene.meshes[c.mesh].triangles.size() ||
        c.uv.size() != c.local_patch.size()) {
      return fail("geometry: a chart does not fit its mesh");
    }
  }
  for (const auto& l : layout.levels) {
    if (l.placements.size() != layout.patch_count) return fail("geometry: a level does not place every patch");
  }
  return check_tables(scene, layout);
}

}  // namespace

GeometryStream::Box GeometryStream::box_of(const ChunkGeometry& g, const glm::mat4& to_world) {
  const glm::vec3 center = (g.bounds_min + g.bounds_max) * 0.5f;
  const glm::vec3 half = (g.bounds_max - g.bounds_min) * 0.5f;
  return {glm::vec3(to_world * glm::vec4(center, 1.0f)),
          {glm::vec3(to_world[0]) * half.x, glm::vec3(to_world[1]) * half.y, glm::vec3(to_world[2]) * half.z},
          glm::length(half) * stretch_of(to_world)};
}

Result<std::shared_ptr<const GeometryStream>> GeometryStream::build(const scene::Scene& scene,
                                                                    const atlas::Layout& layout, float exposure,
                                                                    unsigned threads,
                                                                    std::span<const std::uint8_t> coarse_coverage) {
  if (auto ok = check(scene, layout, exposure); !ok) return std::unexpected(ok.error());
  auto stream = std::make_shared<GeometryStream>();
  stream->origin_ = scene.origin;
  std::vector<std::vector<std::uint32_t>> instances_of(layout.charts.size());
  for (std::uint32_t i = 0; i < layout.instances.size(); ++i) instances_of[layout.instances[i].chart].push_back(i);

  // Triangles of each chart in order, and the grids their numbers are rounded to.
  std::vector<std::vector<std::uint32_t>> order(layout.charts.size());
  std::vector<GridSteps> steps(layout.charts.size());
  const float diagonal = std::max(glm::length(scene.bounds_max - scene.bounds_min), 1e-20f);
  parallel(order.size(), threads, [&](std::size_t c) {
    const auto& chart = layout.charts[c];
    float stretch = 0;
    for (const auto i : instances_of[c]) stretch = std::max(stretch, stretch_of(scene.instances[i].to_world));
    order[c] = coherent_triangles(scene.meshes[chart.mesh], chart);
    steps[c] = grid_steps(scene.meshes[chart.mesh], chart, stretch, layout.q, diagonal);
  });
  const auto pieces = pieces_of(order);
  stream->chunks_.resize(pieces.size());
  parallel(pieces.size(), threads, [&](std::size_t p) {
    const auto& [c, first, count] = pieces[p];
    const auto& chart = layout.charts[c];
    const auto g = encode_chunk(scene.meshes[chart.mesh], chart, steps[c], order[c], first, count);
    stream->chunks_[p].bytes = chunk_message(g, steps[c], c, static_cast<std::uint32_t>(p));
    for (const auto i : instances_of[c]) stream->chunks_[p].placed.push_back(box_of(g, scene.instances[i].to_world));
  });

  wire::Envelope envelope;
  auto& m = *envelope.mutable_manifest();
  m.set_scene_hash(scene.hash);
  m.mutable_origin()->set_x(scene.origin.x);
  m.mutable_origin()->set_y(scene.origin.y);
  m.mutable_origin()->set_z(scene.origin.z);
  for (const auto& corner : {scene.bounds_min, scene.bounds_max}) {
    for (int c = 0; c < 3; ++c) m.add_bounds(corner[c]);
  }
  m.set_q(layout.q);
  put_levels(layout, m);
  if (!coarse_coverage.empty()) {
    const auto packed = deflate(coarse_coverage, Effort::kOnceAScene);
    m.set_coarse_coverage(packed.data(), packed.size());
  }
  put_instances(scene, layout, m);
  m.set_chart_count(static_cast<std::uint32_t>(layout.charts.size()));
  m.set_geometry_chunks(static_cast<std::uint32_t>(pieces.size()));
  put_surroundings(scene, exposure, m);
  m.set_exposure(exposure);
  m.set_name(std::filesystem::path(scene.path).stem().string());
  m.set_triangles(scene.triangle_count());
  stream->manifest_ = framed(envelope);
  stream->tag_ = tag_of(*stream);
  m.set_tag(stream->tag_);
  stream->manifest_ = framed(envelope);
  if (stream->manifest_->size() > proto::kMaxServerEnvelope) return fail("geometry: the manifest is over 512 MiB");
  return std::shared_ptr<const GeometryStream>(std::move(stream));
}

GeometryStream::Order GeometryStream::order_for(const Camera& camera, const Viewport& viewport) const {
  const glm::vec3 eye(camera.position - origin_);
  const auto planes = view_planes(camera, viewport);
  const auto seen = [&](const Box& box) {
    return std::none_of(planes.begin(), planes.end(), [&](const glm::vec3& normal) {
      const glm::vec3 reach = glm::abs(glm::transpose(box.half) * normal);
      return glm::dot(box.center - eye, normal) > (reach.x + reach.y + reach.z) * 1.001f;
    });
  };
  std::vector<std::tuple<bool, float, std::uint32_t>> keyed;  // out of view, distance, chunk
  keyed.reserve(chunks_.size());
  for (std::uint32_t c = 0; c < chunks_.size(); ++c) {
    float nearest = INFINITY;
    bool in_view = false;
    for (const auto& box : chunks_[c].placed) {
      nearest = std::min(nearest, std::max(0.0f, glm::distance(box.center, eye) - box.radius));
      in_view = in_view || seen(box);
    }
    keyed.emplace_back(!in_view, nearest, c);
  }
  std::sort(keyed.begin(), keyed.end());
  Order order;
  for (const auto& [hidden, distance, chunk] : keyed) {
    order.in_view += hidden ? 0 : 1;
    order.chunks.push_back(chunk);
  }
  return order;
}

std::size_t GeometryStream::total_bytes() const {
  std::size_t bytes = manifest_->size();
  for (const auto& c : chunks_) bytes += c.bytes->size();
  return bytes;
}

}  // namespace darm::session

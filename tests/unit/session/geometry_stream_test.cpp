#include "actors/session/geometry_stream.hpp"

#include <gtest/gtest.h>
#include <meshoptimizer.h>
#include <zlib.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <glm/gtc/matrix_transform.hpp>
#include <random>
#include <set>

#include "actors/session/chart_geometry.hpp"
#include "proto/darm.pb.h"
#include "proto/limits.hpp"
#include "tests/unit/session/small_scene.hpp"

namespace darm::session {
namespace {

struct Vertex {
  float position[3];
  float uv[2];
  std::uint32_t patch;
};

struct GridVertex {
  std::int32_t position[3];
  std::int32_t uv[2];
  std::uint32_t patch;
};

std::string inflate(const std::string& packed) {
  std::string out(16u << 20, '\0');
  uLongf size = out.size();
  EXPECT_EQ(uncompress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(packed.data()),
                       packed.size()),
            Z_OK);
  out.resize(size);
  return out;
}

template <class T>
std::vector<T> records_of(const std::string& packed, std::size_t count) {
  std::vector<T> out(count);
  const auto bytes = inflate(packed);
  EXPECT_LE(bytes.size(), proto::most_packed_records(count, sizeof(T)));
  EXPECT_LE(count, proto::most_records(bytes.size(), sizeof(T)));
  EXPECT_EQ(meshopt_decodeVertexBuffer(out.data(), count, sizeof(T),
                                       reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()),
            0);
  return out;
}

std::vector<Vertex> vertices_of(const wire::GeometryChunk& g) {
  std::vector<Vertex> out;
  for (const auto& v : records_of<GridVertex>(g.vertices(), g.vertex_count())) {
    Vertex back{{}, {}, v.patch};
    for (int c = 0; c < 3; ++c) back.position[c] = static_cast<float>(v.position[c]) * g.position_step();
    for (int c = 0; c < 2; ++c) back.uv[c] = static_cast<float>(v.uv[c]) * g.uv_step();
    out.push_back(back);
  }
  return out;
}

std::vector<std::uint32_t> indices_of(const wire::GeometryChunk& g) {
  std::vector<std::uint32_t> out(g.index_count());
  const auto bytes = inflate(g.indices());
  EXPECT_LE(bytes.size(), proto::most_packed_indices(out.size()));
  EXPECT_EQ(meshopt_decodeIndexBuffer(out.data(), out.size(), 4, reinterpret_cast<const unsigned char*>(bytes.data()),
                                      bytes.size()),
            0);
  return out;
}

wire::Envelope parse(const SharedBytes& bytes) {
  wire::Envelope e;
  EXPECT_TRUE(e.ParseFromArray(bytes->data() + 4, static_cast<int>(bytes->size() - 4)));
  return e;
}

// A triangle as its corners, rotated so that the smallest comes first: winding kept, starting corner not.
using Corner = std::array<float, 6>;
using Triangle = std::array<Corner, 3>;
Triangle canonical(Triangle t) {
  std::rotate(t.begin(), std::min_element(t.begin(), t.end()), t.end());
  return t;
}

std::multiset<Triangle> triangles_of(const GeometryStream& stream) {
  std::multiset<Triangle> all;
  for (std::uint32_t c = 0; c < stream.chunk_count(); ++c) {
    const auto e = parse(stream.chunk(c));
    const auto& g = e.geometry();
    EXPECT_EQ(g.index(), c);
    EXPECT_LE(g.vertex_count(), proto::kMaxChunkVertices);
    EXPECT_LE(g.index_count(), proto::kMaxChunkIndices);
    const auto vertices = vertices_of(g);
    const auto indices = indices_of(g);
    for (std::size_t i = 0; i < indices.size(); i += 3) {
      Triangle t;
      for (std::size_t k = 0; k < 3; ++k) {
        const auto& v = vertices.at(indices[i + k]);
        t[k] = {v.position[0], v.position[1], v.position[2], v.uv[0], v.uv[1], float(v.patch)};
      }
      all.insert(canonical(t));
    }
  }
  return all;
}

TEST(GeometryStream, gives_back_every_triangle_that_has_texels) {
  const auto [scene, layout] = testing::grid(100);
  std::multiset<Triangle> want;
  for (std::size_t t = 0; t < scene.meshes[0].triangles.size(); ++t) {
    if (layout.charts[0].local_patch[t] == atlas::kDroppedTriangle) continue;
    Triangle triangle;
    for (int k = 0; k < 3; ++k) {
      const auto& p = scene.meshes[0].positions[scene.meshes[0].triangles[t][k]];
      const auto& uv = layout.charts[0].uv[t][std::size_t(k)];
      triangle[std::size_t(k)] = {p.x, p.y, p.z, uv.x, uv.y, float(layout.charts[0].local_patch[t])};
    }
    want.insert(canonical(triangle));
  }
  const auto stream = GeometryStream::build(scene, layout, 1.0f, 2).value();
  EXPECT_GT(stream->chunk_count(), 1u);
  EXPECT_EQ(triangles_of(*stream), want);
}

TEST(GeometryStream, is_the_same_for_any_number_of_threads) {
  const auto [scene, layout] = testing::grid(100);
  const auto one = GeometryStream::build(scene, layout, 1.0f, 1).value();
  const auto four = GeometryStream::build(scene, layout, 1.0f, 4).value();
  ASSERT_EQ(one->chunk_count(), four->chunk_count());
  EXPECT_EQ(*one->manifest(), *four->manifest());
  for (std::uint32_t c = 0; c < one->chunk_count(); ++c) EXPECT_EQ(*one->chunk(c), *four->chunk(c));
}

// A mesh of triangles anywhere, as a scene of its own at q = 64, with uv to match.
std::pair<scene::Scene, atlas::Layout> scattered(float scale) {
  auto [scene, layout] = testing::grid(30);
  std::mt19937 random(11);
  std::uniform_real_distribution<float> place(-15.0f, 15.0f);
  for (auto& p : scene.meshes[0].positions) p = glm::vec3(place(random), place(random), place(random)) / scale;
  for (auto& triangle : layout.charts[0].uv)
    for (auto& uv : triangle) uv = glm::vec2(place(random), place(random)) * 0.2f;
  scene.instances.resize(1);
  layout.instances.resize(1);
  scene.instances[0].to_world = glm::scale(glm::mat4(1.0f), glm::vec3(scale));
  scene.bounds_min = glm::vec3(-15.0f);
  scene.bounds_max = glm::vec3(15.0f);
  layout.q = 64;
  return {scene, layout};
}

TEST(GeometryStream, rounding_moves_nothing_by_more_than_it_promises) {
  for (const float scale : {1.0f, 0.01f, 37.0f}) {
    const auto [scene, layout] = scattered(scale);
    const auto stream = GeometryStream::build(scene, layout, 1.0f, 1).value();
    const auto e = parse(stream->chunk(0));
    const auto vertices = vertices_of(e.geometry());
    const auto order = coherent_triangles(scene.meshes[0], layout.charts[0]);
    float worst = 0, worst_uv = 0;
    for (const auto& v : vertices) {
      float nearest = INFINITY, nearest_uv = INFINITY;
      for (const auto t : order) {
        for (int k = 0; k < 3; ++k) {
          const auto& p = scene.meshes[0].positions[scene.meshes[0].triangles[t][k]];
          const auto& uv = layout.charts[0].uv[t][std::size_t(k)];
          const float off = scale * std::max({std::abs(p.x - v.position[0]), std::abs(p.y - v.position[1]),
                                              std::abs(p.z - v.position[2])});
          const float off_uv = std::max(std::abs(uv.x - v.uv[0]), std::abs(uv.y - v.uv[1]));
          if (off_uv < nearest_uv) nearest = off, nearest_uv = off_uv;
        }
      }
      worst = std::max(worst, nearest);
      worst_uv = std::max(worst_uv, nearest_uv);
    }
    const float texel = 1.0f / 64.0f;
    EXPECT_LE(worst, texel / 256.0f) << scale;
    EXPECT_LE(worst, 30.0f * std::sqrt(3.0f) / 524288.0f) << scale;
    EXPECT_LE(worst_uv, texel / 128.0f) << scale;
    EXPECT_GT(worst, texel / 2048.0f) << "it is rounded at all";
  }
}

bool shows(const Camera& camera, const Viewport& viewport, const glm::vec3& from_eye) {
  const glm::vec3 p = glm::conjugate(camera.orientation) * from_eye;
  const float tall = std::tan(camera.fovy / 2);
  const float wide = tall * static_cast<float>(viewport.width) / static_cast<float>(viewport.height);
  return p.z < 0 && std::abs(p.x) <= -p.z * wide && std::abs(p.y) <= -p.z * tall;
}

TEST(GeometryStream, sends_what_is_in_view_first_and_of_that_the_nearest) {
  const auto [scene, layout] = testing::grid(256);
  const auto stream = GeometryStream::build(scene, layout, 1.0f, 1).value();
  std::vector<std::vector<Vertex>> chunks;
  for (std::uint32_t c = 0; c < stream->chunk_count(); ++c)
    chunks.push_back(vertices_of(parse(stream->chunk(c)).geometry()));
  const auto distance = [&](std::uint32_t chunk, const glm::vec3& eye) {
    float best = INFINITY;
    for (const auto& p : chunks[chunk]) best = std::min(best, std::hypot(p.position[0] - eye.x, p.position[2] - eye.z));
    return best;
  };
  const Viewport viewport{640, 360};
  const glm::dvec3 corner(256, 2, 256);
  const auto inwards = look_at(corner + scene.origin, scene.origin + glm::dvec3(255, 2, 255), 20.0);
  const auto order = stream->order_for(inwards, viewport);
  ASSERT_EQ(order.chunks.size(), stream->chunk_count());
  EXPECT_EQ(std::set(order.chunks.begin(), order.chunks.end()).size(), order.chunks.size());
  EXPECT_GT(order.in_view, 0u);
  EXPECT_LT(order.in_view, stream->chunk_count());
  EXPECT_EQ(distance(order.chunks.front(), corner), 0.0f);
  EXPECT_GT(distance(order.chunks[order.in_view - 1], corner), 100.0f);
  for (std::uint32_t i = order.in_view; i < order.chunks.size(); ++i) {
    for (const auto& v : chunks[order.chunks[i]]) {
      const glm::vec3 p(v.position[0], v.position[1], v.position[2]);
      ASSERT_FALSE(shows(inwards, viewport, p - glm::vec3(corner))) << "chunk " << order.chunks[i];
    }
  }
  // The second instance stands at x = 1000: from there the same chunks are in view and near.
  const auto there = look_at(scene.origin + glm::dvec3(1256, 2, 256), scene.origin + glm::dvec3(1255, 2, 255), 20.0);
  const auto beside = stream->order_for(there, viewport);
  for (std::uint32_t i = 0; i < order.in_view; ++i)
    EXPECT_NE(std::find(beside.chunks.begin(), beside.chunks.begin() + beside.in_view, order.chunks[i]),
              beside.chunks.begin() + beside.in_view);
  const auto away = look_at(corner + scene.origin, scene.origin + glm::dvec3(256, 900, 256), 40.0);
  EXPECT_EQ(stream->order_for(away, viewport).in_view, 0u);
}

TEST(GeometryStream, the_manifest_describes_levels_patches_instances_and_sky) {
  auto [scene, layout] = testing::grid(4);
  scene.sky.zenith = glm::vec3(0.5f);
  scene.lights.emplace_back();
  scene.lights[0].kind = scene::LightKind::kDirectional;
  scene.lights[0].direction = {0, -1, 0};
  scene.lights[0].angular_diameter = 0.01f;
  scene.materials[0].alpha_mode = scene::AlphaMode::kMask;
  scene.materials[0].double_sided = true;
  const std::vector<std::uint8_t> coverage(1000, 7);
  const auto e = parse(GeometryStream::build(scene, layout, 2.0f, 1, coverage).value()->manifest());
  const auto& m = e.manifest();
  EXPECT_EQ(inflate(m.coarse_coverage()), std::string(1000, '\7'));
  EXPECT_EQ(m.scene_hash(), 42u);
  EXPECT_EQ(m.name(), "grid");
  EXPECT_DOUBLE_EQ(m.origin().y(), 6);
  EXPECT_EQ(m.patch_count(), 8u);
  ASSERT_EQ(m.levels_size(), 2);
  struct Entry {
    std::uint32_t x, y;
    float scale;
  };
  const auto table = records_of<Entry>(m.patch_table(), 16);
  EXPECT_EQ(table[3].y, 6u);
  EXPECT_EQ(table[8 + 3].x, 3u);
  EXPECT_FLOAT_EQ(table[8].scale, 0.5f);
  ASSERT_EQ(m.instances_size(), 2);
  EXPECT_EQ(m.instances(1).to_world(12), 1000.0f);
  EXPECT_EQ(m.instances(1).front_base(), 4u);
  EXPECT_EQ(m.instances(1).back_base(), 0xffffffffu);
  EXPECT_EQ(m.instances(0).alpha_mode(), 1u);
  EXPECT_EQ(m.instances(0).alpha_cutoff(), 0.5f) << "coverage is the share that passes the material's own";
  EXPECT_TRUE(m.instances(0).camera_sees_back());
  EXPECT_TRUE(m.instances(0).dynamic());
  ASSERT_EQ(m.sky_size(), 9);
  EXPECT_EQ(m.sky(0), 1.0f);  // 0.5 nits at exposure 2 is white
  EXPECT_EQ(m.sky(8), 0.0f);
  ASSERT_EQ(m.sun_size(), 7);
  EXPECT_FLOAT_EQ(m.sun(1), 1.0f);
}

TEST(GeometryStream, refuses_a_layout_of_another_scene) {
  auto [scene, layout] = testing::grid(4);
  EXPECT_FALSE(GeometryStream::build(scene, layout, 0.0f, 1).has_value());
  layout.instances.pop_back();
  EXPECT_FALSE(GeometryStream::build(scene, layout, 1.0f, 1).has_value());
}

// Otherwise every client would refuse it, and whoever serves it would hear of it from them.
TEST(GeometryStream, refuses_more_patches_than_clients_take) {
  auto [scene, layout] = testing::grid(4);
  layout.patch_count = proto::kMaxTableEntries / static_cast<std::uint32_t>(layout.levels.size()) + 1;
  for (auto& level : layout.levels) level.placements.resize(layout.patch_count);
  const auto stream = GeometryStream::build(scene, layout, 1.0f, 1);
  ASSERT_FALSE(stream.has_value());
  EXPECT_NE(stream.error().message.find("a smaller q has fewer levels"), std::string::npos) << stream.error().message;
}

}  // namespace
}  // namespace darm::session

#include "actors/session/geometry_stream.hpp"

#include <gtest/gtest.h>
#include <meshoptimizer.h>

#include <algorithm>
#include <array>
#include <set>

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
    std::vector<Vertex> vertices(g.vertex_count());
    std::vector<std::uint32_t> indices(g.index_count());
    EXPECT_EQ(
        meshopt_decodeVertexBuffer(vertices.data(), vertices.size(), sizeof(Vertex),
                                   reinterpret_cast<const unsigned char*>(g.vertices().data()), g.vertices().size()),
        0);
    EXPECT_EQ(meshopt_decodeIndexBuffer(indices.data(), indices.size(), 4,
                                        reinterpret_cast<const unsigned char*>(g.indices().data()), g.indices().size()),
              0);
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

TEST(GeometryStream, sends_what_is_near_first) {
  const auto [scene, layout] = testing::grid(128);
  const auto stream = GeometryStream::build(scene, layout, 1.0f, 1).value();
  const auto nearest_corner = [&](std::uint32_t chunk, glm::vec3 eye) {
    const auto e = parse(stream->chunk(chunk));
    std::vector<Vertex> v(e.geometry().vertex_count());
    EXPECT_EQ(meshopt_decodeVertexBuffer(v.data(), v.size(), sizeof(Vertex),
                                         reinterpret_cast<const unsigned char*>(e.geometry().vertices().data()),
                                         e.geometry().vertices().size()),
              0);
    float best = INFINITY;
    for (const auto& p : v) best = std::min(best, std::hypot(p.position[0] - eye.x, p.position[2] - eye.z));
    return best;
  };
  const glm::vec3 corner(128, 0, 128);
  const auto order = stream->nearest_first(glm::dvec3(corner) + scene.origin);
  EXPECT_EQ(nearest_corner(order.front(), corner), 0.0f);
  EXPECT_GT(nearest_corner(order.back(), corner), 30.0f);
  // The second instance stands at x = 1000: from there the same chunks are near.
  EXPECT_EQ(stream->nearest_first(glm::dvec3(1128, 0, 128) + scene.origin), order);
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
  const auto e = parse(GeometryStream::build(scene, layout, 2.0f, 1).value()->manifest());
  const auto& m = e.manifest();
  EXPECT_EQ(m.scene_hash(), 42u);
  EXPECT_EQ(m.name(), "grid");
  EXPECT_DOUBLE_EQ(m.origin().y(), 6);
  EXPECT_EQ(m.patch_count(), 8u);
  ASSERT_EQ(m.levels_size(), 2);
  struct Entry {
    std::uint32_t x, y;
    float scale;
  };
  std::vector<Entry> table(16);
  ASSERT_EQ(meshopt_decodeVertexBuffer(table.data(), table.size(), sizeof(Entry),
                                       reinterpret_cast<const unsigned char*>(m.patch_table().data()),
                                       m.patch_table().size()),
            0);
  EXPECT_EQ(table[3].y, 6u);
  EXPECT_EQ(table[8 + 3].x, 3u);
  EXPECT_FLOAT_EQ(table[8].scale, 0.5f);
  ASSERT_EQ(m.instances_size(), 2);
  EXPECT_EQ(m.instances(1).to_world(12), 1000.0f);
  EXPECT_EQ(m.instances(1).front_base(), 4u);
  EXPECT_EQ(m.instances(1).back_base(), 0xffffffffu);
  EXPECT_EQ(m.instances(0).alpha_mode(), 1u);
  EXPECT_TRUE(m.instances(0).camera_sees_back());
  EXPECT_TRUE(m.instances(0).dynamic());
  EXPECT_EQ(m.sky_rgb_zenith(), 0xffffffu);  // 0.5 nits at exposure 2 is white
  EXPECT_EQ(m.sky_rgb_ground(), 0u);
  ASSERT_EQ(m.sun_size(), 7);
  EXPECT_FLOAT_EQ(m.sun(1), 1.0f);
}

TEST(GeometryStream, refuses_a_layout_of_another_scene) {
  auto [scene, layout] = testing::grid(4);
  EXPECT_FALSE(GeometryStream::build(scene, layout, 0.0f, 1).has_value());
  layout.instances.pop_back();
  EXPECT_FALSE(GeometryStream::build(scene, layout, 1.0f, 1).has_value());
}

}  // namespace
}  // namespace darm::session

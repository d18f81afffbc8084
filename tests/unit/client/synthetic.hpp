// A scene made by hand for the client's tests: one square of 2 x 2 units in the plane z = 0, one patch, three levels.
#pragma once

#include <meshoptimizer.h>
#include <zlib.h>

#include <array>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "client/core/scene_model.hpp"
#include "proto/darm.pb.h"

namespace darm::client::synthetic {

inline constexpr float kQ = 32;
inline constexpr std::array<std::uint32_t, 3> kTilesPerAxis = {3, 2, 1};
inline constexpr std::array<std::uint32_t, 3> kOrigin = {10, 5, 2};

inline std::string deflate(const std::string& bytes) {
  std::string out(compressBound(bytes.size()), '\0');
  uLongf size = out.size();
  compress(reinterpret_cast<Bytef*>(out.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()), bytes.size());
  out.resize(size);
  return out;
}

/// A vertex on the grid of kStep.
struct GridVertex {
  std::int32_t position[3];
  std::int32_t uv[2];
  std::uint32_t patch;
};
inline constexpr float kStep = 0.25f;

template <class T>
std::string pack_vertices(const std::vector<T>& v) {
  std::string out(meshopt_encodeVertexBufferBound(v.size(), sizeof(T)), '\0');
  out.resize(meshopt_encodeVertexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(), v.data(), v.size(),
                                        sizeof(T)));
  return deflate(out);
}

inline std::string pack_indices(const std::vector<std::uint32_t>& indices, std::size_t vertices) {
  std::string out(meshopt_encodeIndexBufferBound(indices.size(), vertices), '\0');
  out.resize(meshopt_encodeIndexBuffer(reinterpret_cast<unsigned char*>(out.data()), out.size(), indices.data(),
                                       indices.size()));
  return deflate(out);
}

inline wire::InstanceInfo instance_at(float x, float y, float z) {
  wire::InstanceInfo i;
  for (const float m : {1.f, 0.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 0.f, 1.f, 0.f, x, y, z, 1.f}) i.add_to_world(m);
  i.set_back_base(kNoBase);
  i.set_camera_sees_back(true);
  i.set_tint_rgb(0xffffff);
  return i;
}

/// Colours as 0xRRGGBB, sRGB.
inline void set_sky(wire::SceneManifest& m, std::uint32_t zenith, std::uint32_t horizon, std::uint32_t ground) {
  m.clear_sky();
  for (const auto colour : {zenith, horizon, ground})
    for (const int shift : {16, 8, 0})
      m.add_sky(srgb_to_linear(static_cast<float>((colour >> shift) & 0xffu) / 255.0f));
}

inline wire::SceneManifest manifest() {
  wire::SceneManifest m;
  m.set_q(kQ);
  std::vector<PatchPlace> places;
  for (std::size_t l = 0; l < kTilesPerAxis.size(); ++l) {
    auto& level = *m.add_levels();
    level.set_density(kQ / static_cast<float>(1u << l));
    level.set_tiles_x(kTilesPerAxis[l]);
    level.set_tiles_y(kTilesPerAxis[l]);
    level.set_width(kTilesPerAxis[l] * 30);
    level.set_height(kTilesPerAxis[l] * 30);
    places.push_back({kOrigin[l], kOrigin[l], 1.0f});
  }
  m.set_patch_count(1);
  m.set_patch_table(pack_vertices(places));
  *m.add_instances() = instance_at(0, 0, 0);
  m.set_chart_count(1);
  m.set_geometry_chunks(1);
  for (const float b : {0.f, 0.f, -1.f, 2.f, 2.f, 1.f}) m.add_bounds(b);
  set_sky(m, 0x4060ff, 0x808080, 0x402010);
  return m;
}

inline wire::GeometryChunk square_chunk() {
  std::vector<GridVertex> v;
  for (const auto& [x, y] : {std::pair{0, 0}, {8, 0}, {8, 8}, {0, 8}}) v.push_back({{x, y, 0}, {x, y}, 0});
  const std::vector<std::uint32_t> i = {0, 1, 2, 0, 2, 3};
  wire::GeometryChunk c;
  c.set_vertex_count(4);
  c.set_index_count(6);
  c.set_position_step(kStep);
  c.set_uv_step(kStep);
  c.set_vertices(pack_vertices(v));
  c.set_indices(pack_indices(i, 4));
  return c;
}

/// The square twice, back to back: its left half's texels at z = 0.5 towards +z, its right half's at z = -0.5 towards
/// -z.
inline wire::GeometryChunk two_sheets(bool near_first) {
  std::vector<GridVertex> v;
  for (const auto& [z, u] : {std::pair{2, 0}, {-2, 5}})
    for (const auto& [x, y] : {std::pair{0, 0}, {8, 0}, {8, 8}, {0, 8}})
      v.push_back({{x, y, z}, {u + x * 3 / 8, y}, 0});
  const std::vector<std::uint32_t> near = {0, 1, 2, 0, 2, 3}, far = {4, 6, 5, 4, 7, 6};
  std::vector<std::uint32_t> i = near_first ? near : far;
  const auto& second = near_first ? far : near;
  i.insert(i.end(), second.begin(), second.end());
  wire::GeometryChunk c = square_chunk();
  c.set_vertex_count(8);
  c.set_index_count(12);
  c.set_vertices(pack_vertices(v));
  c.set_indices(pack_indices(i, 8));
  return c;
}

using Colour = std::array<std::uint8_t, 3>;
using Atlas = std::function<Colour(std::uint32_t level, int x, int y)>;

/// The 32 x 32 x 3 bytes of a tile's slot: payload and a border of copied neighbours.
inline std::string slot_bytes(const Atlas& atlas, std::uint32_t level, std::uint32_t index) {
  const int tiles = static_cast<int>(kTilesPerAxis[level]);
  const int tx = static_cast<int>(index) % tiles, ty = static_cast<int>(index) / tiles;
  std::string rgb;
  for (int y = -1; y <= 30; ++y) {
    for (int x = -1; x <= 30; ++x) {
      for (const auto c : atlas(level, tx * 30 + x, ty * 30 + y)) rgb.push_back(static_cast<char>(c));
    }
  }
  return rgb;
}

/// Lossless key frame with every tile of levels [first, last] in slots that follow one another from 3 on.
inline wire::StreamFrame key_frame(const Atlas& atlas, std::uint32_t first_level, std::uint32_t last_level,
                                   std::uint32_t first_slot = 3) {
  wire::StreamFrame f;
  f.set_frame(1);
  f.set_key(true);
  std::uint32_t slot = first_slot;
  for (std::uint32_t l = first_level; l <= last_level; ++l) {
    for (std::uint32_t i = 0; i < kTilesPerAxis[l] * kTilesPerAxis[l]; ++i, ++slot) {
      auto& edit = *f.add_page_edits();
      edit.set_tile(l << 28 | i);
      edit.set_slot(slot);
      auto& pixels = *f.add_pixels();
      pixels.set_slot(slot);
      pixels.set_rgb(slot_bytes(atlas, l, i));
    }
  }
  return f;
}

}  // namespace darm::client::synthetic

// Small glTF files made in memory, so that the loader's tests need no files.
#pragma once

#include <cstdint>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "actors/scene/gltf_loader.hpp"

namespace darm::scene::test {

using Blob = std::vector<std::uint8_t>;

template <class T>
void append(Blob& blob, const std::vector<T>& values) {
  const std::size_t at = blob.size();
  blob.resize(at + values.size() * sizeof(T));
  std::memcpy(blob.data() + at, values.data(), values.size() * sizeof(T));
}

inline void append_u32(Blob& blob, std::uint32_t value) { append(blob, std::vector<std::uint32_t>{value}); }

/// A GLB of this JSON and binary chunk.
inline Blob make_glb(std::string json, Blob binary) {
  while (json.size() % 4) json.push_back(' ');
  while (binary.size() % 4) binary.push_back(0);
  Blob glb;
  append_u32(glb, 0x46546c67);
  append_u32(glb, 2);
  append_u32(glb, static_cast<std::uint32_t>(28 + json.size() + binary.size()));
  append_u32(glb, static_cast<std::uint32_t>(json.size()));
  append_u32(glb, 0x4e4f534a);
  glb.insert(glb.end(), json.begin(), json.end());
  append_u32(glb, static_cast<std::uint32_t>(binary.size()));
  append_u32(glb, 0x004e4942);
  glb.insert(glb.end(), binary.begin(), binary.end());
  return glb;
}

/// What varies between small scenes; members are JSON text. Accessor 0 is the positions; `more_*` begin with a comma.
struct SmallScene {
  std::vector<float> positions = {0, 0, 0, 1, 0, 0, 0, 1, 0};
  Blob more_binary;  ///< after the positions
  std::string nodes = R"([{"mesh":0}])";
  std::string roots = "[0]";
  std::string primitive = R"("attributes":{"POSITION":0})";
  std::string more_views;
  std::string more_accessors;
  std::string more_members;  ///< of the root object
};

inline Blob make(const SmallScene& s) {
  Blob binary;
  append(binary, s.positions);
  const std::string bytes = std::to_string(binary.size());
  const std::string count = std::to_string(s.positions.size() / 3);
  binary.insert(binary.end(), s.more_binary.begin(), s.more_binary.end());
  const std::string json = R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":)" + s.roots + R"(}],"nodes":)" +
                           s.nodes + R"(,"meshes":[{"primitives":[{)" + s.primitive +
                           R"(}]}],"buffers":[{"byteLength":)" + std::to_string(binary.size()) +
                           R"(}],"bufferViews":[{"buffer":0,"byteLength":)" + bytes + "}" + s.more_views +
                           R"(],"accessors":[{"bufferView":0,"componentType":5126,"type":"VEC3","count":)" + count +
                           "}" + s.more_accessors + "]" + s.more_members + "}";
  return make_glb(json, std::move(binary));
}

inline Result<std::shared_ptr<const Scene>> load(const SmallScene& s, const LightSetup& setup = {},
                                                 const LoadLimits& limits = {}) {
  const Blob glb = make(s);
  return load_scene_from_memory(glb, "small.glb", setup, limits);
}

}  // namespace darm::scene::test

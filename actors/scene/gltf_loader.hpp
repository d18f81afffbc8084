// glTF 2.0 / GLB file -> immutable Scene. The only door through which scene files come in; files are taken to be
// hostile.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "actors/scene/scene.hpp"
#include "actors/types/error.hpp"

namespace darm::scene {

/// What a file may ask of us. Each limit is checked before the memory is taken.
struct LoadLimits {
  std::uint64_t max_file_bytes = std::uint64_t{1} << 30;  ///< the file plus all files it refers to
  std::uint64_t max_decoded_bytes = std::uint64_t{2}
                                    << 30;       ///< geometry after meshopt and sparse decoding, all accessors read
  std::uint64_t max_triangles = 50'000'000;      ///< over all instances
  std::uint64_t max_image_pixels = 64'000'000;   ///< of one image
  std::uint64_t max_total_pixels = 512'000'000;  ///< of all images
  std::uint64_t max_nodes = 1'000'000;           ///< nodes, and instances by EXT_mesh_gpu_instancing
  std::uint32_t max_depth = 1'000;               ///< of the node hierarchy
  unsigned threads = 0;                          ///< for decoding images; 0: as many as the machine has
};

/// A disc sun infinitely far away.
struct Sun {
  glm::vec3 direction{0.3f, -1.0f, 0.15f};  ///< the way light travels; any length but zero
  glm::vec3 irradiance{0.0f};               ///< lux (linear RGB) on a surface that faces the sun
  float angular_diameter_degrees = 0.53f;   ///< 0: a delta light; at most 90
};

/// Light that the configuration adds to a file.
struct LightSetup {
  std::optional<Sun> sun;
  std::optional<Sky> sky;
  std::vector<Light> extra_lights;  ///< positions in file coordinates
  bool keep_file_lights = true;     ///< false: lights of the file are left out (emissive materials stay)
  [[nodiscard]] bool empty() const { return !sun && !sky && extra_lights.empty() && keep_file_lights; }
};

/// Loads `path` (.gltf or .glb, told apart by content) with everything it refers to inside its own folder.
/// A file without lights and emissive materials, loaded with an empty setup, gets a default sun and a gentle sky.
/// Scene::origin is the centre of the bounds when they lie far out (over 1e4 m, or over 1e3 times their extent), else
/// 0. Errors: one line naming the file and the fault. What is unsupported but not required ends in Scene::warnings.
/// Thread-safe; starts up to `limits.threads` threads of its own and joins them before it returns.
[[nodiscard]] Result<std::shared_ptr<const Scene>> load_scene(const std::filesystem::path& path,
                                                              const LightSetup& setup, const LoadLimits& limits = {});

/// The same for a file that is in memory already; `name` stands for it in messages. It may not refer to other files.
[[nodiscard]] Result<std::shared_ptr<const Scene>> load_scene_from_memory(std::span<const std::uint8_t> bytes,
                                                                          const std::string& name,
                                                                          const LightSetup& setup,
                                                                          const LoadLimits& limits = {});

}  // namespace darm::scene

// links: darm_scene
// Any bytes as a glTF file: a Scene or an error, within low limits.
#include <cstddef>
#include <cstdint>
#include <cstdlib>

#include "actors/scene/effect_plan.hpp"
#include "actors/scene/gltf_loader.hpp"
#include "actors/scene/texture_sampling.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  darm::scene::LoadLimits limits;
  limits.max_file_bytes = 1u << 20;
  limits.max_decoded_bytes = 16u << 20;
  limits.max_triangles = 100'000;
  limits.max_image_pixels = 1u << 20;
  limits.max_total_pixels = 4u << 20;
  limits.max_nodes = 10'000;
  limits.max_depth = 100;
  limits.threads = 1;
  const auto scene = darm::scene::load_scene_from_memory({data, size}, "fuzz", {}, limits);
  if (!scene) {
    if (scene.error().message.empty()) std::abort();
    return 0;
  }
  for (const auto& instance : (*scene)->instances) {
    const auto& mesh = (*scene)->meshes.at(instance.mesh);
    const auto& material = (*scene)->materials.at(mesh.material);
    for (const auto& triangle : mesh.triangles)
      for (int k = 0; k < 3; ++k)
        if (triangle[k] >= mesh.positions.size() || triangle[k] >= mesh.normals.size()) std::abort();
    (void)darm::scene::sample(**scene, material.base_color_texture, mesh, 0, 0.3f, 0.3f,
                              darm::scene::TextureEncoding::kSrgb);
  }
  (void)darm::scene::plan_effects(**scene);
  return 0;
}

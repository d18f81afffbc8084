#define XXH_INLINE_ALL
#include <xxhash.h>

#include "actors/atlas/build_layout.hpp"
#include "actors/atlas/pack.hpp"

namespace darm::atlas {

std::uint64_t layout_hash(const scene::Scene& scene, const LayoutOptions& options) {
  std::uint64_t hash = kPackerVersion;
  const auto add = [&](const void* data, std::size_t bytes) { hash = XXH3_64bits_withSeed(data, bytes, hash); };
  add(&options.q, sizeof options.q);
  for (const auto& m : scene.meshes) {
    const std::uint64_t facts[] = {m.positions.size(), m.triangles.size(),
                                   m.material < scene.materials.size() && scene.materials[m.material].double_sided};
    add(facts, sizeof facts);
    add(m.positions.data(), m.positions.size() * sizeof(m.positions[0]));
    add(m.triangles.data(), m.triangles.size() * sizeof(m.triangles[0]));
  }
  for (const auto& i : scene.instances) {
    add(&i.mesh, sizeof i.mesh);
    add(&i.to_world, sizeof i.to_world);
  }
  return hash;
}

}  // namespace darm::atlas

// Everything that is fixed once the scene is loaded: what the actors of one daemon share.
#pragma once

#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "actors/atlas/layout.hpp"
#include "actors/atlas/radiance_store.hpp"
#include "actors/atlas/texel_map.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/trace/ray_scene.hpp"
#include "actors/scene/scene.hpp"
#include "actors/scene/view_materials.hpp"
#include "actors/session/geometry_stream.hpp"
#include "daemon/config/config.hpp"

namespace darm {

struct World {
  std::shared_ptr<const scene::Scene> scene;
  std::shared_ptr<const atlas::Layout> layout;
  std::shared_ptr<const renderer::trace::RayScene> rays;
  std::shared_ptr<const renderer::LightTransport> transport;
  std::shared_ptr<const atlas::TexelMapper> mapper;
  std::shared_ptr<atlas::RadianceStore> store;
  std::shared_ptr<const session::GeometryStream> geometry;
  /// By instance: what of its light depends on the eye.
  std::shared_ptr<const std::vector<scene::ViewMaterial>> view_materials;
  float exposure = 1;

  /// Some of that light calls for a private layer.
  [[nodiscard]] bool has_view_layer() const { return view_materials && scene::calls_for_view_layer(*view_materials); }
};

/// Loads scene, layout (from the state directory where it is cached), rays, geometry and store; says how far it is in
/// the log. Uses `threads` threads, which have ended when it returns.
[[nodiscard]] Result<World> build_world(const config::Config& config, unsigned threads);

/// The same without `geometry`, which only clients need, and without `store`.
[[nodiscard]] Result<World> load_world(const config::Config& config, unsigned threads);

/// The store of the world's light in `folder`, which must be there: the one that was left there, or an empty one.
[[nodiscard]] Result<std::shared_ptr<atlas::RadianceStore>> open_store(const config::Config& config, const World& world,
                                                                       const std::filesystem::path& folder);

/// Threads for long work that the configuration asks for: at least 1.
[[nodiscard]] unsigned thread_count(const config::Config& config);

}  // namespace darm

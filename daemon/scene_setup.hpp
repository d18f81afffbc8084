// Configuration -> scene in memory: what serve, inspect and render have in common.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "actors/scene/gltf_loader.hpp"
#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"
#include "daemon/config/config.hpp"

namespace darm {

/// Sun, sky and extra lights of the configuration.
[[nodiscard]] scene::LightSetup light_setup(const config::Config& config);

/// Loads the configured scene file. The error names the file, or says that none was given.
[[nodiscard]] Result<std::shared_ptr<const scene::Scene>> load_configured_scene(const config::Config& config);

/// The camera that `spec` names: "px,py,pz tx,ty,tz fovy_degrees", a name of the set-up's [[cameras]] or
/// [[load_cameras]], or a camera of the file. The error lists the names there are.
[[nodiscard]] Result<Camera> find_camera(const config::Config& config, const scene::Scene& scene,
                                         const std::string& spec);

/// Where a client looks before it has chosen: the first camera of the set-up, else of the file, else a view of the
/// whole scene from outside its front upper corner.
[[nodiscard]] Camera start_camera(const config::Config& config, const scene::Scene& scene);

}  // namespace darm

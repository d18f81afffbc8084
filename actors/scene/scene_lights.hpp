// Light that does not come from the file: configured or default. Private to the loader.
#pragma once

#include <cstdint>

#include "actors/scene/gltf_loader.hpp"

namespace darm::scene {

/// Errors name the key at fault: non-finite or negative radiance, a sun without direction, too wide a disc.
Result<void> check_setup(const LightSetup& setup);

/// Adds the setup's sun, sky and lights to a scene whose geometry, origin and file lights are final. Without a setup,
/// without lights in the file and surfaces that emit more than 1 nit, a default sun and sky (unless all is unlit).
void apply_setup(Scene& scene, const LightSetup& setup);

/// Hash of the setup's values, chained onto `seed`.
std::uint64_t hash_setup(const LightSetup& setup, std::uint64_t seed);

}  // namespace darm::scene

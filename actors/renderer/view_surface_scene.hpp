// The scene's slots for view shading: atlas mapping and light transport behind the questions of view_surface.hpp.
#pragma once

#include <memory>

#include "actors/atlas/texel_map.hpp"
#include "actors/renderer/light_transport.hpp"
#include "actors/renderer/view_surface.hpp"

namespace darm::renderer {

/// Samples are numbered by (seed, tile, texel, sequence, sample): no state, the same on every machine and thread.
[[nodiscard]] std::shared_ptr<const ViewSurfaces> make_view_surfaces(std::shared_ptr<const scene::Scene> scene,
                                                                     std::shared_ptr<const atlas::TexelMapper> mapper,
                                                                     std::shared_ptr<const LightTransport> transport,
                                                                     std::uint64_t seed = 0);

}  // namespace darm::renderer

// Integrators for textured surfaces: most scenes from elsewhere. The last one has everything.
#include <array>

#include "actors/renderer/path_integrator.hpp"

namespace darm::renderer {
namespace {

// Without normal maps: painted walls and vertex colours, games, baked models.
constexpr Effects kPaintedUnderLamps{.emitters = true, .glossy = true, .textures = true};
constexpr Effects kPainted{
    .suns = true, .lamps = true, .emitters = true, .sky = true, .glossy = true, .textures = true};
constexpr Effects kTexturedUnderSky{
    .suns = true, .lamps = true, .sky = true, .glossy = true, .normal_maps = true, .textures = true};
constexpr Effects kTextured{
    .suns = true, .lamps = true, .emitters = true, .sky = true, .glossy = true, .normal_maps = true, .textures = true};
constexpr Effects kLayered{.suns = true,
                           .lamps = true,
                           .emitters = true,
                           .sky = true,
                           .straight = true,
                           .glossy = true,
                           .normal_maps = true,
                           .textures = true};

constexpr std::array<CompiledIntegrator, 6> kTexturedIntegrators = {{
    {kPaintedUnderLamps, make_path_integrator<kPaintedUnderLamps>},
    {kPainted, make_path_integrator<kPainted>},
    {kTexturedUnderSky, make_path_integrator<kTexturedUnderSky>},
    {kTextured, make_path_integrator<kTextured>},
    {kLayered, make_path_integrator<kLayered>},
    {kAllEffects, make_path_integrator<kAllEffects>},
}};

}  // namespace

std::span<const CompiledIntegrator> textured_integrators() { return kTexturedIntegrators; }

}  // namespace darm::renderer

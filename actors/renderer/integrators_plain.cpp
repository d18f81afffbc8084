// Integrators for surfaces without textures: models, Cornell boxes, what people build first.
#include <array>

#include "actors/renderer/path_integrator.hpp"

namespace darm::renderer {
namespace {

constexpr Effects kDiffuseUnderLamps{.emitters = true};
constexpr Effects kDiffuseUnderSky{.suns = true, .lamps = true, .sky = true};
constexpr Effects kDiffuse{.suns = true, .lamps = true, .emitters = true, .sky = true};
constexpr Effects kGlossyUnderLamps{.emitters = true, .glossy = true};
constexpr Effects kGlossyUnderSky{.suns = true, .lamps = true, .sky = true, .glossy = true};
constexpr Effects kGlossy{.suns = true, .lamps = true, .emitters = true, .sky = true, .glossy = true};

constexpr std::array<CompiledIntegrator, 6> kPlainIntegrators = {{
    {kDiffuseUnderLamps, make_path_integrator<kDiffuseUnderLamps>},
    {kDiffuseUnderSky, make_path_integrator<kDiffuseUnderSky>},
    {kDiffuse, make_path_integrator<kDiffuse>},
    {kGlossyUnderLamps, make_path_integrator<kGlossyUnderLamps>},
    {kGlossyUnderSky, make_path_integrator<kGlossyUnderSky>},
    {kGlossy, make_path_integrator<kGlossy>},
}};

}  // namespace

std::span<const CompiledIntegrator> plain_integrators() { return kPlainIntegrators; }

}  // namespace darm::renderer

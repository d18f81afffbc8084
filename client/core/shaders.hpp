// GLSL ES 3.00 sources, WebGL 2 compatible: the same text serves native clients and the browser.
#pragma once

#include <cstdint>
#include <string>

namespace darm::client {

/// Which of the surface programs: every combination is its own program, so that none pays for what it does not do.
struct SurfaceVariant {
  bool lossless = false;  ///< PhysTex is one RGB texture instead of Y, Cb, Cr planes
  bool mask = false;      ///< coverage below the cutoff is discarded
  bool blend = false;     ///< coverage goes out as alpha
  bool linear = false;    ///< the target holds linear light (half floats), else sRGB-encoded bytes
  bool stats = false;     ///< writes the class of each sample (SampleClass) instead of its colour
  bool view = false;      ///< adds the private layer: linear(shared) + linear(view)
  bool through = false;   ///< writes what a clear surface passes of the light behind it; needs `view`
  [[nodiscard]] std::uint32_t bits() const {
    return (lossless ? 1u : 0u) | (mask ? 2u : 0u) | (blend ? 4u : 0u) | (linear ? 8u : 0u) | (stats ? 16u : 0u) |
           (view ? 32u : 0u) | (through ? 64u : 0u);
  }
};

/// Where a sample's light came from, as written by the stats programs: red = class / 8.
enum class SampleClass : std::uint8_t { kUndefined = 0, kSharp = 1, kCoarser = 2, kCoarseTex = 3, kBackground = 4 };

/// `view`: for surface programs with the private layer (they need the way from the eye).
[[nodiscard]] std::string surface_vertex_source(bool view = false);
[[nodiscard]] std::string surface_fragment_source(const SurfaceVariant& variant);
/// Positions only: fills the depth buffer, so that each sample is shaded once.
[[nodiscard]] std::string depth_fragment_source();
[[nodiscard]] std::string fullscreen_vertex_source();
[[nodiscard]] std::string background_fragment_source(bool linear, bool stats);
/// Averages 2x2 samples in linear light and encodes. `linear`: the samples are linear already.
[[nodiscard]] std::string resolve_fragment_source(bool linear);

/// The level a sample is drawn from, as the fragment shader computes it: J = [dx, dy] are the derivatives of uv * q
/// along one final pixel; the smaller singular value is the minor footprint. In [0, levels).
[[nodiscard]] int sharp_level(const float dx[2], const float dy[2], int levels);

}  // namespace darm::client

// From a scene to its atlas: parameterise, pack every level, or take both from the cache.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <string_view>

#include "actors/atlas/layout.hpp"
#include "actors/scene/scene.hpp"
#include "actors/types/error.hpp"

namespace darm::atlas {

struct LayoutOptions {
  float q = 0;                                        ///< texels per world unit at level 0; 0: auto
  std::uint64_t max_texels = std::uint64_t{1} << 31;  ///< bound on level 0; a larger explicit q is refused
  unsigned threads = 1;
  /// Called with a stage ("parameterise", "pack") and a fraction in [0, 1], one call at a time, from any thread.
  std::function<void(std::string_view stage, float fraction)> progress{};
};

/// Level 0 under automatic q stays under this.
inline constexpr std::uint64_t kAutoTexels = std::uint64_t{64} << 20;
/// The last level (CoarseTex) stays under this, and under kCoarseSide on each axis.
inline constexpr std::uint64_t kCoarseTexels = 1'000'000;
inline constexpr std::uint32_t kCoarseSide = 2048;
/// A level 0 above this gets a coarser one below it, even where it would do for a CoarseTex.
inline constexpr std::uint64_t kSingleLevelTexels = 65'536;

struct LayoutTimes {
  double parameterise = 0;  ///< seconds; 0 when the layout came from the cache
  double pack = 0;
};

/// Parameterises and packs. Fails if the scene has no surface, if an explicit q does not fit `max_texels` (the message
/// names the largest that does), or if there are more patches than a coarse level can hold. The result does not depend
/// on `threads`.
[[nodiscard]] Result<std::shared_ptr<const Layout>> build_layout(const scene::Scene& scene,
                                                                 const LayoutOptions& options,
                                                                 LayoutTimes* times = nullptr);

/// build_layout behind a file `layout-<hash>.bin` in `state_dir`. A missing, foreign or torn file is made anew.
/// Failing to write the file is not an error of the layout: the next start builds again.
[[nodiscard]] Result<std::shared_ptr<const Layout>> cached_layout(const scene::Scene& scene,
                                                                  const LayoutOptions& options,
                                                                  const std::filesystem::path& state_dir,
                                                                  LayoutTimes* times = nullptr);

/// Hash of what the layout depends on: positions, triangles, double-sidedness, transforms, q option and packer version.
[[nodiscard]] std::uint64_t layout_hash(const scene::Scene& scene, const LayoutOptions& options);

}  // namespace darm::atlas

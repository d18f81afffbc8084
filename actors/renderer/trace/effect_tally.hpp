// How often the code of each effect of light ran, counted where it runs.
#pragma once

#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>

namespace darm::renderer {

/// In the order of scene::EffectPlan::effects, as far as an effect has code of its own in the light's inner loops.
enum class EffectKind : std::uint8_t {
  kDeltaLights,        ///< shadow rays aimed at point, spot and directional lights without extent
  kAreaLights,         ///< points drawn on emissive surfaces and sun discs, and such a surface met by a path
  kSky,                ///< look-ups of the sky's radiance
  kAlphaTest,          ///< calls of the ray library's filter for alpha MASK
  kBlending,           ///< surfaces asked how much light they pass straight on
  kDiffuseReflection,  ///< diffuse scattering set up: at a first vertex, and at each a path goes on from
  kGlossyReflection,   ///< specular lobes set up
  kTransmission,       ///< lobes set up with transmission among them
  kVolumeAttenuation,  ///< surfaces asked for the volume behind them
  kNormalMaps,         ///< normals bent
  kVertexColors,       ///< colours interpolated
  kTextures,           ///< texture reads for a material
};
inline constexpr std::size_t kEffectKinds = 12;

/// As a metric's label: "delta_lights".
[[nodiscard]] const char* label_of(EffectKind kind);

using EffectCounts = std::array<std::uint64_t, kEffectKinds>;

/// One thread's counts. Only that thread adds; any thread may read. No locked instruction: an addition costs what a
/// plain variable's does.
class EffectTally {
 public:
  EffectTally();
  ~EffectTally();
  EffectTally(const EffectTally&) = delete;
  EffectTally& operator=(const EffectTally&) = delete;

  void add(EffectKind kind) {
    auto& count = counts_[static_cast<std::size_t>(kind)];
    count.store(count.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
  }
  [[nodiscard]] EffectCounts counts() const;

 private:
  std::array<std::atomic<std::uint64_t>, kEffectKinds> counts_{};
};

/// The calling thread's.
[[nodiscard]] EffectTally& thread_tally();

/// Of all threads of the process together, those that have ended included. Never falls.
[[nodiscard]] EffectCounts effect_counts();

}  // namespace darm::renderer

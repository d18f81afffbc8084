// Rays a second inside the renderer, beside the ray library alone on the very same rays.
#pragma once

#include <cstdint>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "actors/types/error.hpp"

namespace darm::bench {

struct RaytraceOptions {
  std::filesystem::path config;  ///< set-up; may be empty
  std::filesystem::path scene;
  std::string camera;               ///< empty: where a client starts
  std::filesystem::path state_dir;  ///< keeps the layout between runs
  double q = 0;                     ///< 0: the set-up's
  std::size_t tiles = 600;          ///< of those the camera sees, evenly taken; all of their seen texels are shaded
  std::uint32_t width = 1280;       ///< of the reference tracer's picture
  std::uint32_t height = 720;
  bool all_effects = false;
};

/// Two kinds of work, in slices of a few ten milliseconds; after each slice every thread traces the rays it has just
/// cast again, by the ray library alone (no filters, no reading of hits), in the same order.
/// Fast light: shade_tile on the camera's texels with stored light of the coarse level; a first pass, then passes of
/// four samples. Reference: LightTransport::full_radiance on camera rays.
/// Keys: value, peer (rays a second of all threads together, by their processor time, so that other work on the machine
/// does not count), ratio, of the fast light; the same for fast.first, fast.later and reference, with the quartiles of
/// the slices' ratios, the ratio by the clock on the wall, and rays a sample.
[[nodiscard]] Result<nlohmann::json> raytrace(const RaytraceOptions& options);

}  // namespace darm::bench

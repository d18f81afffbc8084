// What `darmd accuracy` measures, as plain values.
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

namespace darm::accuracy {

/// A picture that was there at a time, and how far from the reference it is.
struct Point {
  double seconds = 0;  ///< from the first camera (atlas) or of tracing (camera frames)
  double db = 0;       ///< PSNR of display RGB against the reference
  double samples = 0;  ///< texel samples taken so far (atlas), or samples per pixel (camera frames)
};

/// The one knob in which a variant differs from the balanced preset.
enum class Group : std::uint8_t {
  kPresets,
  kDensity,
  kSamples,
  kIndirect,
  kFilter,
  kLayers,
  kFrames,
  kCodec,
  kEffects
};
inline constexpr int kGroups = 9;

/// As `--only` and the files name it: presets, q, samples, indirect, filter, layers, frames, codec, effects.
[[nodiscard]] std::string name_of(Group group);
[[nodiscard]] std::optional<Group> group_of(const std::string& name);

/// One variant, one camera. `figures` hold what is not a curve, by the names of figures.hpp.
struct Measurement {
  std::string key;  ///< of everything the result depends on: 16 hexadecimal digits
  std::string camera;
  Group group = Group::kPresets;
  std::string variant;       ///< "balanced", "q 128", ...
  std::vector<Point> curve;  ///< seconds increasing
  std::map<std::string, double> figures;
};

/// Names of figures.
namespace figure {
inline constexpr const char* kLightDb = "light_db";                ///< the last picture without the codec
inline constexpr const char* kBytes = "bytes";                     ///< of the whole stream
inline constexpr const char* kFirstBytes = "first_bytes";          ///< of it until the view is mostly tiles
inline constexpr const char* kFirstCodecDb = "first_codec_db";     ///< that picture after the codec against before
inline constexpr const char* kLastCodecDb = "last_codec_db";       ///< the last one likewise
inline constexpr const char* kEncodeSeconds = "encode_seconds";    ///< mean of one frame
inline constexpr const char* kWithoutDb = "without_db";            ///< the picture without an effect against with it
inline constexpr const char* kAtLeast = "at_least";                ///< 1: `without_db` is only a lower bound (noise)
inline constexpr const char* kSecondsWith = "seconds_with";        ///< of one sample per pixel, with the effect
inline constexpr const char* kSecondsWithout = "seconds_without";  ///< and without
inline constexpr const char* kStoppedEarly = "finished_after";     ///< seconds after which nothing changed any more
inline constexpr const char* kRunBegan = "run_began";              ///< when the process began, seconds since 1970
inline constexpr const char* kRaysPerSecond = "rays_per_second";   ///< of the machine, just before and after
}  // namespace figure

/// One effect of the plan, as the scene calls for it.
struct PlannedEffect {
  std::string name;
  bool needed = false;
  std::string reason;
  std::string cost;  ///< as it was measured, in words; empty: it was not
};

struct CameraFacts {
  std::string name;
  double counted = 0;         ///< share of the view's pixels that the error is of, 0..1
  double reference_psnr = 0;  ///< the reference's own accuracy, dB
};

/// Everything the pages are made of.
struct Report {
  std::string scene;  ///< file name
  std::uint64_t triangles = 0;
  double q = 0;
  unsigned threads = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  double seconds = 0;  ///< length of an atlas run
  std::vector<CameraFacts> cameras;
  std::vector<PlannedEffect> plan;
  std::vector<Measurement> measurements;

  /// Null: not measured.
  [[nodiscard]] const Measurement* find(const std::string& camera, Group group, const std::string& variant) const;
};

/// The variants that others are measured against.
inline constexpr const char* kBalanced = "balanced";
inline constexpr const char* kCameraFrames = "camera frames";

}  // namespace darm::accuracy

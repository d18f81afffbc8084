// Which variants a study has: one knob at a time from the balanced preset. Pure.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "actors/scene/effect_plan.hpp"
#include "actors/types/error.hpp"
#include "daemon/accuracy/report/measurement.hpp"
#include "daemon/config/config.hpp"

namespace darm::accuracy {

/// How a variant is measured.
enum class Method : std::uint8_t { kAtlas, kFrames, kCodec, kWithout };

/// What a kWithout variant leaves out.
struct LeftOut {
  std::optional<std::uint32_t> max_bounces;  ///< of the integrator
  bool sun_and_lamps = false;
  bool sky = false;
  bool private_layer = false;
};

struct Variant {
  Group group = Group::kPresets;
  std::string name;
  Method method = Method::kAtlas;
  config::Config config;  ///< of the run
  double seconds = 0;     ///< length of the run
  bool private_layer = false;
  float crf = 0;     ///< kCodec
  LeftOut left_out;  ///< kWithout
};

struct StudyScope {
  config::Config config;  ///< as given: scene, lights, threads, stream
  double q = 0;           ///< texels per metre in force
  double seconds = 16;
  scene::EffectPlan plan;
};

/// All variants of a study, in the order of measuring: balanced first, since codec variants are made of its recording.
[[nodiscard]] std::vector<Variant> variants_of(const StudyScope& scope);

/// Those that `only` names, by group or by name; all if it is empty. With a codec variant comes balanced. Errors: a
/// name that is none; the message lists the groups.
[[nodiscard]] Result<std::vector<Variant>> chosen(std::vector<Variant> all, const std::vector<std::string>& only);

}  // namespace darm::accuracy

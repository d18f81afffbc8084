#include "daemon/accuracy/variants.hpp"

#include <algorithm>
#include <cstdio>

namespace darm::accuracy {
namespace {

std::string number_text(double value) {
  char out[32];
  std::snprintf(out, sizeof out, "%g", value);
  return out;
}

class Variants {
 public:
  explicit Variants(const StudyScope& scope) : scope_(scope) {
    base_.config = scope.config;
    base_.config.accuracy = config::preset_of(kBalanced);
    base_.config.scene.q = scope.q;
    base_.seconds = scope.seconds;
  }

  Variant& add(Group group, std::string name, Method method = Method::kAtlas) {
    Variant v = base_;
    v.group = group;
    v.name = std::move(name);
    v.method = method;
    all_.push_back(std::move(v));
    return all_.back();
  }
  void leave_out(const std::string& name, const LeftOut& what) {
    add(Group::kEffects, name, Method::kWithout).left_out = what;
  }
  [[nodiscard]] std::vector<Variant> take() { return std::move(all_); }

 private:
  const StudyScope& scope_;
  Variant base_;
  std::vector<Variant> all_;
};

void add_effects(Variants& variants, const scene::EffectPlan& plan) {
  // A path's first scattering is at the surface that is seen: one bounce of indirect light is its second.
  for (const std::uint32_t bounces : {0u, 1u, 2u, 4u}) {
    LeftOut later;
    later.max_bounces = bounces + 1;
    variants.leave_out(bounces == 0   ? "all indirect light"
                       : bounces == 1 ? "all but one bounce"
                                      : "all but " + std::to_string(bounces) + " bounces",
                       later);
  }
  LeftOut sky, lamps, layer;
  sky.sky = lamps.sun_and_lamps = layer.private_layer = true;
  if (plan.sky) variants.leave_out("sky", sky);
  if (plan.sky && (plan.delta_lights || plan.area_lights)) variants.leave_out("sun and lamps", lamps);
  if (plan.view_layer) variants.leave_out("private layer", layer);
}

}  // namespace

std::vector<Variant> variants_of(const StudyScope& scope) {
  Variants variants(scope);
  variants.add(Group::kPresets, kBalanced).seconds *= 2;
  for (const int crf : {14, 18, 23, 28})
    variants.add(Group::kCodec, "crf " + std::to_string(crf), Method::kCodec).crf = static_cast<float>(crf);
  variants.add(Group::kFrames, kCameraFrames, Method::kFrames).seconds *= 2;
  for (const char* preset : {"preview", "reference"})
    variants.add(Group::kPresets, preset).config.accuracy = config::preset_of(preset);
  for (const double q : {scope.q / 2, scope.q * 2})
    variants.add(Group::kDensity, "q " + number_text(q)).config.scene.q = q;
  // A budget shows once it is spent, which takes as long as the balanced run has.
  for (const std::uint32_t samples : {1u, 2u, 4u, 16u}) {
    auto& variant = variants.add(Group::kSamples, "up to " + std::to_string(samples));
    variant.config.render.max_samples = samples;
    variant.seconds *= 2;
  }
  variants.add(Group::kIndirect, "traced").config.accuracy.indirect = "traced";
  variants.add(Group::kFilter, "no filter").config.accuracy.filter_samples = 0;
  if (scope.plan.view_layer && scope.config.stream.view_phystex > 0)
    variants.add(Group::kLayers, "with a private layer").private_layer = true;
  add_effects(variants, scope.plan);
  return variants.take();
}

Result<std::vector<Variant>> chosen(std::vector<Variant> all, const std::vector<std::string>& only) {
  if (only.empty()) return all;
  for (const auto& name : only) {
    const bool known =
        group_of(name) || std::any_of(all.begin(), all.end(), [&](const auto& v) { return v.name == name; });
    if (known) continue;
    std::string message = "--only " + name + ": is no group or variant; groups are ";
    for (int g = 0; g < kGroups; ++g) message.append(g == 0 ? "" : ", ").append(name_of(static_cast<Group>(g)));
    return fail(message);
  }
  const auto wanted = [&](const Variant& v) {
    return std::any_of(only.begin(), only.end(), [&](const auto& n) { return n == v.name || n == name_of(v.group); });
  };
  const bool codec =
      std::any_of(all.begin(), all.end(), [&](const auto& v) { return v.method == Method::kCodec && wanted(v); });
  std::erase_if(all, [&](const Variant& v) { return !wanted(v) && !(codec && v.name == kBalanced); });
  return all;
}

}  // namespace darm::accuracy

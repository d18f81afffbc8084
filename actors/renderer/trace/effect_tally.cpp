#include "actors/renderer/trace/effect_tally.hpp"

#include <algorithm>
#include <mutex>
#include <vector>

namespace darm::renderer {
namespace {

struct Registry {
  std::mutex guard;
  std::vector<const EffectTally*> running;
  EffectCounts ended{};
};

// Never destroyed: threads may end after main has.
Registry& registry() {
  static auto* const all = new Registry;
  return *all;
}

void add_to(EffectCounts& sum, const EffectCounts& counts) {
  for (std::size_t i = 0; i < kEffectKinds; ++i) sum[i] += counts[i];
}

}  // namespace

const char* label_of(EffectKind kind) {
  static constexpr std::array<const char*, kEffectKinds> kLabels = {
      "delta_lights",      "area_lights",   "sky",
      "alpha_test",        "blending",      "diffuse_interreflection",
      "glossy_reflection", "transmission",  "volume_attenuation",
      "normal_maps",       "vertex_colors", "textures"};
  return kLabels[static_cast<std::size_t>(kind)];
}

EffectTally::EffectTally() {
  auto& all = registry();
  const std::scoped_lock lock(all.guard);
  all.running.push_back(this);
}

EffectTally::~EffectTally() {
  auto& all = registry();
  const std::scoped_lock lock(all.guard);
  std::erase(all.running, this);
  add_to(all.ended, counts());
}

EffectCounts EffectTally::counts() const {
  EffectCounts out{};
  for (std::size_t i = 0; i < kEffectKinds; ++i) out[i] = counts_[i].load(std::memory_order_relaxed);
  return out;
}

EffectTally& thread_tally() {
  thread_local EffectTally tally;
  return tally;
}

EffectCounts effect_counts() {
  auto& all = registry();
  const std::scoped_lock lock(all.guard);
  EffectCounts sum = all.ended;
  for (const auto* tally : all.running) add_to(sum, tally->counts());
  return sum;
}

}  // namespace darm::renderer

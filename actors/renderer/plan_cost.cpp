#include "actors/renderer/plan_cost.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <chrono>
#include <cstdint>
#include <ctime>

#include "actors/scene/without_effect.hpp"

namespace darm::renderer {
namespace {

constexpr std::uint32_t kRowsOfSlice = 4;

#if defined(__linux__)
double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}
#else
double thread_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}
#endif

// Rows [y, y + kRowsOfSlice) of one sample number; seconds it took.
double trace_slice(const LightTransport& transport, const CostView& view, std::uint32_t y, std::uint32_t sample,
                   std::vector<glm::vec3>& light) {
  light.clear();
  const glm::vec3 eye(view.camera.position - transport.rays().scene().origin);
  const double start = thread_seconds();
  for (std::uint32_t row = y; row < std::min(y + kRowsOfSlice, view.viewport.height); ++row)
    for (std::uint32_t x = 0; x < view.viewport.width; ++x) {
      Sampler sampler(11, hash_pair(x, row), sample);
      const glm::vec2 at = glm::vec2(x, row) + sampler.next_2d();
      light.push_back(
          transport.full_radiance({eye, 0, ray_direction(view.camera, view.viewport, at.x, at.y), 1e30f}, sampler));
    }
  return thread_seconds() - start;
}

bool same(const glm::vec3& a, const glm::vec3& b) {
  using Bits = std::array<std::uint32_t, 3>;
  return std::bit_cast<Bits>(a) == std::bit_cast<Bits>(b);
}

}  // namespace

SpeedRatio compare_speed(const LightTransport& first, const LightTransport& second, const CostView& view) {
  const trace::DenormalsAreZero denormals;
  SpeedRatio out;
  std::vector<glm::vec3> a, b;
  std::vector<double> ratios;
  std::array<double, 2> spent{};
  const std::uint32_t slices = (view.viewport.height + kRowsOfSlice - 1) / kRowsOfSlice;
  for (std::uint32_t i = 0; i == 0 || spent[0] + spent[1] < view.seconds; ++i) {
    // The whole picture is walked through in an order that is spread out, and who goes first changes.
    const std::uint32_t y = (i * 7 % slices) * kRowsOfSlice;
    const std::uint32_t sample = i / slices;
    const double early = i % 2 == 0 ? trace_slice(first, view, y, sample, a) : 0;
    const double other = trace_slice(second, view, y, sample, b);
    const double own = i % 2 == 0 ? early : trace_slice(first, view, y, sample, a);
    spent[0] += own;
    spent[1] += other;
    if (own > 0 && other > 0) ratios.push_back(other / own);
    out.paths += a.size();
    for (std::size_t k = 0; k < a.size(); ++k) out.different += same(a[k], b[k]) ? 0 : 1;
  }
  const auto paths = static_cast<double>(out.paths);
  out.rate = paths / std::max(spent[0], 1e-9);
  out.peer = paths / std::max(spent[1], 1e-9);
  out.ratio = out.rate / out.peer;
  if (ratios.empty()) return out;
  std::sort(ratios.begin(), ratios.end());
  out.low = ratios[ratios.size() / 4];
  out.median = ratios[ratios.size() / 2];
  out.high = ratios[ratios.size() * 3 / 4];
  return out;
}

Result<std::vector<EffectCost>> measure_effects(const LightTransport& transport, const CostView& view,
                                                unsigned threads) {
  std::vector<EffectCost> costs;
  for (const auto& effect : transport.plan().effects) {
    if (!effect.needed) continue;
    const auto scene = scene::without_effect(transport.rays().scene(), effect.name);
    if (scene == nullptr) continue;
    auto rays = trace::RayScene::build(scene, threads);
    if (!rays) return std::unexpected(rays.error());
    const auto speed = compare_speed(LightTransport(scene, *rays), transport, view);
    costs.push_back({effect.name, speed.ratio, speed.low, speed.high});
  }
  return costs;
}

Result<PlanCost> measure_plan(const LightTransport& transport, const CostView& view, unsigned threads) {
  TransportOptions everything = transport.options();
  everything.all_effects = true;
  PlanCost cost;
  cost.planned = compare_speed(transport, LightTransport(transport.scene(), transport.share_rays(), everything), view);
  auto filtered = trace::RayScene::build(transport.scene(), threads, trace::RayScene::Filters::kEverywhere);
  if (!filtered) return std::unexpected(filtered.error());
  cost.filtered = compare_speed(transport, LightTransport(transport.scene(), *filtered, everything), view);
  return cost;
}

}  // namespace darm::renderer

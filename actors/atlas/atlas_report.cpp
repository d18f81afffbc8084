#include "actors/atlas/atlas_report.hpp"

#include "actors/atlas/working_set.hpp"

namespace darm::atlas {
namespace {

WorkingSetReport report(const WorkingSetCounter& counter) {
  return {counter.texels(), counter.tiles(), counter.efficiency()};
}

}  // namespace

AtlasReport report_atlas(const Layout& layout) {
  AtlasReport out;
  out.patches = layout.patch_count;
  out.q = layout.q;
  out.surface_area = layout.surface_area;
  out.occupancy = layout.levels.front().occupancy;
  for (const auto& l : layout.levels) out.levels.push_back({l.density, l.width, l.height, l.occupancy});
  return out;
}

std::vector<DroppedTriangles> dropped_triangles(const scene::Scene& scene, const Layout& layout) {
  std::vector<DroppedTriangles> out;
  for (const auto& d : scene.dropped) out.push_back({d.reason, d.triangles});
  out.insert(out.end(), layout.dropped.begin(), layout.dropped.end());
  return out;
}

WorkingSetReport measure_working_set(const Layout& layout, std::span<const Tap> taps) {
  WorkingSetCounter counter(layout);
  for (const auto& t : taps)
    if (t.patch != kNoPatch) counter.add(t.patch, t.level, t.uv);
  return report(counter);
}

WorkingSetReport measure_working_set(const Layout& layout, const Level& paper, std::span<const Tap> taps) {
  WorkingSetCounter counter(layout, &paper);
  for (const auto& t : taps)
    if (t.patch != kNoPatch) counter.add(t.patch, 0, t.uv);
  return report(counter);
}

}  // namespace darm::atlas

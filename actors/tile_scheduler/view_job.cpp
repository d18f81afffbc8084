#include "actors/tile_scheduler/view_job.hpp"

#include <algorithm>
#include <utility>

namespace darm::tile_scheduler {

ViewJob::ViewJob(std::uint64_t number, std::shared_ptr<const atlas::Layout> layout,
                 std::shared_ptr<const renderer::trace::RayScene> rays, const Camera& camera, const Viewport& viewport,
                 int first_pass, int pass_count, unsigned slices,
                 std::shared_ptr<const std::vector<scene::ViewMaterial>> materials, bool own,
                 std::uint32_t rays_per_pass)
    : number_(number),
      layout_(std::move(layout)),
      rays_(std::move(rays)),
      sampler_(*layout_, *rays_, camera, viewport),
      first_pass_(first_pass),
      pass_count_(pass_count),
      rays_per_pass_(rays_per_pass),
      materials_(std::move(materials)),
      results_(std::clamp(slices, 1u, std::max(1u, block_rows(viewport, rays_per_pass)))),
      private_(materials_ && own ? results_.size() : 0),
      left_(static_cast<unsigned>(results_.size())) {
  for (unsigned slice = 0; slice < slice_count(); ++slice) places_.push_back({first_pass, first_row(slice)});
  if (rays_per_pass_ < kRaysPerStep) results_.front().reserve(rays_per_pass_, 4 * std::size_t{rays_per_pass_});
}

std::uint32_t ViewJob::first_row(unsigned slice) const {
  return static_cast<std::uint32_t>(std::uint64_t{block_rows(sampler_.viewport(), rays_per_pass_)} * slice /
                                    slice_count());
}

std::uint64_t ViewJob::rays() const {
  return std::uint64_t{block_rows(sampler_.viewport(), rays_per_pass_)} *
         block_columns(sampler_.viewport(), rays_per_pass_) * static_cast<std::uint64_t>(pass_count_);
}

double ViewJob::samples() const {
  double out = 0;
  for (const auto& part : results_) out += part.samples();
  return out;
}

ViewJob::Step ViewJob::run_step(unsigned slice) {
  PrivateSamples own;
  if (materials_) own = {*materials_, private_.empty() ? nullptr : &private_[slice]};
  auto& at = places_[slice];
  const auto end = first_row(slice + 1);
  const auto rays_per_row = block_columns(sampler_.viewport(), rays_per_pass_);
  std::uint32_t rays = 0;
  while (at.pass < first_pass_ + pass_count_ && !cancelled_.load(std::memory_order_relaxed)) {
    if (rays > 0 && rays + rays_per_row > kRaysPerStep) return Step::kMore;
    trace_rows(sampler_, at.pass, at.row, at.row + 1, results_[slice], own, rays_per_pass_);
    rays += rays_per_row;
    if (++at.row < end) continue;
    ++at.pass;
    at.row = first_row(slice);
  }
  return left_.fetch_sub(1, std::memory_order_acq_rel) == 1 ? Step::kAllDone : Step::kSliceDone;
}

bool ViewJob::run_slice(unsigned slice) {
  for (;;)
    if (const auto step = run_step(slice); step != Step::kMore) return step == Step::kAllDone;
}

}  // namespace darm::tile_scheduler

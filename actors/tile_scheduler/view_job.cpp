#include "actors/tile_scheduler/view_job.hpp"

#include <algorithm>
#include <utility>

namespace darm::tile_scheduler {

ViewJob::ViewJob(std::uint64_t number, std::shared_ptr<const atlas::Layout> layout,
                 std::shared_ptr<const renderer::trace::RayScene> rays, const Camera& camera, const Viewport& viewport,
                 int first_pass, int pass_count, unsigned slices,
                 std::shared_ptr<const std::vector<scene::ViewMaterial>> materials)
    : number_(number),
      layout_(std::move(layout)),
      rays_(std::move(rays)),
      sampler_(*layout_, *rays_, camera, viewport),
      first_pass_(first_pass),
      pass_count_(pass_count),
      materials_(std::move(materials)),
      results_(std::clamp(slices, 1u, std::max(1u, block_rows(viewport)))),
      private_(materials_ ? results_.size() : 0),
      left_(static_cast<unsigned>(results_.size())) {}

bool ViewJob::run_slice(unsigned slice) {
  const auto rows = block_rows(sampler_.viewport());
  const auto count = slice_count();
  const auto row_of = [&](unsigned s) {
    return static_cast<std::uint32_t>(static_cast<std::uint64_t>(rows) * s / count);
  };
  PrivateSamples own;
  if (materials_) own = {*materials_, &private_[slice]};
  for (int pass = first_pass_; pass < first_pass_ + pass_count_; ++pass)
    trace_rows(sampler_, pass, row_of(slice), row_of(slice + 1), results_[slice], own);
  return left_.fetch_sub(1, std::memory_order_acq_rel) == 1;
}

}  // namespace darm::tile_scheduler

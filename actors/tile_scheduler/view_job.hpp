// Tracing of one view in slices that may run on any threads at once.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <vector>

#include "actors/tile_scheduler/visibility.hpp"
#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

/// Owns everything its slices touch. run_slice(i) is called once for each i in [0, slice_count()), in any order and on
/// any thread; when it returns true, all are done and `results` may be read by whoever learns of it from that call.
class ViewJob {
 public:
  /// Traces passes [first_pass, first_pass + pass_count) in at most `slices` slices (at least 1).
  ViewJob(std::uint64_t number, std::shared_ptr<const atlas::Layout> layout,
          std::shared_ptr<const renderer::trace::RayScene> rays, const Camera& camera, const Viewport& viewport,
          int first_pass, int pass_count, unsigned slices);

  bool run_slice(unsigned slice);

  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] unsigned slice_count() const { return static_cast<unsigned>(results_.size()); }
  [[nodiscard]] int pass_count() const { return pass_count_; }
  [[nodiscard]] bool done() const { return left_.load(std::memory_order_acquire) == 0; }
  [[nodiscard]] const std::vector<VisibleSet>& results() const { return results_; }

  ViewAnswer answer;         ///< the camera that the result answers; for the owner, slices do not touch it
  bool starts_pose = false;  ///< the result belongs to a new pose

 private:
  std::uint64_t number_;
  std::shared_ptr<const atlas::Layout> layout_;
  std::shared_ptr<const renderer::trace::RayScene> rays_;
  ViewSampler sampler_;
  int first_pass_;
  int pass_count_;
  std::vector<VisibleSet> results_;
  std::atomic<unsigned> left_;
};

}  // namespace darm::tile_scheduler

// Tracing of one view in slices that may run on any threads at once.
#pragma once

#include <atomic>
#include <cstdint>
#include <memory>
#include <utility>
#include <vector>

#include "actors/tile_scheduler/visibility.hpp"
#include "actors/types/frame_stamps.hpp"

namespace darm::tile_scheduler {

/// A ray with what is noted of it takes about a microsecond.
inline constexpr std::uint32_t kRaysPerStep = 2048;

/// Owns everything its slices touch. Slices may run on any threads, each on one at a time. run_step(i) is called for
/// each i in [0, slice_count()) until it says no longer kMore; whoever hears kAllDone, or learns of it from that call,
/// may read `results`.
class ViewJob {
 public:
  /// `materials`, by instance, or null: what depends on the eye is estimated; `own`: and what a private layer would
  /// hold of it gathered. `rays_per_pass`: as trace_rows() has it.
  /// Traces passes [first_pass, first_pass + pass_count) in at most `slices` slices (at least 1).
  ViewJob(std::uint64_t number, std::shared_ptr<const atlas::Layout> layout,
          std::shared_ptr<const renderer::trace::RayScene> rays, const Camera& camera, const Viewport& viewport,
          int first_pass, int pass_count, unsigned slices,
          std::shared_ptr<const std::vector<scene::ViewMaterial>> materials = nullptr, bool own = false,
          std::uint32_t rays_per_pass = kMaxRays);

  enum class Step : std::uint8_t { kMore, kSliceDone, kAllDone };
  /// Traces a few milliseconds' worth of rows of a slice: at least one, and no more than kRaysPerStep rays with it.
  Step run_step(unsigned slice);
  /// The whole of a slice; true: all are done.
  bool run_slice(unsigned slice);
  /// Nobody waits for the results: steps end at the next row, and slices with them. Thread-safe.
  void cancel() { cancelled_.store(true, std::memory_order_relaxed); }

  [[nodiscard]] std::uint64_t number() const { return number_; }
  [[nodiscard]] unsigned slice_count() const { return static_cast<unsigned>(results_.size()); }
  /// Camera rays of the whole job.
  [[nodiscard]] std::uint64_t rays() const;
  /// What steps took is told to the job, because many threads take them. Thread-safe.
  void note_busy(Microseconds took) { busy_.fetch_add(took, std::memory_order_relaxed); }
  [[nodiscard]] Microseconds busy() const { return busy_.load(std::memory_order_relaxed); }
  [[nodiscard]] bool done() const { return left_.load(std::memory_order_acquire) == 0; }
  [[nodiscard]] const std::vector<VisibleSet>& results() const { return results_; }
  /// The same, to keep: the job has none after that.
  [[nodiscard]] std::vector<VisibleSet> take_results() { return std::move(results_); }
  /// Picture samples of all results, once done.
  [[nodiscard]] double samples() const;
  /// What a private layer would hold; empty if that was not to be gathered.
  [[nodiscard]] const std::vector<PrivateSet>& private_results() const { return private_; }

  ViewAnswer answer;         ///< the camera that the result answers; for the owner, slices do not touch it
  bool starts_pose = false;  ///< the result belongs to a new pose
  /// Whole passes that are done with it: none of a glance.
  [[nodiscard]] int whole_passes() const { return rays_per_pass_ < kMaxRays ? 0 : pass_count_; }

 private:
  // Where a slice goes on.
  struct Place {
    int pass = 0;
    std::uint32_t row = 0;
  };
  [[nodiscard]] std::uint32_t first_row(unsigned slice) const;

  std::uint64_t number_;
  std::shared_ptr<const atlas::Layout> layout_;
  std::shared_ptr<const renderer::trace::RayScene> rays_;
  ViewSampler sampler_;
  int first_pass_;
  int pass_count_;
  std::uint32_t rays_per_pass_;
  std::shared_ptr<const std::vector<scene::ViewMaterial>> materials_;  // null: none known
  std::vector<VisibleSet> results_;
  std::vector<PrivateSet> private_;
  std::vector<Place> places_;  // of each slice
  std::atomic<unsigned> left_;
  std::atomic<bool> cancelled_ = false;
  std::atomic<Microseconds> busy_ = 0;
};

}  // namespace darm::tile_scheduler

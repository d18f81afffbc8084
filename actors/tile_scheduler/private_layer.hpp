// The private layer of one session as the scheduler knows it: what its eye sees of light that depends on it, which
// tiles get its slots, and its stream. Pure.
#pragma once

#include <memory>
#include <vector>

#include "actors/renderer/view_messages.hpp"
#include "actors/tile_scheduler/image_store.hpp"
#include "actors/tile_scheduler/private_set.hpp"
#include "actors/tile_scheduler/slot_allocation.hpp"
#include "actors/tile_scheduler/stream_state.hpp"

namespace darm::tile_scheduler {

struct PrivateLayerOptions {
  Microseconds keep_previous = 500'000;  ///< how long what the pose before saw lives on
  float previous_weight = 0.25f;
  /// Shares of its worth that a chain loses 0..3 levels coarser than it begins, and when it has nothing.
  ChainLoss loss{0.0f, 0.2f, 0.4f, 0.6f, 1.0f};
};

class PrivateLayer {
 public:
  PrivateLayer(const StreamFormat& format, const StreamOptions& stream, const PrivateLayerOptions& options);

  /// The camera moved: what follows belongs to a new pose.
  void start_pose(Microseconds now);
  void add(const PrivateSet& samples) { current_.merge(samples); }
  /// Forgets the pose before when its time is over. True if it did.
  bool expire(Microseconds now);

  /// Chooses the tiles of the slots anew, and the requests that shade them.
  void reallocate(const AllocationOptions& options, int coarse_level);
  [[nodiscard]] const std::shared_ptr<const std::vector<renderer::ViewTileRequest>>& requests() const {
    return requests_;
  }
  /// New pictures; of tiles that are no longer wanted they are ignored.
  void put(const std::vector<ShadedTile>& tiles);

  /// Nothing to send and nothing sent yet: no need of an encoder.
  [[nodiscard]] bool idle() const { return stream_.last_frame() == 0 && granted_.tiles.empty(); }
  [[nodiscard]] StreamState& stream() { return stream_; }
  [[nodiscard]] const StreamState& stream() const { return stream_; }
  [[nodiscard]] StreamStep step(Microseconds now, Microseconds least_interval = 0);
  [[nodiscard]] std::size_t target_size() const { return target_.tiles.size(); }
  /// Mean over the samples of a picture (those of the sky, too) of the squared display error that is left: of the
  /// pictures of granted tiles, of their coarseness, and of what has none. As tiles were chosen last; 0 before that.
  /// `shown`: what to multiply errors of ViewMaterial::omitted with (view_tone.hpp).
  [[nodiscard]] double squared_error(float shown) const;

 private:
  [[nodiscard]] Allocation allocate(const std::function<bool(TileId)>& available) const;
  void grant();
  [[nodiscard]] std::vector<float> shares() const;

  PrivateLayerOptions options_;
  AllocationOptions allocation_;
  StreamState stream_;
  ImageStore images_;
  PrivateSet current_;
  PrivateSet previous_;
  Microseconds moved_at_ = 0;
  int coarse_level_ = 0;
  std::vector<WeightedChain> chains_;  // weights: worth as a share of the picture
  std::vector<float> chain_shares_;    // share of the picture, parallel
  std::vector<float> chain_squares_;   // squared error of lacking it, times that share
  std::vector<ChainLoss> losses_;
  Allocation target_;
  Allocation granted_;
  double share_sum_ = 1;  // of the poses whose samples the shares are of
  std::shared_ptr<const std::vector<renderer::ViewTileRequest>> requests_;
};

}  // namespace darm::tile_scheduler

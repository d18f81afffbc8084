// How finely a stream is coded: as finely as its light deserves. Pure.
#pragma once

#include <cstddef>

#include "actors/types/frame_stamps.hpp"

namespace darm::encoder {

/// Rate factor of the next frame from the estimated display error of what is shown. The codec's own error should be
/// well under half of that: less is bytes for nobody, more hides light that was paid for. A key frame is coded at the
/// coarsest, so that somebody who joins sees something soon. From there quality rises by steps, none sooner than
/// `kStepInterval` after the one before, so that no single frame holds up the link. Where a link can take only so many
/// bytes, what is larger makes the next coarser, by as much as the size of a picture follows the rate factor, and what
/// is much smaller makes it finer again, step by step.
class CodecQuality {
 public:
  /// Rate factors, 0 (lossless) .. 51, `finest` <= `coarsest` (else it is taken for it).
  CodecQuality(float coarsest, float finest);

  /// For a frame made at `now`. `error`: estimated RMS display error, 0..1; 0 or less, NaN: not known, coarsest.
  /// `most_bytes`: that the frame should have, 0: any number.
  float next(bool key, float error, Microseconds now, std::size_t most_bytes = 0);
  /// The frame of the last next() came to so many bytes.
  void coded(std::size_t bytes, Microseconds now);
  /// It was a key frame and by far too large: coded again with the next next() it will not be.
  [[nodiscard]] bool too_large() const { return too_large_; }
  /// Bytes, not light, say how coarse frames are.
  [[nodiscard]] bool limited() const { return extra_ > 0; }
  /// False: another frame of the same picture would be finer.
  [[nodiscard]] bool settled() const { return wish_ > now_at_ - kStep && !limited(); }

  static constexpr float kCoarsest = 44;
  static constexpr float kStep = 2;
  static constexpr Microseconds kStepInterval = 700'000;

 private:
  [[nodiscard]] float wish_for(float error) const;
  void coarsen(double times);
  struct Coded {
    float at = 0;
    std::size_t bytes = 0;  // 0: none yet
  };
  float coarsest_;
  float finest_;
  float now_at_;
  float wish_;
  Microseconds stepped_at_ = 0;
  float extra_ = 0;  // what a limit of bytes adds
  Microseconds eased_at_ = 0;
  bool key_ = false;            // the frame of the last next(),
  std::size_t most_bytes_ = 0;  // what it may have,
  float coded_at_ = 0;
  bool too_large_ = false;
  Coded last_key_;
};

}  // namespace darm::encoder

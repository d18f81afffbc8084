// How finely a stream is coded: as finely as its light deserves. Pure.
#pragma once

#include "actors/types/frame_stamps.hpp"

namespace darm::encoder {

/// Rate factor of the next frame from the estimated display error of what is shown. The codec's own error should be
/// well under half of that: less is bytes for nobody, more hides light that was paid for. A key frame is coded at the
/// coarsest, so that somebody who joins sees something soon. From there quality rises by steps, none sooner than
/// `kStepInterval` after the one before, so that no single frame holds up the link.
class CodecQuality {
 public:
  /// Rate factors, 0 (lossless) .. 51, `finest` <= `coarsest` (else it is taken for it).
  CodecQuality(float coarsest, float finest);

  /// For a frame made at `now`. `error`: estimated RMS display error, 0..1; 0 or less, NaN: not known, coarsest.
  float next(bool key, float error, Microseconds now);
  /// False: another frame of the same picture would be finer.
  [[nodiscard]] bool settled() const { return wish_ > now_at_ - kStep; }

  static constexpr float kStep = 2;
  static constexpr Microseconds kStepInterval = 700'000;

 private:
  [[nodiscard]] float wish_for(float error) const;
  float coarsest_;
  float finest_;
  float now_at_;
  float wish_;
  Microseconds stepped_at_ = 0;
};

}  // namespace darm::encoder

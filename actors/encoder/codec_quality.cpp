#include "actors/encoder/codec_quality.hpp"

#include <algorithm>
#include <cmath>

namespace darm::encoder {
namespace {

// x264 at this rate factor is off by this display RMS in a picture that still changes here and there (0.0064 to 0.0068
// on three views at q = 128); six steps of the factor halve the quantiser, and so the error.
constexpr float kMeasuredAt = 18.0f;
constexpr float kMeasuredError = 0.0064f;
constexpr float kShare = 0.375f;  // of the light's estimated error

}  // namespace

CodecQuality::CodecQuality(float coarsest, float finest)
    : coarsest_(coarsest), finest_(std::min(finest, coarsest)), now_at_(coarsest), wish_(coarsest) {}

float CodecQuality::wish_for(float error) const {
  if (!(error > 0)) return coarsest_;
  const float wish = kMeasuredAt + 6.0f * std::log2(kShare * error / kMeasuredError);
  return std::clamp(wish, finest_, coarsest_);
}

float CodecQuality::next(bool key, float error, Microseconds now) {
  wish_ = wish_for(error);
  if (key || wish_ >= now_at_ + kStep) {
    now_at_ = key ? coarsest_ : wish_;
    stepped_at_ = now;
  } else if (!settled() && now - stepped_at_ >= kStepInterval) {
    now_at_ -= kStep;
    stepped_at_ = now;
  }
  return now_at_;
}

}  // namespace darm::encoder

#include "actors/encoder/codec_quality.hpp"

#include <algorithm>
#include <cmath>

namespace darm::encoder {
namespace {

// x264 at this rate factor is off by this display RMS in a picture that still changes here and there (0.0064 to 0.0068
// on three views at q = 128); six steps of the factor halve the quantiser, and so the error.
constexpr float kMeasuredAt = 18.0f;
constexpr float kMeasuredError = 0.0064f;
constexpr float kShare = 0.375f;   // of the light's estimated error
constexpr double kHalving = 6;     // of the rate factor: half the bytes
constexpr double kTooLarge = 1.3;  // times what a key frame may have: worth coding it again

}  // namespace

CodecQuality::CodecQuality(float coarsest, float finest)
    : coarsest_(coarsest), finest_(std::min(finest, coarsest)), now_at_(coarsest), wish_(coarsest) {}

float CodecQuality::wish_for(float error) const {
  if (!(error > 0)) return coarsest_;
  const float wish = kMeasuredAt + 6.0f * std::log2(kShare * error / kMeasuredError);
  return std::clamp(wish, finest_, coarsest_);
}

void CodecQuality::coarsen(double times) {
  extra_ += static_cast<float>(kHalving * std::log2(times));
  extra_ = std::clamp(extra_, 0.0f, std::max(0.0f, kCoarsest - now_at_));
}

float CodecQuality::next(bool key, float error, Microseconds now, std::size_t most_bytes) {
  wish_ = wish_for(error);
  key_ = key;
  most_bytes_ = most_bytes;
  if (key || wish_ >= now_at_ + kStep) {
    now_at_ = key ? coarsest_ : wish_;
    stepped_at_ = now;
  } else if (!limited() && !settled() && now - stepped_at_ >= kStepInterval) {
    now_at_ -= kStep;
    stepped_at_ = now;
  }
  if (key && most_bytes > 0 && last_key_.bytes > 0) {
    extra_ = last_key_.at - now_at_;
    coarsen(static_cast<double>(last_key_.bytes) / static_cast<double>(most_bytes));
  }
  coded_at_ = std::min(now_at_ + extra_, std::max(kCoarsest, now_at_));
  return coded_at_;
}

void CodecQuality::coded(std::size_t bytes, Microseconds now) {
  too_large_ = false;
  if (key_) last_key_ = {coded_at_, bytes};
  if (most_bytes_ > 0 && bytes > most_bytes_) {
    const double times = static_cast<double>(bytes) / static_cast<double>(most_bytes_);
    too_large_ = key_ && times > kTooLarge && coded_at_ < kCoarsest;
    coarsen(times);
    eased_at_ = now;
  } else if (limited() && (most_bytes_ == 0 || bytes < most_bytes_ / 2) && now - eased_at_ >= kStepInterval) {
    extra_ = std::max(0.0f, extra_ - kStep);
    eased_at_ = now;
  }
}

}  // namespace darm::encoder

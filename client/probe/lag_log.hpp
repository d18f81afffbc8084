// How long each camera took to the picture that was drawn for it, and where that time went.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>
#include <vector>

#include "proto/darm.pb.h"

namespace darm::client::probe {

/// Stages of the way of one frame, in order; each ends where the next one begins.
inline constexpr std::array kLagStages = {
    "overtaken",     // until a newer camera was sent that was answered in its stead
    "network_up",    // from there to the session
    "wait",          // for the tile scheduler to take the view up
    "visibility",    // rays and working set
    "shading_wait",  // until a frame could be planned (the first one waits for light, later ones for the encoder)
    "encoder_wait",  // until the encoder began
    "compose",       // tiles into the picture
    "encode",        // H.264
    "queue",         // in the session's send queue
    "network_down",  // socket and network, until the last byte was here
    "decode_wait",   // until the client took it up
    "decode",        // H.264 and page table
    "display",       // upload and drawing, and what was drawn before it
};
inline constexpr std::size_t kLagStageCount = kLagStages.size();

/// Times of one camera, microseconds: `stages` by the stamps of both ends, `whole` by the client's clock alone.
struct LagSample {
  std::array<std::int64_t, kLagStageCount> stages{};
  std::int64_t whole = 0;
};

/// Pure; `at_us` are of the client's clock and must not decrease. Cameras that are answered without a picture leave
/// no sample.
class LagLog {
 public:
  void camera_sent(std::uint64_t sequence, std::int64_t at_us) { on_the_way_.emplace_back(sequence, at_us); }
  struct Arrival {
    std::int64_t received_us = 0, decode_started_us = 0, decoded_us = 0;
  };
  void picture_decoded(std::uint64_t answers, const wire::Stamps& stamps, const Arrival& arrival);
  void no_change(std::uint64_t answers);
  /// Everything that was decoded by now is on the screen.
  void drawn(std::int64_t at_us);

  /// `clock_ahead`: the server's clock less the client's; parts the way up from the way down, the sum does not change.
  [[nodiscard]] std::vector<LagSample> samples(std::int64_t clock_ahead) const;

 private:
  struct Answered {
    wire::Stamps stamps;
    Arrival arrival;
    std::vector<std::int64_t> sent;  // the cameras that this picture answers
    std::int64_t drawn_us = 0;
  };
  std::deque<std::pair<std::uint64_t, std::int64_t>> on_the_way_;
  std::vector<Answered> answered_;
  std::size_t drawn_ = 0;  // of `answered_`
};

}  // namespace darm::client::probe

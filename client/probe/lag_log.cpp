#include "client/probe/lag_log.hpp"

#include <algorithm>

namespace darm::client::probe {

void LagLog::picture_decoded(std::uint64_t answers, const wire::Stamps& stamps, const Arrival& arrival) {
  Answered answered{stamps, arrival, {}, 0};
  for (; !on_the_way_.empty() && on_the_way_.front().first <= answers; on_the_way_.pop_front())
    answered.sent.push_back(on_the_way_.front().second);
  if (!answered.sent.empty() && stamps.client_sent() > 0 && stamps.sent() > 0) answered_.push_back(std::move(answered));
}

void LagLog::no_change(std::uint64_t answers) {
  while (!on_the_way_.empty() && on_the_way_.front().first <= answers) on_the_way_.pop_front();
}

void LagLog::drawn(std::int64_t at_us) {
  for (; drawn_ < answered_.size(); ++drawn_) answered_[drawn_].drawn_us = at_us;
}

std::vector<LagSample> LagLog::samples(std::int64_t clock_ahead) const {
  std::vector<LagSample> out;
  for (std::size_t i = 0; i < drawn_; ++i) {
    const auto& [s, arrival, sent, drawn_us] = answered_[i];
    // Ends of the stages; a stage whose stamp is missing took no time.
    std::array<std::int64_t, kLagStageCount> ends = {s.client_sent(),
                                                     s.camera_received() - clock_ahead,
                                                     s.view_started() - clock_ahead,
                                                     s.view_ready() - clock_ahead,
                                                     s.composed() - clock_ahead,
                                                     s.encode_started() - clock_ahead,
                                                     s.picture_composed() - clock_ahead,
                                                     s.encoded() - clock_ahead,
                                                     s.sent() - clock_ahead,
                                                     arrival.received_us,
                                                     arrival.decode_started_us,
                                                     arrival.decoded_us,
                                                     drawn_us};
    const std::array<std::int64_t, 8> stamps = {s.camera_received(), s.view_started(),     s.view_ready(), s.composed(),
                                                s.encode_started(),  s.picture_composed(), s.encoded(),    s.sent()};
    for (std::size_t k = 0; k < stamps.size(); ++k)
      if (stamps[k] <= 0) ends[k + 1] = ends[k];
    for (const auto begun : sent) {
      LagSample sample;
      std::int64_t before = begun;
      for (std::size_t k = 0; k < kLagStageCount; ++k) {
        sample.stages[k] = ends[k] - before;
        before = ends[k];
      }
      sample.whole = drawn_us - begun;
      out.push_back(sample);
    }
  }
  return out;
}

}  // namespace darm::client::probe

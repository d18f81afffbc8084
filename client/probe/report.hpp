// What the probe prints: JSON keys are a contract, the text is for people.
#pragma once

#include <optional>
#include <string>

#include "client/core/image_metrics.hpp"
#include "client/probe/probe_session.hpp"

namespace darm::client::probe {

struct Outcome {
  SessionReport session;
  std::optional<PictureScore> score, ceiling;
  std::optional<double> reference_psnr;
  std::optional<CodecScore> codec;
  bool benched = false;
};

[[nodiscard]] std::string to_json(const Outcome& outcome);
[[nodiscard]] std::string to_text(const Outcome& outcome);

}  // namespace darm::client::probe

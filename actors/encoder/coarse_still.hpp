// The coarse level as one H.264 key frame within a budget of bytes.
#pragma once

#include <cstddef>
#include <memory>

#include "actors/encoder/encoder_messages.hpp"
#include "actors/session/session_messages.hpp"
#include "actors/types/error.hpp"

namespace darm::encoder {

struct CoarseStillOptions {
  float crf = 22.0f;
  std::size_t max_bytes = 300'000;
};

/// Encodes at `crf`, then coarser in steps of 4 until it fits `max_bytes` (or crf 46, which is sent whatever its size).
/// The coded picture is padded to even sides of at least 16; width and height are those of the level.
[[nodiscard]] Result<std::shared_ptr<const session::CoarseTexture>> encode_coarse(const CoarsePicture& picture,
                                                                                  const CoarseStillOptions& options);

}  // namespace darm::encoder

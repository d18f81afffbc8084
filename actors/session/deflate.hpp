// DEFLATE in zlib's wrapper: what clients of any kind can unpack.
#pragma once

#include <cstdint>
#include <span>

#include "actors/session/bytes.hpp"

namespace darm::session {

enum class Effort : std::uint8_t {
  kEachFrame,   ///< zlib's own balance
  kOnceAScene,  ///< as small as it gets
};
[[nodiscard]] Bytes deflate(std::span<const std::uint8_t> bytes, Effort effort);

}  // namespace darm::session

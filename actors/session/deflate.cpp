#include "actors/session/deflate.hpp"

#include <zlib.h>

namespace darm::session {

Bytes deflate(std::span<const std::uint8_t> bytes, Effort effort) {
  Bytes out(compressBound(bytes.size()));
  uLongf size = out.size();
  // Cannot fail: the buffer is as large as zlib asks for, and the level is legal.
  compress2(out.data(), &size, bytes.data(), bytes.size(),
            effort == Effort::kEachFrame ? Z_DEFAULT_COMPRESSION : Z_BEST_COMPRESSION);
  out.resize(size);
  return out;
}

}  // namespace darm::session

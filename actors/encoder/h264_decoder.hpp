// What comes back out of a stream: for measuring what the codec costs. Clients have a decoder of their own.
#pragma once

#include <cstdint>
#include <memory>
#include <span>

#include "actors/encoder/h264_encoder.hpp"
#include "actors/types/error.hpp"

namespace darm::encoder {

/// Decodes one stream of H264Encoder. Not thread-safe; may be used from different threads one after another.
class H264Decoder {
 public:
  [[nodiscard]] static Result<std::unique_ptr<H264Decoder>> create();
  ~H264Decoder();
  H264Decoder(const H264Decoder&) = delete;
  H264Decoder& operator=(const H264Decoder&) = delete;

  /// The picture of one packet, at once; its planes are valid until the next call. Errors: damage, a picture that is
  /// not 8-bit 4:2:0 or 4:4:4, or none.
  [[nodiscard]] Result<PlanarPicture> decode(std::span<const std::uint8_t> packet);

 private:
  struct State;
  explicit H264Decoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace darm::encoder

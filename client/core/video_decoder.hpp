// H.264 in, planes out. The only place of the client that sees libav.
#pragma once

#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "client/core/result.hpp"

namespace darm::client {

/// 8-bit planes without padding, visible size only. Chroma is half in both directions (even sizes rounded up) or full.
struct Picture {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool chroma_444 = false;
  std::vector<std::uint8_t> y, cb, cr;
  [[nodiscard]] std::uint32_t chroma_width() const { return chroma_444 ? width : (width + 1) / 2; }
  [[nodiscard]] std::uint32_t chroma_height() const { return chroma_444 ? height : (height + 1) / 2; }
};

/// One decoder per stream, one thread at a time.
class VideoDecoder {
 public:
  /// Streams over max_width * max_height are refused by the decoder before it takes memory for pictures.
  [[nodiscard]] static Result<VideoDecoder> create(std::uint32_t max_width, std::uint32_t max_height);
  VideoDecoder(VideoDecoder&&) noexcept;
  VideoDecoder& operator=(VideoDecoder&&) noexcept;
  ~VideoDecoder();

  /// One access unit (Annex B) in, its picture out, no delay. After an error: reset(), then a key frame.
  [[nodiscard]] Result<void> decode(std::span<const std::uint8_t> packet, Picture& picture);
  void reset();

 private:
  struct State;
  explicit VideoDecoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace darm::client

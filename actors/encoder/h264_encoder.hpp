// H.264 through libavcodec; the only place of the server that sees libav.
#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "actors/types/error.hpp"

namespace darm::encoder {

/// Borrowed planes of a full-range BT.709 picture: Y, Cb, Cr. Chroma planes are half size in both directions (rounded
/// up), or full size if `chroma_444`. Strides in bytes. Valid while the owner of the memory says so.
struct PlanarPicture {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  bool chroma_444 = false;
  const std::uint8_t* plane[3] = {nullptr, nullptr, nullptr};
  std::size_t stride[3] = {0, 0, 0};
};

struct H264Settings {
  std::uint32_t width = 0;           ///< even, 16..8192
  std::uint32_t height = 0;          ///< even, 16..8192
  bool chroma_444 = false;           ///< High 4:4:4 Predictive instead of High
  float crf = 16.0f;                 ///< 0 (lossless) .. 51; quality is constant, bytes follow
  std::string preset = "superfast";  ///< x264 preset; `ultrafast` has no adaptive quantisation
  std::string codec = "libx264";     ///< a libavcodec encoder by name; libx264 if it is not there or will not open
  unsigned threads = 1;              ///< more cut the picture into slices: no frame of delay, some more bytes
  float frames_per_second = 10.0f;   ///< what level and rate control are told; > 0
};

/// One H.264 stream: no B-frames, no frame of delay, no key frame but those asked for (the first is one). Colour is
/// signalled in the VUI: full range, BT.709 primaries and matrix, sRGB transfer, centre-sited chroma.
/// Not thread-safe; may be used from different threads one after another.
class H264Encoder {
 public:
  [[nodiscard]] static Result<std::unique_ptr<H264Encoder>> create(const H264Settings& settings);
  ~H264Encoder();
  H264Encoder(const H264Encoder&) = delete;
  H264Encoder& operator=(const H264Encoder&) = delete;

  /// Annex B bytes of one picture, parameter sets in front of a key frame (IDR). `picture` must have the size and
  /// chroma of the settings; it is read during the call only. After an error make a new encoder.
  [[nodiscard]] Result<std::vector<std::uint8_t>> encode(const PlanarPicture& picture, bool key);

  /// Changes quality from the next picture on. libx264 only; others keep what they were made with.
  void set_crf(float crf);

  /// The libavcodec encoder in use.
  [[nodiscard]] const std::string& codec_name() const;

 private:
  struct State;
  explicit H264Encoder(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

}  // namespace darm::encoder

// How an H.264 access unit begins, without decoding it. Pure.
#pragma once

#include <string_view>

namespace darm::client::load {

/// What a frame of Annex B says of itself by its first units.
enum class PictureStart : unsigned char {
  kKey,    ///< sequence and picture parameters, then a slice of an IDR picture
  kDelta,  ///< a slice that builds on pictures before
  kOther,  ///< anything else: no start code, parameters without IDR, IDR without parameters, nothing
};

/// Looks at units up to the first slice (ITU-T H.264, 7.3.1 and annex B). Access unit delimiters and supplemental
/// information may come before it.
[[nodiscard]] PictureStart picture_start(std::string_view annex_b);

}  // namespace darm::client::load

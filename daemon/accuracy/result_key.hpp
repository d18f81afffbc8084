// What a measurement depends on, as its key. Pure.
#pragma once

#include <cstdint>
#include <string>

#include "actors/types/camera.hpp"
#include "daemon/accuracy/variants.hpp"

namespace darm::accuracy {

/// Bumped when the same variant would be measured in another way: earlier results are then not used.
inline constexpr int kMethodVersion = 1;
/// The same for codec variants alone.
inline constexpr int kCodecMethodVersion = 2;

struct KeyParts {
  std::uint64_t scene_hash = 0;
  float exposure = 1;
  Camera camera;
  Viewport viewport;
  unsigned threads = 1;
  double reference_psnr = 0;
};

/// 16 hexadecimal digits of everything that the result of a variant depends on.
[[nodiscard]] std::string result_key(const KeyParts& parts, const Variant& variant);

}  // namespace darm::accuracy

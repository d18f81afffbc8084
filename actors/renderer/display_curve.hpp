// Linear light to display codes: sRGB by table, and BT.709 planes for the codec.
#pragma once

#include <cstdint>

#include "actors/types/tile_image.hpp"

namespace darm::renderer {

/// 8-bit sRGB code of a linear value, exactly round(255 * sRGB(clamp(x, 0, 1))) with IEC 61966-2-1's curve; NaN gives
/// 0. No pow: a look-up and one comparison.
[[nodiscard]] std::uint8_t srgb_code(float linear);

/// sRGB(clamp(x, 0, 1)), 0..1, within 5e-5; NaN gives 0. Monotone, and without pow: straight between codes.
[[nodiscard]] float srgb(float linear);

/// Slope of the sRGB curve (display units 0..1 per linear unit) around a code; 0 at code 255, where display is clamped.
[[nodiscard]] float srgb_slope(std::uint8_t code);

/// Fills y, cb, cr from rgb: full-range BT.709, chroma of each 2x2 block from its mean colour (centre-sited).
void convert_to_planes(TileImage& image);

}  // namespace darm::renderer

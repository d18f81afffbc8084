// Keeps rare bright samples from being smeared into spots while there are too few samples to average them away.
#pragma once

#include "actors/renderer/filter_window.hpp"

namespace darm::renderer {

/// Samples from which a texel is left as it is.
inline constexpr float kOutlierSamples = 1024;

/// How many times the mean of its neighbours (5x5, same patch, itself left out) a texel of `count` samples may shine:
/// 2 + 24 / count + count / 64. One sample may be many times the mean and still be what light is like there (a window
/// that one direction in twenty meets): held to twice its neighbours it costs Sponza's atrium 4 dB. In the limit
/// nothing is held down; what is held down meanwhile is shared out in the picture as far as it is to be trusted, and
/// the store knows nothing of it.
[[nodiscard]] float outlier_bound(float count);

/// How much of what was taken from a patch's texels in a window is shared out, 0..1. What one texel lost says little of
/// the others, and in full it would show as a bright square: it may at most double their light. `taken`, `squares`: sum
/// of what texels lost, and of its squares; `left`: sum of what all of the patch have left. With n texels that lost
/// alike: 1 - 1 / n, and left / taken. Doubles: of one texel's 1 - squares / taken^2 is to be nothing, not a rounding
/// error that is much beside `left`.
[[nodiscard]] float share_to_trust(double taken, double squares, double left);

/// Scales texels brighter than their bound down to it, irradiance, grey and spread alike, and says how much that was.
/// What was taken goes to all texels of the patch in the window alike, as far as it is to be trusted: where many lost
/// something the mean stays.
void tame_outliers(FilterWindow& window);

}  // namespace darm::renderer

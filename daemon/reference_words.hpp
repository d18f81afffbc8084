// How far a reference picture is, in words. Pure.
#pragma once

#include <string>

#include "actors/renderer/reference_renderer.hpp"

namespace darm {

/// A picture's own PSNR is given up to here: what is beyond is no noise that anybody could see or measure.
inline constexpr double kMostDecibels = 100;

/// "31.20 dB", "over 100 dB".
[[nodiscard]] std::string decibel_words(double psnr);

/// "24 of 64 samples per pixel, own PSNR 31.20 dB, 12 s"; without the PSNR until one has been measured (a run that was
/// taken up again looks later), and without a number of samples that nobody asked for (`most` or more).
[[nodiscard]] std::string reference_words(const renderer::ReferenceProgress& progress, std::uint32_t most);

}  // namespace darm

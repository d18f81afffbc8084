#include "daemon/reference_words.hpp"

#include <fmt/format.h>

namespace darm {

std::string decibel_words(double psnr) {
  return psnr >= kMostDecibels ? fmt::format("over {:.0f} dB", kMostDecibels) : fmt::format("{:.2f} dB", psnr);
}

std::string reference_words(const renderer::ReferenceProgress& progress, std::uint32_t most) {
  std::string out = std::to_string(progress.spp);
  if (progress.target_spp < most) out += " of " + std::to_string(progress.target_spp);
  out += " samples per pixel";
  if (progress.own_psnr > 0) out += ", own PSNR " + decibel_words(progress.own_psnr);
  return out + fmt::format(", {:.0f} s", progress.seconds);
}

}  // namespace darm

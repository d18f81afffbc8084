// Pictures in memory, as PNG and as PFM. Files are foreign: sizes are checked before memory is taken.
#pragma once

#include <cstdint>
#include <filesystem>
#include <vector>

#include "client/core/result.hpp"

namespace darm::client {

/// RGB, 8-bit sRGB, top row first.
struct Image8 {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<std::uint8_t> rgb;
};

/// RGB, linear, display-referred (1.0 is display white), top row first.
struct ImageF {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<float> rgb;
};

/// Most pixels of a picture file that is read.
inline constexpr std::uint64_t kMaxFilePixels = 64ull << 20;

[[nodiscard]] Result<void> write_png(const std::filesystem::path& path, const Image8& image);
[[nodiscard]] Result<Image8> read_png(const std::filesystem::path& path);
/// Colour PFM ("PF"), either byte order, rows stored bottom first.
[[nodiscard]] Result<ImageF> read_pfm(const std::filesystem::path& path);
[[nodiscard]] Result<void> write_pfm(const std::filesystem::path& path, const ImageF& image);

}  // namespace darm::client

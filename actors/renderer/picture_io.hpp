// Pictures on disk: PNG for eyes, PFM for measuring.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <vector>

#include "actors/types/error.hpp"

namespace darm::renderer {

/// Linear RGB, row-major, top row first; pixels.size() == width * height.
struct Picture {
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::vector<glm::vec3> pixels;
};

/// 8-bit sRGB PNG of display-referred linear values, clamped to [0, 1]. Errors: the path cannot be written.
[[nodiscard]] Result<void> write_png(const std::filesystem::path& path, const Picture& picture);

/// Little-endian colour PFM (bottom row first, as the format has it). Errors: the path cannot be written.
[[nodiscard]] Result<void> write_pfm(const std::filesystem::path& path, const Picture& picture);

/// Reads a colour or grey PFM of either byte order, at most 16384 pixels a side. The header is judged and the file's
/// size compared before memory is taken. Values are as in the file, NaN included.
[[nodiscard]] Result<Picture> read_pfm(const std::filesystem::path& path);

}  // namespace darm::renderer

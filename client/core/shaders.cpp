#include "client/core/shaders.hpp"

#include <algorithm>
#include <cmath>

#include "client/core/shader_text.hpp"

namespace darm::client {
namespace {}  // namespace

std::string surface_vertex_source(bool view) {
  return std::string(shader_text::kHeader) + (view ? "#define VIEW\n" : "") + shader_text::kSurfaceVertex;
}

std::string surface_fragment_source(const SurfaceVariant& variant) {
  std::string source = shader_text::kHeader;
  if (variant.lossless) source += "#define LOSSLESS\n";
  if (variant.mask) source += "#define MASK\n";
  if (variant.blend) source += "#define BLEND\n";
  if (variant.linear) source += "#define LINEAR\n";
  if (variant.stats) source += "#define STATS\n";
  if (variant.view) source += "#define VIEW\n";
  if (variant.through) source += "#define THROUGH\n";
  return source + shader_text::kSurfaceInputs + shader_text::kColour + shader_text::kSurface;
}

std::string depth_fragment_source() { return std::string(shader_text::kHeader) + "void main() {}\n"; }

std::string fullscreen_vertex_source() { return std::string(shader_text::kHeader) + shader_text::kFullscreenVertex; }

std::string background_fragment_source(bool linear, bool stats) {
  std::string source = shader_text::kHeader;
  if (linear) source += "#define LINEAR\n";
  if (stats) source += "#define STATS\n";
  return source + shader_text::kColour + shader_text::kBackground;
}

std::string resolve_fragment_source(bool linear) {
  std::string source = shader_text::kHeader;
  if (linear) source += "#define LINEAR\n";
  return source + shader_text::kColour + shader_text::kResolve;
}

int sharp_level(const float dx[2], const float dy[2], int levels) {
  const float f = dx[0] * dx[0] + dx[1] * dx[1] + dy[0] * dy[0] + dy[1] * dy[1];
  const float d = std::abs(dx[0] * dy[1] - dx[1] * dy[0]);
  const float major = std::sqrt(0.5f * (f + std::sqrt(std::max(f * f - 4.0f * d * d, 0.0f))));
  const float minor = d / std::max(major, 1e-20f);
  return std::clamp(static_cast<int>(std::floor(std::log2(std::max(minor, 1e-6f)))), 0, levels - 1);
}

}  // namespace darm::client

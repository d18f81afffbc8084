#include "tests/bench/darm_bench/frame_tracing.hpp"

#include <algorithm>
#include <cmath>

namespace darm::bench {

namespace {

client::Image8 shown(const renderer::Picture& picture) {
  client::Image8 out{picture.width, picture.height, {}};
  out.rgb.reserve(picture.pixels.size() * 3);
  for (const auto& p : picture.pixels)
    for (int c = 0; c < 3; ++c) {
      const float x = std::clamp(p[c], 0.0f, 1.0f);
      const float s = x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f;
      out.rgb.push_back(static_cast<std::uint8_t>(std::lround(255.0f * s)));
    }
  return out;
}

}  // namespace

client::ImageF to_image(const renderer::Picture& picture) {
  client::ImageF out{picture.width, picture.height, {}};
  out.rgb.reserve(picture.pixels.size() * 3);
  for (const auto& p : picture.pixels) out.rgb.insert(out.rgb.end(), {p.x, p.y, p.z});
  return out;
}

Result<std::vector<FramePoint>> trace_frames(const renderer::LightTransport& transport, renderer::ReferenceJob job,
                                             const client::Reference& reference, double target,
                                             std::uint32_t most_spp) {
  std::vector<FramePoint> points;
  const auto state = std::filesystem::temp_directory_path() / "darm-bench-frames.bin";
  std::filesystem::remove(state);
  job.state_file = state;
  job.save_seconds = 1e9;  // only at the end, outside the measured time
  job.until_psnr.reset();
  for (std::uint32_t spp = 2; spp <= most_spp; spp += std::max(2u, spp / 4 / 2 * 2)) {
    job.spp = spp;
    const auto made = renderer::render_reference(transport, job);
    if (!made) return std::unexpected(made.error());
    const auto note = [&](const renderer::Picture& picture, double seconds, double samples) -> Result<void> {
      const auto score = client::compare(shown(picture), reference);
      if (!score) return fail(score.error().message);
      points.push_back({seconds, samples, score->psnr});
      return {};
    };
    if (spp == 2)
      if (auto ok = note(made->half_a, made->seconds / 2, 1); !ok) return std::unexpected(ok.error());
    if (auto ok = note(made->mean, made->seconds, spp); !ok) return std::unexpected(ok.error());
    if (points.back().psnr >= target) break;
  }
  std::filesystem::remove(state);
  return points;
}

std::optional<double> time_to(const std::vector<FramePoint>& points, double target) {
  for (std::size_t i = 0; i < points.size(); ++i) {
    if (points[i].psnr < target) continue;
    if (i == 0) return points[0].seconds;
    const auto& a = points[i - 1];
    const auto& b = points[i];
    const double share = (target - a.psnr) / std::max(b.psnr - a.psnr, 1e-9);
    return a.seconds * std::pow(b.seconds / a.seconds, share);
  }
  return std::nullopt;
}

}  // namespace darm::bench

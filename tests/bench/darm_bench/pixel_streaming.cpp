#include "tests/bench/darm_bench/pixel_streaming.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>

#include "actors/atlas/parallel.hpp"
#include "actors/encoder/h264_decoder.hpp"
#include "actors/encoder/h264_encoder.hpp"
#include "actors/encoder/yuv_convert.hpp"
#include "actors/renderer/sampler.hpp"
#include "daemon/accuracy/client_state.hpp"

namespace darm::bench {

namespace {

using Clock = std::chrono::steady_clock;

std::uint8_t srgb_code(float linear) {
  const float x = std::clamp(linear, 0.0f, 1.0f);
  return static_cast<std::uint8_t>(
      std::lround(255.0f * (x <= 0.0031308f ? 12.92f * x : 1.055f * std::pow(x, 1.0f / 2.4f) - 0.055f)));
}

// One client's side of the server, and its decoder.
class Client {
 public:
  static Result<Client> create(const renderer::ReferenceJob& job, float crf) {
    Client made(job);
    encoder::H264Settings settings;
    settings.width = job.viewport.width;
    settings.height = job.viewport.height;
    settings.crf = crf;
    settings.threads = job.threads;
    auto coder = encoder::H264Encoder::create(settings);
    if (!coder) return std::unexpected(coder.error());
    auto decoder = encoder::H264Decoder::create();
    if (!decoder) return std::unexpected(decoder.error());
    made.encoder_ = std::move(*coder);
    made.decoder_ = std::move(*decoder);
    return made;
  }

  /// One more sample a pixel, and its picture, coded.
  Result<std::vector<std::uint8_t>> update(const renderer::LightTransport& transport) {
    const auto& v = job_.viewport;
    const glm::vec3 eye(job_.camera.position - transport.rays().scene().origin);
    ++passes_;
    atlas::parallel_for(v.height, job_.threads, [&](std::size_t y) {
      const renderer::trace::DenormalsAreZero denormals;
      for (std::uint32_t x = 0; x < v.width; ++x) {
        renderer::Sampler sampler(job_.seed_a, renderer::hash_pair(x, static_cast<std::uint32_t>(y)), passes_);
        const glm::vec2 jitter = sampler.next_2d();
        renderer::trace::Ray ray;
        ray.origin = eye;
        ray.direction =
            ray_direction(job_.camera, v, static_cast<float>(x) + jitter.x, static_cast<float>(y) + jitter.y);
        const std::size_t at = y * v.width + x;
        sums_[at] += transport.view_independent_radiance(ray, sampler) * job_.exposure;
        for (int c = 0; c < 3; ++c)
          rgb_[at * 3 + static_cast<std::size_t>(c)] = srgb_code(sums_[at][c] / static_cast<float>(passes_));
      }
    });
    const auto planes = encoder::to_yuv420(rgb_, v.width, v.height);
    return encoder_->encode(planes.view(), passes_ == 1);
  }

  /// What the client sees of it.
  Result<double> score(std::span<const std::uint8_t> packet, const client::Reference& reference,
                       const atlas::Layout& layout) {
    const auto decoded = decoder_->decode(packet);
    if (!decoded) return std::unexpected(decoded.error());
    const auto& v = job_.viewport;
    accuracy::ClientState shown(layout, kSlotSize);  // for its looks at a picture
    shown.set_coarse(accuracy::DecodedPlanes::copy(*decoded), v.width, v.height);
    client::Image8 image{v.width, v.height, std::vector<std::uint8_t>(std::size_t{v.width} * v.height * 3)};
    for (std::uint32_t y = 0; y < v.height; ++y)
      for (std::uint32_t x = 0; x < v.width; ++x) {
        const glm::vec3 c = shown.coarse_colour({static_cast<float>(x) + 0.5f, static_cast<float>(y) + 0.5f});
        for (int i = 0; i < 3; ++i)
          image.rgb[(std::size_t{y} * v.width + x) * 3 + static_cast<std::size_t>(i)] =
              static_cast<std::uint8_t>(std::lround(c[i] * 255.0f));
      }
    const auto score = client::compare(image, reference);
    if (!score) return fail(score.error().message);
    return score->psnr;
  }

  /// Keeps the decoder up with what is not scored.
  Result<void> skip(std::span<const std::uint8_t> packet) {
    const auto decoded = decoder_->decode(packet);
    if (!decoded) return std::unexpected(decoded.error());
    return {};
  }

 private:
  explicit Client(const renderer::ReferenceJob& job)
      : job_(job),
        sums_(std::size_t{job.viewport.width} * job.viewport.height, glm::vec3(0.0f)),
        rgb_(sums_.size() * 3) {}

  renderer::ReferenceJob job_;
  std::vector<glm::vec3> sums_;
  std::vector<std::uint8_t> rgb_;
  std::uint32_t passes_ = 0;
  std::unique_ptr<encoder::H264Encoder> encoder_;
  std::unique_ptr<encoder::H264Decoder> decoder_;
};

bool all_done(const PixelStreamingRun& run, double target) {
  return std::all_of(run.clients.begin(), run.clients.end(),
                     [&](const PixelClient& c) { return !c.series.empty() && c.series.back().psnr >= target; });
}

}  // namespace

Result<PixelStreamingRun> stream_pixels(const renderer::LightTransport& transport,
                                        std::span<const renderer::ReferenceJob> jobs,
                                        std::span<const client::Reference> references, const atlas::Layout& layout,
                                        const PixelStreamingOptions& options) {
  std::vector<Client> clients;
  for (const auto& job : jobs) {
    auto made = Client::create(job, options.crf);
    if (!made) return std::unexpected(made.error());
    clients.push_back(std::move(*made));
  }
  PixelStreamingRun run;
  run.clients.resize(jobs.size());
  while (!all_done(run, options.target_db) && run.seconds < options.most_seconds) {
    for (std::size_t i = 0; i < clients.size(); ++i) {
      auto& figures = run.clients[i];
      const auto began = Clock::now();
      const auto packet = clients[i].update(transport);
      run.seconds += std::chrono::duration<double>(Clock::now() - began).count();
      if (!packet) return std::unexpected(packet.error());
      figures.bytes += packet->size();
      const auto n = ++figures.updates;
      if (n > 8 && n % std::max<std::uint64_t>(1, n / 16) != 0) {
        if (auto ok = clients[i].skip(*packet); !ok) return std::unexpected(ok.error());
        continue;
      }
      const auto psnr = clients[i].score(*packet, references[i], layout);
      if (!psnr) return std::unexpected(psnr.error());
      figures.series.push_back({run.seconds, *psnr, figures.bytes});
    }
  }
  return run;
}

std::optional<PixelPoint> point_at(const PixelClient& client, double target) {
  const auto at =
      std::find_if(client.series.begin(), client.series.end(), [&](const PixelPoint& p) { return p.psnr >= target; });
  return at == client.series.end() ? std::nullopt : std::optional(*at);
}

}  // namespace darm::bench

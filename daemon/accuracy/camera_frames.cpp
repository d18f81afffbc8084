#include "daemon/accuracy/camera_frames.hpp"

#include <algorithm>
#include <ctime>
#include <system_error>
#include <utility>

namespace darm::accuracy {
namespace {

constexpr std::uint32_t kMostSamples = 4096;

double processor_seconds() {
  timespec t{};
  ::clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

// Removes the sums of a picture when the run is over, however it ends.
class TemporaryFile {
 public:
  explicit TemporaryFile(std::filesystem::path path) : path_(std::move(path)) { remove(); }
  ~TemporaryFile() { remove(); }
  TemporaryFile(const TemporaryFile&) = delete;
  TemporaryFile& operator=(const TemporaryFile&) = delete;

 private:
  void remove() const {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  std::filesystem::path path_;
};

}  // namespace

Result<TracedFrames> trace_frames(const renderer::LightTransport& transport, renderer::ReferenceJob job,
                                  const ShownHalves& reference, const PixelMask& counted, double seconds,
                                  const std::filesystem::path& file, const KeepGoing& keep_going,
                                  const std::function<void(double)>& progress) {
  const TemporaryFile sums(file);
  job.state_file = file;
  job.save_seconds = 1e9;  // only at the end, outside the measured time
  job.until_psnr.reset();
  job.progress = [&](const renderer::ReferenceProgress& p) {
    if (progress) progress(std::min(p.seconds, seconds));
    return !keep_going || keep_going();
  };
  TracedFrames out;
  const auto note = [&](const renderer::Picture& picture, double at, double samples) {
    if (out.curve.empty() || at > out.curve.back().seconds)
      out.curve.push_back({at, psnr_to(picture, reference, counted), samples});
  };
  for (std::uint32_t spp = 2; spp <= kMostSamples; spp += std::max(2u, spp / 4 / 2 * 2)) {
    job.spp = spp;
    const auto made = renderer::render_reference(transport, job);
    if (!made) return std::unexpected(made.error());
    out.stopped = made->stopped;
    if (out.stopped) return out;
    if (spp == 2) note(made->half_a, made->seconds / 2, 1);
    note(made->mean, made->seconds, spp);
    if (made->seconds >= seconds) break;
  }
  return out;
}

Result<TracedHalves> trace_halves(const renderer::LightTransport& transport, renderer::ReferenceJob job,
                                  std::uint32_t spp, const KeepGoing& keep_going) {
  job.state_file.clear();
  job.until_psnr.reset();
  job.spp = spp;
  job.progress = [&](const renderer::ReferenceProgress&) { return !keep_going || keep_going(); };
  const double began = processor_seconds();
  auto made = renderer::render_reference(transport, job);
  if (!made) return std::unexpected(made.error());
  const double spent = (processor_seconds() - began) / std::max(job.threads, 1u);
  TracedHalves out;
  out.stopped = made->stopped;
  out.spp = made->spp;
  out.seconds_per_sample = made->spp > 0 ? spent / made->spp : 0;
  out.halves = {std::move(made->half_a), std::move(made->half_b)};
  return out;
}

}  // namespace darm::accuracy

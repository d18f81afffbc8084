#include "actors/renderer/reference_renderer.hpp"

#include <algorithm>
#include <atomic>
#include <bit>
#include <chrono>
#include <cmath>
#include <limits>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "actors/renderer/reference_state.hpp"

namespace darm::renderer {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

double exact_srgb(double x) {
  x = std::max(x, 0.0);
  return x <= 0.0031308 ? 12.92 * x : 1.055 * std::pow(x, 1 / 2.4) - 0.055;
}

class JobHash {
 public:
  template <class T>
  void add(const T& value) {
    static_assert(std::is_arithmetic_v<T>);
    std::uint64_t word = 0;
    if constexpr (std::is_floating_point_v<T>)
      word = std::bit_cast<std::uint64_t>(static_cast<double>(value));
    else
      word = static_cast<std::uint64_t>(value);
    state_ = std::rotl((state_ ^ word) * 0x9e3779b97f4a7c15ull, 31) ^ (state_ >> 17);
  }
  [[nodiscard]] std::uint64_t value() const { return state_; }

 private:
  std::uint64_t state_ = 0x6461726d72656631ull;
};

}  // namespace

std::uint64_t reference_hash(const LightTransport& transport, const ReferenceJob& job) {
  JobHash hash;
  const auto& scene = transport.rays().scene();
  hash.add(scene.hash);
  for (int i = 0; i < 3; ++i) hash.add(job.camera.position[i]);
  hash.add(job.camera.orientation.w);
  hash.add(job.camera.orientation.x);
  hash.add(job.camera.orientation.y);
  hash.add(job.camera.orientation.z);
  hash.add(job.camera.fovy);
  hash.add(job.viewport.width);
  hash.add(job.viewport.height);
  hash.add(job.exposure);
  hash.add(static_cast<int>(job.effects));
  hash.add(job.seed_a);
  hash.add(job.seed_b);
  return hash.value();
}

namespace {

void render_row(const LightTransport& transport, const ReferenceJob& job, ReferenceState& state, std::uint32_t y) {
  const glm::vec3 eye(job.camera.position - transport.rays().scene().origin);
  for (int half = 0; half < 2; ++half) {
    for (std::uint32_t x = 0; x < state.width; ++x) {
      Sampler sampler(half == 0 ? job.seed_a : job.seed_b, hash_pair(x, y), state.passes);
      const glm::vec2 jitter = sampler.next_2d();
      trace::Ray ray;
      ray.origin = eye;
      ray.direction =
          ray_direction(job.camera, job.viewport, static_cast<float>(x) + jitter.x, static_cast<float>(y) + jitter.y);
      const glm::vec3 light = job.effects == PictureEffects::kFull ? transport.full_radiance(ray, sampler)
                                                                   : transport.view_independent_radiance(ray, sampler);
      const std::size_t quarter = (jitter.x >= 0.5f ? 1u : 0u) + (jitter.y >= 0.5f ? 2u : 0u);
      const std::size_t pixel = std::size_t{y} * state.width + x;
      state.halves[static_cast<std::size_t>(half)][pixel * kQuarters + quarter].add(light * job.exposure);
    }
  }
}

void render_pass(const LightTransport& transport, const ReferenceJob& job, ReferenceState& state) {
  std::atomic<std::uint32_t> next_row{0};
  const auto work = [&] {
    const trace::DenormalsAreZero denormals;
    for (std::uint32_t y = next_row++; y < state.height; y = next_row++) render_row(transport, job, state, y);
  };
  std::vector<std::jthread> others;
  for (unsigned i = 1; i < std::max(job.threads, 1u); ++i) others.emplace_back(work);
  work();
  others.clear();  // joins
  ++state.passes;
}

// What went wrong with the file of the sums is said once: it costs time if the run is cut off, never the picture.
class StateFile {
 public:
  explicit StateFile(const ReferenceJob& job) : job_(job) {}

  void load(ReferenceState& state) {
    std::error_code error;
    if (job_.state_file.empty() || !std::filesystem::exists(job_.state_file, error)) return;
    if (const auto loaded = load_state(job_.state_file, state); !loaded)
      warn(loaded.error().message + "; the picture is begun anew");
  }
  void save(const ReferenceState& state) {
    if (job_.state_file.empty()) return;
    if (const auto saved = save_state(job_.state_file, state); !saved)
      warn(saved.error().message + "; the picture cannot be taken up again later");
  }

 private:
  void warn(const std::string& what) {
    if (!std::exchange(warned_, true) && job_.warn) job_.warn(what);
  }
  const ReferenceJob& job_;
  bool warned_ = false;
};

// Looking costs a little: eight looks per doubling, at passes that do not depend on where a run began.
bool is_time_to_look(std::uint32_t passes) { return passes % std::max(1u, std::bit_floor(passes) / 8) == 0; }

}  // namespace

double psnr_of_mean(const Picture& half_a, const Picture& half_b) {
  double sum = 0;
  const std::size_t n = std::min(half_a.pixels.size(), half_b.pixels.size());
  for (std::size_t i = 0; i < n; ++i)
    for (int c = 0; c < 3; ++c) {
      const double d =
          exact_srgb(static_cast<double>(half_a.pixels[i][c])) - exact_srgb(static_cast<double>(half_b.pixels[i][c]));
      sum += d * d;
    }
  const double mse = n == 0 ? 0 : sum / (3.0 * static_cast<double>(n)) / 4.0;
  return mse > 0 ? -10.0 * std::log10(mse) : std::numeric_limits<double>::infinity();
}

Result<ReferencePicture> render_reference(const LightTransport& transport, const ReferenceJob& job) {
  if (!is_valid(job.camera)) return fail("camera: is not finite or its field of view is out of range");
  if (!is_valid(job.viewport)) return fail("size: must be 1..16384 pixels a side");
  if (!std::isfinite(job.exposure) || job.exposure < 0) return fail("exposure: must be finite and not negative");
  ReferenceState state(reference_hash(transport, job), job.viewport.width, job.viewport.height);
  StateFile file(job);
  file.load(state);

  ReferencePicture made;
  const auto start = Clock::now();
  const double earlier = state.seconds;
  double saved_at = 0;
  const std::uint32_t passes = std::max(1u, job.spp / 2 + job.spp % 2);
  const auto look = [&] { return psnr_of_mean(state.picture(0), state.picture(1)); };
  double psnr = state.passes > 0 && is_time_to_look(state.passes) ? look() : 0;
  const auto good_enough = [&] { return job.until_psnr && state.passes > 1 && psnr >= *job.until_psnr; };
  while (state.passes < passes && !good_enough()) {
    render_pass(transport, job, state);
    state.seconds = earlier + seconds_since(start);
    if (is_time_to_look(state.passes)) psnr = look();
    if (job.progress && !job.progress({2 * state.passes, 2 * passes, psnr, state.seconds})) {
      made.stopped = true;
      break;
    }
    if (seconds_since(start) - saved_at >= job.save_seconds) {
      file.save(state);
      saved_at = seconds_since(start);
    }
  }
  file.save(state);
  made.mean = state.picture(2);
  made.half_a = state.picture(0);
  made.half_b = state.picture(1);
  made.own_psnr = psnr_of_mean(made.half_a, made.half_b);
  made.doubtful_cut = state.doubtful_cut();
  made.spp = 2 * state.passes;
  made.paths = std::uint64_t{state.width} * state.height * made.spp;
  made.seconds = state.seconds;
  return made;
}

}  // namespace darm::renderer

#include "actors/renderer/reference_state.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <fstream>
#include <glm/common.hpp>

namespace darm::renderer {
namespace {

constexpr float kWhite = 1.0f;
constexpr std::uint32_t kMostPasses = 1u << 30;        // of each half
constexpr std::uint64_t kMagic = 0x32464552'4d524144;  // "DARMREF2"

struct Header {
  std::uint64_t magic = kMagic;
  std::uint64_t job_hash = 0;
  std::uint32_t width = 0;
  std::uint32_t height = 0;
  std::uint32_t passes = 0;
  std::uint32_t reserved = 0;
  double seconds = 0;
  std::uint64_t check_sum = 0;
};
static_assert(sizeof(QuarterMean) == 16 && sizeof(Header) == 48);

std::uint64_t check_sum(const ReferenceState& state) {
  std::uint64_t h = 0xcbf29ce484222325ull;
  const auto add = [&h](std::uint64_t word) { h = std::rotl((h ^ word) * 0x9e3779b97f4a7c15ull, 29); };
  add(state.passes);
  add(std::bit_cast<std::uint64_t>(state.seconds));
  for (const auto& half : state.halves)
    for (const auto& q : half) {
      std::array<std::uint64_t, 2> words;
      std::memcpy(words.data(), &q, sizeof q);
      for (const auto w : words) add(w);
    }
  return h;
}

bool is_sound(const ReferenceState& state) {
  const auto finite = [](const QuarterMean& q) { return std::isfinite(q.mean.x + q.mean.y + q.mean.z); };
  return std::isfinite(state.seconds) && state.passes <= kMostPasses &&
         std::ranges::all_of(state.halves, [&](const auto& half) { return std::ranges::all_of(half, finite); });
}

glm::vec3 mean_of(const QuarterMean& a, const QuarterMean& b, float weight_a, float weight_b) {
  return (a.mean * weight_a + b.mean * weight_b) / (weight_a + weight_b);
}

}  // namespace

ReferenceState::ReferenceState(std::uint64_t hash, std::uint32_t picture_width, std::uint32_t picture_height)
    : job_hash(hash), width(picture_width), height(picture_height) {
  for (auto& half : halves) half.resize(std::size_t{width} * height * kQuarters);
}

double ReferenceState::doubtful_cut() const {
  double cut = 0;
  double kept = 0;
  for (std::size_t q = 0; q < halves[0].size(); ++q) {
    const auto& a = halves[0][q];
    const auto& b = halves[1][q];
    if (a.count + b.count == 0) continue;
    const glm::vec3 both = mean_of(a, b, static_cast<float>(a.count), static_cast<float>(b.count));
    for (int c = 0; c < 3; ++c) {
      kept += std::clamp(double{both[c]}, 0.0, double{kWhite});
      if (both[c] > kWhite && std::min(a.mean[c], b.mean[c]) < kWhite) cut += double{both[c]} - double{kWhite};
    }
  }
  return cut > 0 ? cut / (cut + kept) : 0;
}

Picture ReferenceState::picture(int half) const {
  Picture made{width, height, std::vector<glm::vec3>(std::size_t{width} * height)};
  for (std::size_t pixel = 0; pixel < made.pixels.size(); ++pixel) {
    glm::vec3 sum(0.0f);
    float filled = 0;
    for (std::size_t q = pixel * kQuarters; q < (pixel + 1) * kQuarters; ++q) {
      const auto& a = halves[0][q];
      const auto& b = halves[1][q];
      const float wa = half == 1 ? 0.0f : static_cast<float>(a.count);
      const float wb = half == 0 ? 0.0f : static_cast<float>(b.count);
      if (wa + wb <= 0) continue;
      const glm::vec3 both = mean_of(a, b, static_cast<float>(a.count), static_cast<float>(b.count));
      const glm::vec3 own = mean_of(a, b, wa, wb);
      for (int c = 0; c < 3; ++c) sum[c] += both[c] < kWhite ? std::max(own[c], 0.0f) : kWhite;
      filled += 1;
    }
    if (filled > 0) made.pixels[pixel] = sum / filled;
  }
  return made;
}

Result<void> save_state(const std::filesystem::path& path, const ReferenceState& state) {
  auto beside = path;
  beside += ".part";
  Header header;
  header.job_hash = state.job_hash;
  header.width = state.width;
  header.height = state.height;
  header.passes = state.passes;
  header.seconds = state.seconds;
  header.check_sum = check_sum(state);
  std::ofstream file(beside, std::ios::binary | std::ios::trunc);
  file.write(reinterpret_cast<const char*>(&header), sizeof header);
  for (const auto& half : state.halves)
    file.write(reinterpret_cast<const char*>(half.data()),
               static_cast<std::streamsize>(half.size() * sizeof(QuarterMean)));
  file.close();
  std::error_code error;
  if (file) std::filesystem::rename(beside, path, error);
  if (file && !error) return {};
  std::error_code ignored;
  std::filesystem::remove(beside, ignored);
  return fail(path.string() + ": cannot be written; check the folder and the free space");
}

Result<void> load_state(const std::filesystem::path& path, ReferenceState& state) {
  const auto refuse = [&](const char* what) { return fail(path.string() + ": " + what); };
  std::ifstream file(path, std::ios::binary);
  if (!file) return refuse("cannot be read");
  Header header;
  file.read(reinterpret_cast<char*>(&header), sizeof header);
  if (!file || header.magic != kMagic) return refuse("is no state of a reference picture");
  if (header.job_hash != state.job_hash || header.width != state.width || header.height != state.height)
    return refuse("belongs to another picture (scene, camera, size, exposure or effects differ)");
  ReferenceState loaded(state.job_hash, state.width, state.height);
  std::error_code error;
  const auto size = std::filesystem::file_size(path, error);
  const std::size_t bytes = loaded.halves[0].size() * sizeof(QuarterMean);
  if (error || size != sizeof header + 2 * bytes) return refuse("is truncated or has bytes to spare");
  for (auto& half : loaded.halves) file.read(reinterpret_cast<char*>(half.data()), static_cast<std::streamsize>(bytes));
  loaded.passes = header.passes;
  loaded.seconds = header.seconds;
  if (!file || check_sum(loaded) != header.check_sum || !is_sound(loaded)) return refuse("is damaged");
  state = std::move(loaded);
  return {};
}

}  // namespace darm::renderer

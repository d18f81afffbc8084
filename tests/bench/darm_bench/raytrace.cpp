#include "tests/bench/darm_bench/raytrace.hpp"

#include <time.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <functional>
#include <thread>
#include <vector>

#include "actors/renderer/trace/effect_tally.hpp"
#include "tests/bench/darm_bench/ray_recorder.hpp"
#include "tests/bench/lit_view.hpp"

namespace darm::bench {

namespace {

namespace fs = std::filesystem;
using nlohmann::json;

constexpr std::uint32_t kCoarseRounds = 8;
constexpr std::size_t kTilesEach = 24;  // of a slice
constexpr std::uint32_t kRowsEach = 12;
constexpr int kLaterRounds = 2;
constexpr std::uint32_t kLaterPasses = 4;
constexpr std::size_t kReserved = std::size_t{1} << 22;  // rays of one thread in one slice

double thread_seconds() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double wall_seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

struct Spent {
  double processor = 0;  // of all threads together
  double wall = 0;
};

Spent on_threads(unsigned threads, const std::function<void(unsigned)>& work) {
  std::vector<double> seconds(threads);
  const double began = wall_seconds();
  {
    std::vector<std::jthread> crew;
    for (unsigned t = 0; t < threads; ++t)
      crew.emplace_back([&, t] {
        const renderer::trace::DenormalsAreZero denormals;
        const double start = thread_seconds();
        work(t);
        seconds[t] = thread_seconds() - start;
      });
  }
  Spent spent;
  spent.wall = wall_seconds() - began;
  for (const double s : seconds) spent.processor += s;
  return spent;
}

/// Slices of work, and the same rays by the ray library alone right after each.
class Duel {
 public:
  Duel(const BareScene& bare, unsigned threads) : bare_(bare), rays_(threads), threads_(threads) {
    for (auto& rays : rays_) rays.reserve(kReserved);
  }

  /// `work` is called on every thread; together they do one slice. Returns the samples taken by one of them.
  void slice(const std::function<std::uint64_t()>& work) {
    for (auto& rays : rays_) rays.clear();
    std::atomic<std::uint64_t> samples{0};
    const auto before = renderer::effect_counts();
    const Spent ours = on_threads(threads_, [&](unsigned t) {
      const RayRecorder recorder(rays_[t]);
      samples += work();
    });
    const auto after = renderer::effect_counts();
    for (std::size_t i = 0; i < after.size(); ++i) total_.effects[i] += after[i] - before[i];
    std::atomic<std::uint64_t> hits{0};
    const Spent bare = on_threads(threads_, [&](unsigned t) { hits += trace_bare(bare_, rays_[t]); });
    std::uint64_t cast = 0;
    for (const auto& rays : rays_) cast += rays.size();
    if (cast == 0) return;
    total_.rays += cast;
    total_.samples += samples;
    total_.hits += hits;
    total_.ours.processor += ours.processor;
    total_.ours.wall += ours.wall;
    total_.bare.processor += bare.processor;
    total_.bare.wall += bare.wall;
    ratios_.push_back(bare.processor / ours.processor);
  }

  [[nodiscard]] json report() {
    if (ratios_.empty()) return {{"rays", 0}};
    std::sort(ratios_.begin(), ratios_.end());
    const auto rays = static_cast<double>(total_.rays);
    json effects;
    for (std::size_t i = 0; i < total_.effects.size(); ++i)
      effects[renderer::label_of(static_cast<renderer::EffectKind>(i))] = static_cast<double>(total_.effects[i]) / rays;
    return {{"value", rays / total_.ours.processor * threads_},
            {"peer", rays / total_.bare.processor * threads_},
            {"ratio", total_.bare.processor / total_.ours.processor},
            {"quartiles", {ratios_[ratios_.size() / 4], ratios_[ratios_.size() / 2], ratios_[ratios_.size() * 3 / 4]}},
            {"ratio_by_wall_clock", total_.bare.wall / total_.ours.wall},
            {"rays", total_.rays},
            {"rays_per_sample", rays / static_cast<double>(std::max<std::uint64_t>(total_.samples, 1))},
            {"effects_per_ray", effects},
            {"hits", static_cast<double>(total_.hits) / rays}};
  }

  void add(const Duel& other) {
    total_.rays += other.total_.rays;
    total_.samples += other.total_.samples;
    total_.hits += other.total_.hits;
    for (std::size_t i = 0; i < total_.effects.size(); ++i) total_.effects[i] += other.total_.effects[i];
    total_.ours.processor += other.total_.ours.processor;
    total_.ours.wall += other.total_.ours.wall;
    total_.bare.processor += other.total_.bare.processor;
    total_.bare.wall += other.total_.bare.wall;
    ratios_.insert(ratios_.end(), other.ratios_.begin(), other.ratios_.end());
  }

 private:
  struct Total {
    std::uint64_t rays = 0, samples = 0, hits = 0;
    renderer::EffectCounts effects{};
    Spent ours, bare;
  };
  const BareScene& bare_;
  std::vector<RecordedRays> rays_;
  unsigned threads_;
  Total total_;
  std::vector<double> ratios_;
};

struct SeenTile {
  TileId id;
  TexelMask mask;
  std::shared_ptr<const renderer::TileSurface> surface;
};

std::vector<SeenTile> pick_tiles(const LitView& view, const renderer::TileSurfaces& surfaces, std::size_t most) {
  const auto masks = wanted_texels(view);
  std::vector<TileId> ids;
  for (const auto& [id, mask] : masks) ids.push_back(id);
  std::sort(ids.begin(), ids.end());
  std::vector<SeenTile> tiles;
  const std::size_t count = std::min(most, ids.size());
  for (std::size_t i = 0; i < count; ++i) {
    const TileId id = ids[i * ids.size() / count];
    // The stores of earlier light were removed, but for the coarse level, which is lit already.
    if (id.level() == view.world.layout->coarse_level()) continue;
    if (auto surface = surfaces.tile(id)) tiles.push_back({id, masks.at(id), std::move(surface)});
  }
  return tiles;
}

void shade_all(Duel& duel, atlas::RadianceStore& store, const std::vector<SeenTile>& tiles, std::uint32_t passes) {
  for (std::size_t first = 0; first < tiles.size(); first += kTilesEach) {
    std::atomic<std::size_t> next{first};
    const std::size_t end = std::min(first + kTilesEach, tiles.size());
    duel.slice([&] {
      std::uint64_t samples = 0;
      for (std::size_t i = next++; i < end; i = next++) {
        const auto done = renderer::shade_tile(store, tiles[i].id, tiles[i].mask, passes, *tiles[i].surface);
        if (done) samples += done->samples;
      }
      return samples;
    });
  }
}

void trace_picture(Duel& duel, const LitView& view, const renderer::LightTransport& transport,
                   const RaytraceOptions& options) {
  const glm::vec3 eye(view.camera.position - view.world.scene->origin);
  const Viewport viewport{options.width, options.height};
  for (std::uint32_t first = 0; first < options.height; first += kRowsEach) {
    std::atomic<std::uint32_t> next{first};
    const std::uint32_t end = std::min(first + kRowsEach, options.height);
    duel.slice([&] {
      std::uint64_t samples = 0;
      for (std::uint32_t y = next++; y < end; y = next++)
        for (std::uint32_t x = 0; x < options.width; ++x) {
          renderer::Sampler sampler(1, renderer::hash_pair(x, y), 0);
          const glm::vec2 at = glm::vec2(x, y) + sampler.next_2d();
          (void)transport.full_radiance({eye, 0, ray_direction(view.camera, viewport, at.x, at.y), 1e30f}, sampler);
          ++samples;
        }
      return samples;
    });
  }
}

}  // namespace

Result<json> raytrace(const RaytraceOptions& options) {
  LitView view;
  std::vector<fs::path> files;
  if (!options.config.empty()) files.push_back(options.config);
  auto loaded = config::load(files);
  if (!loaded) return fail(config::to_string(loaded.error()));
  view.config = std::move(*loaded);
  if (!options.scene.empty()) view.config.scene.file = options.scene;
  if (options.q > 0) view.config.scene.q = options.q;
  view.config.state.dir = options.state_dir;
  std::error_code ignored;
  for (const auto& entry : fs::directory_iterator(options.state_dir, ignored))
    if (entry.path().extension() == ".store") fs::remove(entry.path(), ignored);
  if (auto opened = open_view(view, options.camera); !opened) return std::unexpected(opened.error());

  renderer::TransportOptions how;
  how.all_effects = options.all_effects;
  const auto transport = std::make_shared<const renderer::LightTransport>(view.world.scene, view.world.rays, how);
  const auto surfaces = renderer::make_scene_surfaces(view.world.scene, view.world.mapper, transport);
  light_coarse(view, *surfaces, kCoarseRounds);
  const auto tiles = pick_tiles(view, *surfaces, options.tiles);
  const BareScene bare(*view.world.rays);
  Duel first(bare, kThreads), later(bare, kThreads), reference(bare, kThreads);
  shade_all(first, *view.world.store, tiles, 1);
  for (int round = 0; round < kLaterRounds; ++round) shade_all(later, *view.world.store, tiles, kLaterPasses);
  trace_picture(reference, view, *transport, options);
  json report = {{"scene", view.world.scene->path},
                 {"integrator", renderer::to_string(transport->effects())},
                 {"threads", kThreads},
                 {"tiles", tiles.size()},
                 {"fast", {{"first", first.report()}, {"later", later.report()}}},
                 {"reference", reference.report()}};
  first.add(later);
  const json both = first.report();
  for (const char* key : {"value", "peer", "ratio"}) report[key] = both.contains(key) ? both[key] : json();
  return report;
}

}  // namespace darm::bench

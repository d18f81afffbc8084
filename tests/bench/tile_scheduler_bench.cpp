// links: darm_tile_scheduler darm_atlas darm_scene
// Cost of each stage of the tile scheduler on a real scene and view at 1280x720, in ms of one thread's processor time:
//   tile_scheduler_bench SCENE [q] ["px,py,pz tx,ty,tz fovy"]    prints one JSON object.
// The limit beside the figures: an update of 10 per second has 100 ms for all of it.
#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <functional>

#include "actors/atlas/build_layout.hpp"
#include "actors/scene/gltf_loader.hpp"
#include "actors/tile_scheduler/view_demand.hpp"
#include "actors/tile_scheduler/view_job.hpp"
#include "actors/tile_scheduler/view_report.hpp"
#include "actors/tile_scheduler/working_set.hpp"

namespace {

using namespace darm;
using namespace darm::tile_scheduler;

constexpr Viewport kViewport{1280, 720};

// Processor time of this thread: other work on the machine does not count.
double milliseconds(const std::function<void()>& work) {
  const auto now = [] {
    timespec t{};
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return double(t.tv_sec) * 1e3 + double(t.tv_nsec) * 1e-6;
  };
  const double start = now();
  work();
  return now() - start;
}

struct World {
  std::shared_ptr<const atlas::Layout> layout;
  std::shared_ptr<const renderer::trace::RayScene> rays;
};

Result<World> load(const char* file, float q) {
  auto scene = scene::load_scene(file, {});
  if (!scene) return std::unexpected(scene.error());
  atlas::LayoutOptions options;
  options.q = q;
  options.threads = 2;
  const auto cache = std::filesystem::temp_directory_path() / "darm_bench_layouts";
  std::filesystem::create_directories(cache);
  auto layout = atlas::cached_layout(**scene, options, cache);
  if (!layout) return std::unexpected(layout.error());
  auto rays = renderer::trace::RayScene::build(*scene, 2);
  if (!rays) return std::unexpected(rays.error());
  return World{*layout, *rays};
}

void report_trace(const World& world, const Camera& camera, WorkingSet& set) {
  double first = 0, all = 0, merge = 0;
  for (int pass = 0; pass < kAllPasses; ++pass) {
    ViewJob job(1, world.layout, world.rays, camera, kViewport, pass, 1, 1);
    const double spent = milliseconds([&] { job.run_slice(0); });
    all += spent;
    if (pass == 0) first = spent;
    merge += milliseconds([&] { set.add(job.results()[0], 1); });
  }
  std::printf(" \"first_pass_ms\": %.2f, \"mean_pass_ms\": %.2f, \"merge_ms\": %.2f,\n", first, all / kAllPasses,
              merge / kAllPasses);
  std::printf(" \"chains\": %zu, \"tiles_with_marks\": %zu,\n", set.current().chains().size(),
              set.current().tiles().size());
}

void report_slots(const World& world, const WorkingSet& set, std::size_t slots) {
  const auto chains = chains_of(set.seen());
  AllocationRequest request;
  request.chains = chains;
  request.slots = slots;
  request.coarse_level = world.layout->coarse_level();
  Allocation first, again;
  const double cold = milliseconds([&] { first = allocate_slots(request); });
  request.residents = first.tiles;
  const double warm = milliseconds([&] { again = allocate_slots(request); });
  std::array<double, kChainLength + 1> share{};
  for (std::size_t c = 0; c < chains.size(); ++c) share[first.served[c]] += double(chains[c].weight);
  std::printf(
      " \"slots_%zu\": {\"cold_ms\": %.2f, \"warm_ms\": %.2f, \"tiles\": %zu, \"churn\": %d, "
      "\"served\": [%.4f, %.4f, %.4f, %.4f, %.4f]},\n",
      slots, cold, warm, first.tiles.size(), first.tiles == again.tiles ? 0 : 1, share[0], share[1], share[2], share[3],
      share[4]);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 2) {
    std::fprintf(stderr, "usage: %s SCENE [q] [\"px,py,pz tx,ty,tz fovy\"]\n", argv[0]);
    return 2;
  }
  const auto world = load(argv[1], argc > 2 ? std::strtof(argv[2], nullptr) : 64.0f);
  if (!world) {
    std::fprintf(stderr, "%s\n", world.error().message.c_str());
    return 1;
  }
  glm::dvec3 p{-10.0, 1.5, -0.3}, t{10.0, 4.0, 0.0};
  double fovy = 60;
  if (argc > 3 && std::sscanf(argv[3], "%lf,%lf,%lf %lf,%lf,%lf %lf", &p.x, &p.y, &p.z, &t.x, &t.y, &t.z, &fovy) != 7) {
    std::fprintf(stderr, "camera: expected \"px,py,pz tx,ty,tz fovy\", got \"%s\"\n", argv[3]);
    return 2;
  }
  const auto camera = look_at(p, t, fovy);
  std::printf("{\"limit_ms\": 100,\n");
  WorkingSet set;
  report_trace(*world, camera, set);
  for (const std::size_t slots : {65535u, 4096u, 1024u}) report_slots(*world, set, slots);
  const PageTable table(4096);
  ViewDemand demand;
  const auto none = [](TileId) -> const StoredImage* { return nullptr; };
  const double spent = milliseconds([&] { demand = demand_of(set.seen(), *world->layout, table, none, nullptr, {}); });
  std::printf(" \"demand_ms\": %.2f, \"requests\": %zu,\n", spent, demand.requests.size());
  ViewReport report;
  const double reported =
      milliseconds([&] { report = report_view(*world->layout, *world->rays, camera, kViewport, 1); });
  std::printf(" \"report_ms\": %.0f, \"visible_texels\": %llu, \"visible_tiles\": %llu, \"efficiency\": %.4f}\n",
              reported, static_cast<unsigned long long>(report.visible_texels),
              static_cast<unsigned long long>(report.visible_tiles), report.efficiency);
  return 0;
}

// The same bits, however the work is cut into threads, slices and orders.
#include <gtest/gtest.h>
#include <unistd.h>

#include <bit>
#include <filesystem>
#include <thread>
#include <vector>

#include "actors/atlas/build_layout.hpp"
#include "actors/renderer/reference_renderer.hpp"
#include "actors/renderer/texel_shading.hpp"
#include "actors/renderer/tile_surface_scene.hpp"
#include "tests/numerical/closed_forms.hpp"
#include "tests/numerical/statistics.hpp"
#include "tests/numerical/worst.hpp"
#include "tests/unit/trace/hand_scene.hpp"

namespace darm::numerical {
namespace {

using namespace darm::renderer;  // NOLINT(google-build-using-namespace): the room under test
using test::HandScene;

/// A lit room with a glossy ball: sun, lamp, emitter and interreflection.
HandScene lit_room() {
  HandScene hand;
  hand.box(glm::vec3(-1), glm::vec3(1), hand.material(HandScene::matte({0.7f, 0.5f, 0.3f})), true);
  hand.quad({-0.3f, 0.9f, -0.3f}, {0.6f, 0, 0}, {0, 0, 0.6f},
            hand.material(HandScene::matte(glm::vec3(0.2f), glm::vec3(4))));
  scene::Material glossy;
  glossy.roughness = 0.3f;
  glossy.metallic = 0.5f;
  hand.place(ball(0.3f, 8, false, hand.material(glossy), {0.2f, -0.6f, 0.1f}));
  scene::Light lamp;
  lamp.position = {-0.5f, 0.3f, 0.2f};
  lamp.intensity = glm::vec3(0.5f);
  hand.scene.lights.push_back(lamp);
  return hand;
}

class Determinism : public ::testing::Test {
 protected:
  Determinism() {
    folder_ = std::filesystem::temp_directory_path() / ("darm_determinism_" + std::to_string(::getpid()));
    std::filesystem::create_directories(folder_);
    scene_ = lit_room().share();
    transport_ = transport_built_with(1);
  }
  ~Determinism() override { std::filesystem::remove_all(folder_); }

  [[nodiscard]] std::shared_ptr<const LightTransport> transport_built_with(unsigned threads) const {
    return std::make_shared<LightTransport>(scene_, trace::RayScene::build(scene_, threads).value());
  }

  std::filesystem::path folder_;
  std::shared_ptr<const scene::Scene> scene_;
  std::shared_ptr<const LightTransport> transport_;
};

bool same_bits(float a, float b) { return std::bit_cast<std::uint32_t>(a) == std::bit_cast<std::uint32_t>(b); }

std::size_t differing(const Picture& a, const Picture& b) {
  std::size_t n = a.pixels.size() == b.pixels.size() ? 0 : 1;
  for (std::size_t i = 0; i < std::min(a.pixels.size(), b.pixels.size()); ++i)
    n += same_bits(a.pixels[i].x, b.pixels[i].x) && same_bits(a.pixels[i].y, b.pixels[i].y) &&
                 same_bits(a.pixels[i].z, b.pixels[i].z)
             ? 0
             : 1;
  return n;
}

TEST_F(Determinism, reference_pictures_have_the_same_bits_for_any_threads_and_slices) {
  Worst bits("reference: pixels that differ", 0);
  for (const auto effects : {PictureEffects::kFull, PictureEffects::kViewIndependent}) {
    ReferenceJob job;
    job.camera = look_at({0, 0, 0.9}, {0, -0.2, -1}, 70);
    job.viewport = {kSanitized ? 12u : 32u, kSanitized ? 8u : 20u};
    job.effects = effects;
    job.spp = 12;
    const auto whole = render_reference(*transport_, job).value();
    const auto rebuilt = transport_built_with(2);
    for (const unsigned threads : {1u, 2u})
      for (const std::uint32_t slice : {0u, 1u, 2u, 5u}) {  // passes between stops; 0: none
        const auto& transport = threads == 1 ? *transport_ : *rebuilt;
        job.threads = threads;
        job.state_file = slice == 0 ? std::filesystem::path() : folder_ / "state";
        std::filesystem::remove(folder_ / "state");
        ReferencePicture made;
        for (int runs = 0; runs < 20; ++runs) {
          std::uint32_t passes = 0;
          if (slice > 0) job.progress = [&](const ReferenceProgress&) { return ++passes < slice; };
          made = render_reference(transport, job).value();
          if (!made.stopped) break;
        }
        job.progress = nullptr;
        EXPECT_EQ(made.spp, whole.spp);
        bits.see(static_cast<double>(differing(made.mean, whole.mean) + differing(made.half_a, whole.half_a)),
                 "threads", threads, "slice", slice);
      }
  }
}

TEST_F(Determinism, rays_meet_the_same_surface_however_the_tree_was_built) {
  Worst bits("rays: hits that differ between trees built by one and by two threads", 0);
  const auto other = transport_built_with(2);
  for (std::uint32_t i = 0; i < scaled(100000u); ++i) {
    Sampler random(2, i, 0);
    const glm::vec3 from = glm::vec3(random.next_2d(), random.next_1d()) * 1.8f - 0.9f;
    const glm::vec3 d = glm::vec3(random.next_2d(), random.next_1d()) * 2.0f - 1.0f;
    trace::Hit a, b;
    const bool hit_a = transport_->rays().closest({from, 0, d, 1e30f}, a);
    const bool hit_b = other->rays().closest({from, 0, d, 1e30f}, b);
    const bool same =
        hit_a == hit_b && (!hit_a || (a.t == b.t && a.instance == b.instance && a.triangle == b.triangle &&
                                      a.u == b.u && a.v == b.v && a.front == b.front));
    bits.see(same ? 0 : 1, "ray", i);
  }
}

/// How a store is filled: which tiles and texels in which order, by whom.
struct Work {
  const char* name;
  unsigned threads = 1;
  std::uint32_t passes = 8;     // samples a texel and slice
  int masks = 1;                // slices a tile's texels are dealt to
  bool backwards = false;       // order of the tiles
  std::size_t cache = 1 << 24;  // of the texel map
};

TEST_F(Determinism, texels_have_the_same_bits_for_any_threads_slices_and_orders) {
  Worst bits("texels: stored numbers that differ", 0);
  Worst rounding("texels: means after merges of other sizes, relative", 1e-6);
  const auto layout = atlas::build_layout(*scene_, {.q = kSanitized ? 6.0f : 16.0f}).value();
  const auto& level = layout->levels[0];
  const std::uint32_t tiles = level.tiles_x * level.tiles_y;
  constexpr std::uint32_t kSamples = 8;
  int number = 0;
  const auto fill = [&](const Work& work) {
    const auto mapper = std::make_shared<atlas::TexelMapper>(scene_, layout, work.cache);
    const auto surfaces = make_scene_surfaces(scene_, mapper, transport_, 5);
    auto store = atlas::RadianceStore::open(folder_ / std::to_string(number++), {}, *layout).value();
    const auto shade = [&](unsigned first) {
      const trace::DenormalsAreZero denormals;
      for (std::uint32_t i = first; i < tiles; i += work.threads) {
        const TileId id(0, work.backwards ? tiles - 1 - i : i);
        const auto pass = [&](std::uint32_t passes) {
          for (int m = 0; m < work.masks; ++m) {
            TexelMask mask;  // of whole 2x2 blocks: within one, who is asked for decides who is sampled first
            for (int t = 0; t < kTileTexels; ++t)
              if ((t / kTileSize / 2 * 15 + t % kTileSize / 2) % work.masks == m)
                mask.set(t % kTileSize, t / kTileSize);
            EXPECT_TRUE(shade_tile(*store, id, mask, passes, *surfaces->tile(id)).has_value());
          }
        };
        pass(1);  // the first pass
        for (std::uint32_t done = 0; done < kSamples; done += work.passes) pass(work.passes);
      }
    };
    std::vector<std::jthread> others;
    for (unsigned t = 1; t < work.threads; ++t) others.emplace_back(shade, t);
    shade(0);
    others.clear();
    return store;
  };
  const auto truth = fill({"one thread, in order"});
  std::size_t shaded = 0;
  for (const Work& work :
       {Work{"again"}, Work{"two threads", 2}, Work{"backwards", 1, 8, 1, true},
        Work{"texels dealt to 3 slices", 1, 8, 3}, Work{"two threads, 7 slices, backwards", 2, 8, 7, true},
        Work{"a map that forgets", 1, 8, 1, false, 1}, Work{"one sample at a time", 1, 1},
        Work{"two at a time", 2, 2, 2}}) {
    const auto store = fill(work);
    for (std::uint32_t i = 0; i < tiles; ++i) {
      const auto a = truth->read(TileId(0, i)), b = store->read(TileId(0, i));
      ASSERT_EQ(a.has_value(), b.has_value());
      if (!a) continue;
      ++shaded;
      for (int plane = 0; plane < atlas::kPlanes; ++plane)
        for (int t = 0; t < kTileTexels; ++t) {
          const float x = a->plane(atlas::Plane{plane})[t], y = b->plane(atlas::Plane{plane})[t];
          if (work.passes == kSamples) {
            bits.see(same_bits(x, y) ? 0 : 1, work.name, "tile", i, "plane", plane);
          } else if (plane < 5) {
            // How often sharp light is sampled is decided at each merge by what is there.
          } else if (plane % 5 == 3) {
            bits.see(x == y ? 0 : 1, work.name, "count");
          } else if (plane % 5 < 3) {
            // The store rounds at every merge: the same samples, other roundings.
            rounding.see(static_cast<double>(std::abs(x - y)) / std::max(1e-6, static_cast<double>(x)), work.name);
          }
        }
    }
  }
  EXPECT_GT(shaded, 0u);
}

}  // namespace
}  // namespace darm::numerical

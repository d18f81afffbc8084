#include "actors/tile_scheduler/visibility.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <tuple>

#include "actors/tile_scheduler/coarseness.hpp"
#include "actors/tile_scheduler/texel_taps.hpp"
#include "actors/tile_scheduler/view_demand.hpp"
#include "actors/tile_scheduler/view_job.hpp"
#include "actors/tile_scheduler/working_set.hpp"
#include "tests/unit/tile_scheduler/quad_scene.hpp"

namespace darm::tile_scheduler {
namespace {

using testing::make_room;
using testing::make_world;
using testing::Quad;

constexpr Viewport kViewport{160, 90};

TEST(Passes, SixteenCoverEveryPixelAndSixtyFourAllClientSamples) {
  std::set<std::pair<int, int>> pixels;
  std::set<std::pair<float, float>> samples;
  for (int pass = 0; pass < kAllPasses; ++pass) {
    const auto p = pass_offset(pass);
    if (pass < kPassesPerPicture) pixels.emplace(static_cast<int>(p.x), static_cast<int>(p.y));
    samples.emplace(p.x, p.y);
  }
  EXPECT_EQ(pixels.size(), 16u);
  EXPECT_EQ(samples.size(), 64u);
  for (int y = 0; y < 4; ++y)
    for (int x = 0; x < 4; ++x)
      for (const auto& s : kClientSamples) {
        EXPECT_TRUE(samples.contains({static_cast<float>(x) + s.x, static_cast<float>(y) + s.y}));
      }
}

// A wall straight ahead at distance d: a pixel covers d * spread world units both ways.
TEST(SharpLevel, MatchesTheFormulaOnAPlaneAtKnownDistance) {
  for (const float distance : {0.5f, 1.0f, 2.0f, 3.0f, 5.5f, 9.0f, 17.0f, 30.0f}) {
    const auto world = make_world({Quad{{-50, -50, -distance}, {1, 0, 0}, {0, 1, 0}, 100, 100}}, 64, 6);
    const auto camera = look_at({0, 0, 0}, {0, 0, -1}, 60);
    const ViewSampler sampler(*world.layout, *world.rays, camera, kViewport);
    std::array<SurfaceSample, kMaxLayers> out;
    ASSERT_EQ(sampler.trace(80.3f, 45.2f, out), 1);
    const float texels = distance * pixel_spread(camera, kViewport) * 64;
    const auto footprint = footprint_of(out[0].uv_dx, out[0].uv_dy);
    EXPECT_NEAR(footprint.minor * 64, texels, 1e-3f * texels);
    EXPECT_NEAR(footprint.major * 64, texels, 1e-3f * texels);
    EXPECT_EQ(out[0].level, std::clamp(static_cast<int>(std::floor(std::log2(texels))), 0, 5));
  }
}

// Each halving of the texels under a pixel is an octave; what is finer than asked for is no error.
TEST(ResolutionError, IsThatOfTheOctavesTheAtlasLacks) {
  for (const float distance : {0.25f, 1.0f, 4.0f, 16.0f}) {
    const auto world = make_world({Quad{{-50, -50, -distance}, {1, 0, 0}, {0, 1, 0}, 100, 100}}, 64, 6);
    const auto camera = look_at({0, 0, 0}, {0, 0, -1}, 60);
    const ViewSampler sampler(*world.layout, *world.rays, camera, kViewport);
    VisibleSet set;
    trace_rows(sampler, 0, 0, 4, set);
    const float octaves = -std::log2(distance * pixel_spread(camera, kViewport) * 64);
    EXPECT_NEAR(set.resolution_error(), error_of_coarser(octaves), 1e-3f) << distance;
    EXPECT_EQ(set.resolution_error() > 0.01f, distance < 0.5f) << distance;
    EXPECT_EQ(set.resolution_error() == 0.0f, distance > 2) << distance;
    VisibleSet both;
    both.merge(set, 0.25f);
    EXPECT_NEAR(both.resolution_error(), set.resolution_error(), 1e-6f) << "a mean, whatever the weight";
  }
  EXPECT_EQ(VisibleSet{}.resolution_error(), 0.0f);
  EXPECT_EQ(octaves_magnified(NAN), 0.0f);
  EXPECT_EQ(error_of_coarser(NAN), 0.0f);
  for (float octaves = 0; octaves < 20; octaves += 0.25f)
    EXPECT_LE(error_of_coarser(octaves), error_of_coarser(octaves + 0.25f));
}

// A floor seen at angle a below the horizon: across the view the footprint is distance * spread, along it 1 / sin(a)
// more.
TEST(SharpLevel, FollowsTheMinorAxisOnATiltedPlane) {
  const auto world = make_world({Quad{{-500, -1, 500}, {1, 0, 0}, {0, 0, -1}, 1000, 1000}}, 64, 6);
  for (const double degrees : {80.0, 45.0, 20.0, 8.0}) {
    const double a = degrees * M_PI / 180;
    const auto camera = look_at({0, 0, 0}, {0, -std::sin(a), -std::cos(a)}, 40);
    const ViewSampler sampler(*world.layout, *world.rays, camera, kViewport);
    std::array<SurfaceSample, kMaxLayers> out;
    ASSERT_EQ(sampler.trace(80.0f, 45.0f, out), 1);
    const double across = pixel_spread(camera, kViewport) / std::sin(a);
    const auto footprint = footprint_of(out[0].uv_dx, out[0].uv_dy);
    EXPECT_NEAR(out[0].cosine, std::sin(a), 1e-3) << degrees;
    EXPECT_NEAR(footprint.minor, across, 2e-3 * across) << degrees;
    EXPECT_NEAR(footprint.major, across / std::sin(a), 2e-3 * across / std::sin(a)) << degrees;
  }
}

TEST(SharpLevel, AgreesWithRaysThroughNeighbouringPixels) {
  const auto world = make_room();
  const Viewport large{1280, 720};
  const ViewSampler sampler(*world.layout, *world.rays, look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55), large);
  std::array<SurfaceSample, kMaxLayers> here, right, down;
  int compared = 0;
  for (float y = 20.5f; y < 700; y += 37)
    for (float x = 20.5f; x < 1260; x += 41) {
      if (sampler.trace(x, y, here) == 0 || sampler.trace(x + 0.1f, y, right) == 0 ||
          sampler.trace(x, y + 0.1f, down) == 0)
        continue;
      if (right[0].patch != here[0].patch || down[0].patch != here[0].patch) continue;
      const auto dx = (right[0].uv - here[0].uv) * 10.0f;
      const auto dy = (down[0].uv - here[0].uv) * 10.0f;
      const float tolerance = 0.05f * glm::length(dx) + 0.05f * glm::length(dy);
      EXPECT_LT(glm::length(dx - here[0].uv_dx), tolerance);
      EXPECT_LT(glm::length(dy - here[0].uv_dy), tolerance);
      ++compared;
    }
  EXPECT_GT(compared, 200);
}

TEST(Footprint, IsZeroOrFiniteForAnyInput) {
  const float inf = INFINITY;
  EXPECT_EQ(footprint_of({NAN, 0}, {0, 1}).minor, 0);
  EXPECT_EQ(footprint_of({inf, 0}, {0, 1}).major, 0);
  EXPECT_EQ(footprint_of({0, 0}, {0, 0}).major, 0);
  EXPECT_EQ(sharp_level(NAN, 4), 0);
  EXPECT_EQ(sharp_level(inf, 4), 4);
  EXPECT_EQ(sharp_level(0.3f, 4), 0);
  EXPECT_EQ(sharp_level(4.1f, 4), 2);
  const auto grazing = footprint_of({1e-3f, 0}, {0, 50});
  EXPECT_LE(grazing.major, grazing.minor * kMaxAnisotropy * 1.001f);
}

TEST(ViewSampler, SeesThroughBlendedSurfacesAndTakesTheBackPatch) {
  std::vector<Quad> quads;
  quads.push_back({{-1, -1, -2}, {1, 0, 0}, {0, 1, 0}, 2, 2, scene::AlphaMode::kBlend, true});
  quads.push_back({{-9, -9, -5}, {1, 0, 0}, {0, 1, 0}, 18, 18});
  const auto world = make_world(quads, 16, 3);
  std::array<SurfaceSample, kMaxLayers> out;
  const ViewSampler front(*world.layout, *world.rays, look_at({0, 0, 0}, {0, 0, -1}, 40), kViewport);
  ASSERT_EQ(front.trace(80.1f, 45.2f, out), 2);
  EXPECT_EQ(out[0].patch, PatchId{0});
  EXPECT_EQ(out[1].patch, PatchId{2});
  const ViewSampler behind(*world.layout, *world.rays, look_at({0, 0, -4}, {0, 0, 0}, 40), kViewport);
  ASSERT_EQ(behind.trace(80.1f, 45.2f, out), 1);
  EXPECT_EQ(out[0].patch, PatchId{1});
}

VisibleSet trace_passes(const testing::TestWorld& world, const Camera& camera, int passes) {
  const ViewSampler sampler(*world.layout, *world.rays, camera, kViewport);
  WorkingSet set;
  for (int pass = 0; pass < passes; ++pass) {
    VisibleSet one;
    trace_rows(sampler, pass, 0, block_rows(kViewport), one);
    set.add(one, 1);
  }
  return set.current();
}

TEST(Visibility, APassOfTheLargestViewportCostsWhatOneOf1080pDoes) {
  const auto world = make_room();
  const auto camera = look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55);
  for (const Viewport viewport : {Viewport{16384, 16384}, Viewport{3840, 2160}, Viewport{1920, 1080}}) {
    const ViewSampler sampler(*world.layout, *world.rays, camera, viewport);
    VisibleSet set;
    trace_rows(sampler, 0, 0, block_rows(viewport), set);
    EXPECT_LT(set.samples(), 1.02 * kMaxRays) << viewport.width;
    EXPECT_GT(set.samples(), 0.95 * kMaxRays) << viewport.width;
    for (const auto& chain : set.chains()) EXPECT_LE(chain.tiles[0].level(), 1) << "the level is the real viewport's";
  }
}

TEST(Visibility, SmallerPicturesAreTracedInBlocksOfFour) {
  EXPECT_EQ(block_side({1920, 1080}), 4.0f);
  EXPECT_EQ(passes_per_picture({1920, 1080}), kPassesPerPicture);
  EXPECT_EQ(block_rows({1, 1}), 1u);
  EXPECT_EQ(block_columns({161, 90}), 41u);
  // 4K: within kAllPasses every pixel is looked at.
  EXPECT_LE(passes_per_picture({3840, 2160}), kAllPasses);
}

TEST(ViewJob, RunsInShortStepsAndEndsWhenCancelled) {
  const auto world = make_room();
  const Viewport viewport{16384, 16384};
  ViewJob job(1, world.layout, world.rays, look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55), viewport, 0, 2, 2);
  ASSERT_EQ(job.slice_count(), 2u);
  EXPECT_EQ(job.run_step(0), ViewJob::Step::kMore);
  EXPECT_LE(job.results()[0].samples(), kRaysPerStep);
  EXPECT_GT(job.results()[0].samples(), 0);
  job.cancel();
  EXPECT_EQ(job.run_step(0), ViewJob::Step::kSliceDone);
  EXPECT_EQ(job.run_step(1), ViewJob::Step::kAllDone);
  EXPECT_LE(job.results()[0].samples(), kRaysPerStep);
}

TEST(ViewJob, StepsMakeWhatWholePassesMake) {
  const auto world = make_room();
  const auto camera = look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55);
  const Viewport viewport{1280, 720};
  ViewJob job(1, world.layout, world.rays, camera, viewport, 0, 2, 3);
  VisibleSet joined, whole;
  for (unsigned slice = 0; slice < job.slice_count(); ++slice) EXPECT_EQ(job.run_slice(slice), slice == 2);
  for (const auto& part : job.results()) joined.merge(part);
  const ViewSampler sampler(*world.layout, *world.rays, camera, viewport);
  for (int pass = 0; pass < 2; ++pass) trace_rows(sampler, pass, 0, block_rows(viewport), whole);
  EXPECT_EQ(joined.samples(), whole.samples());
  EXPECT_EQ(joined.tiles().size(), whole.tiles().size());
  EXPECT_EQ(joined.chains().size(), whole.chains().size());
}

TEST(Visibility, SixtyFourPassesHoldEveryTexelTheClientReads) {
  const auto world = make_room();
  const auto camera = look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55);
  const auto set = trace_passes(world, camera, kAllPasses);
  EXPECT_EQ(set.samples(), 4.0 * kViewport.width * kViewport.height);
  const ViewSampler sampler(*world.layout, *world.rays, camera, kViewport);
  std::array<SurfaceSample, kMaxLayers> out;
  int checked = 0;
  for (std::uint32_t y = 0; y < kViewport.height; ++y)
    for (std::uint32_t x = 0; x < kViewport.width; ++x)
      for (const auto& s : kClientSamples) {
        const int layers = sampler.trace(static_cast<float>(x) + s.x, static_cast<float>(y) + s.y, out);
        for (int i = 0; i < layers; ++i) {
          const auto& sample = out[static_cast<std::size_t>(i)];
          const auto& level = world.layout->levels[static_cast<std::size_t>(sample.level)];
          const auto texel = world.layout->texel_at(sample.patch, sample.level, sample.uv);
          const auto holder = tile_holding(*world.layout, sample.level, texel);
          for_each_tile_part(level, sample.level, taps_at(level, texel), [&](TileId tile, const TexelBox& part) {
            const auto* use = set.find(tile);
            ASSERT_NE(use, nullptr);
            const auto& mask = tile == holder ? use->sharp : use->border;
            for (int py = part.y0; py <= part.y1; ++py)
              for (int px = part.x0; px <= part.x1; ++px) {
                ASSERT_TRUE(mask.test(px, py));
                ++checked;
              }
          });
        }
      }
  EXPECT_GT(checked, 50000);
}

TEST(Visibility, FirstPassAlreadyMarksMostOfWhatTheEyeSees) {
  const auto world = make_room();
  const auto camera = look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55);
  const auto first = trace_passes(world, camera, 1);
  const auto full = trace_passes(world, camera, kAllPasses);
  double seen = 0, marked = 0, extra = 0;
  for (std::size_t i = 0; i < full.tiles().size(); ++i) {
    const auto& whole = full.uses()[i].sharp;
    const auto* early = first.find(full.tiles()[i]);
    for (int bit = 0; bit < kTileTexels; ++bit) {
      const bool is_marked = early != nullptr && early->early.test(bit);
      if (whole.test(bit)) ++seen;
      if (whole.test(bit) && is_marked) ++marked;
      if (!whole.test(bit) && is_marked) ++extra;
    }
  }
  EXPECT_GT(marked / seen, 0.9);
  EXPECT_LT(extra / seen, 0.4);  // a small picture: many pixels lie at edges
}

TEST(VisibleSetTaps, NameTheirChainAlsoAfterSetsAreMerged) {
  const auto world = make_room();
  const ViewSampler sampler(*world.layout, *world.rays, look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55), kViewport);
  VisibleSet whole, upper, lower;
  trace_rows(sampler, 0, 0, block_rows(kViewport), whole);
  trace_rows(sampler, 0, 0, 10, upper);
  trace_rows(sampler, 0, 10, block_rows(kViewport), lower);
  VisibleSet merged;
  merged.merge(lower);  // chains get other numbers than in `whole`
  merged.merge(upper);
  ASSERT_EQ(merged.taps().size(), whole.taps().size());
  const auto key = [](const VisibleSet& set, const SampleTaps& t) {
    return std::tuple(set.chains()[t.chain].tiles[0].packed, t.at, t.coarse);
  };
  std::multiset<decltype(key(whole, {}))> a, b;
  for (const auto& t : whole.taps()) a.insert(key(whole, t));
  for (const auto& t : merged.taps()) b.insert(key(merged, t));
  EXPECT_EQ(a, b);
  VisibleSet late;
  trace_rows(sampler, kTapPasses, 0, block_rows(kViewport), late);
  EXPECT_TRUE(late.taps().empty());
}

TEST(VisibleSetTaps, LookInsideTheSlotWhereTheClientLooks) {
  const auto world = make_room();
  const ViewSampler sampler(*world.layout, *world.rays, look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55), kViewport);
  VisibleSet set;
  trace_rows(sampler, 0, 0, block_rows(kViewport), set);
  ASSERT_FALSE(set.taps().empty());
  for (const auto& t : set.taps())
    for (std::size_t i = 0; i < kChainLength; ++i) {
      if (set.chains()[t.chain].tiles[i] == kNoTile) continue;
      EXPECT_GE(t.position(i).x, 1.0f);
      EXPECT_LE(t.position(i).x, 31.0f);
      EXPECT_GE(t.position(i).y, 1.0f);
      EXPECT_LE(t.position(i).y, 31.0f);
    }
}

TEST(WorkingSet, KeepsThePreviousPoseForItsTimeAtALowerWeight) {
  const auto world = make_room();
  const ViewSampler left(*world.layout, *world.rays, look_at({0, 0.4, 1.5}, {-4, 0, -2}, 40), kViewport);
  const ViewSampler ahead(*world.layout, *world.rays, look_at({0, 0.4, 1.5}, {0, 0, -9}, 40), kViewport);
  VisibleSet a, b;
  trace_rows(left, 0, 0, block_rows(kViewport), a);
  trace_rows(ahead, 0, 0, block_rows(kViewport), b);
  WorkingSetOptions options;
  options.keep_previous = 100;
  options.previous_weight = 0.25f;
  WorkingSet set(options);
  set.add(a, 1);
  set.start_pose(1000, kPassesPerPicture);
  set.add(b, 1);
  const auto total = [&] {
    double sum = 0;
    for (const auto& c : chains_of(set.seen())) sum += c.weight;
    return sum;
  };
  const double hits_a = [&] {
    double n = 0;
    for (auto c : a.counts()) n += c;
    return n / a.samples();
  }();
  const double hits_b = [&] {
    double n = 0;
    for (auto c : b.counts()) n += c;
    return n / b.samples();
  }();
  EXPECT_NEAR(total(), hits_b + 0.25 * hits_a, 1e-3);
  EXPECT_FALSE(set.expire(1099));
  EXPECT_TRUE(set.expire(1100));
  EXPECT_NEAR(total(), hits_b, 1e-3);
}

TEST(WorkingSet, ThoseThatAdoptHoldOneSetUntilOneSeesMore) {
  VisibleSet first, second;
  first.add(Chain{{TileId(0, 1)}}, 1);
  first.add_samples(1);
  second.add(Chain{{TileId(0, 2)}}, 1);
  second.add_samples(1);
  WorkingSet one, other;
  one.add(first, 1);
  other.adopt(one, true, 0);
  EXPECT_EQ(&one.current(), &other.current()) << "a hundred at one place hold it once";
  one.add(second, 1);
  EXPECT_EQ(one.current().chains().size(), 2u);
  EXPECT_EQ(other.current().chains().size(), 1u) << "and what one sees later is its own";
  other.adopt(one, false, 0);
  other.start_pose(1, kPassesPerPicture);
  EXPECT_EQ(one.current().chains().size(), 2u) << "nor does it lose anything when the other goes";
}

TEST(WorkingSet, KeepsAllThatWasGlancedAtOnTheWayButNotForEver) {
  WorkingSetOptions options;
  options.keep_previous = 1000;
  WorkingSet set(options);
  const auto glance = [&](std::uint32_t tile, Microseconds now) {
    set.start_pose(now, kPassesPerPicture);
    VisibleSet seen;
    seen.add(Chain{{TileId(0, tile)}}, 1);
    seen.add_samples(1);
    set.add(seen, 0);
  };
  const auto tiles = [&] {
    std::set<std::uint32_t> out;
    for (const auto& c : chains_of(set.seen())) out.insert(c.chain.tiles[0].index());
    return out;
  };
  for (std::uint32_t i = 0; i < 10; ++i) glance(i, 100 * i);
  EXPECT_EQ(tiles().size(), 10u);
  for (std::uint32_t i = 10; i < 100; ++i) {
    glance(i, 100 * i);
    const auto now = tiles();
    for (std::uint32_t k = i - 9; k <= i; ++k) EXPECT_TRUE(now.contains(k)) << k;
    EXPECT_LE(now.size(), 24u);
  }
  double weight = 0;
  for (const auto& c : chains_of(set.seen())) weight += double(c.weight);
  EXPECT_NEAR(weight, 1.25, 1e-4);
  EXPECT_TRUE(set.expire(100 * 99 + 1000));
  EXPECT_EQ(tiles(), std::set<std::uint32_t>{99});
}

TEST(Visibility, AGlanceFindsMostOfWhatAPassFindsWithFarFewerRays) {
  const auto world = make_room();
  const ViewSampler sampler(*world.layout, *world.rays, look_at({0.3, 0.4, 1.5}, {-0.6, -0.2, -8}, 55), {640, 360});
  VisibleSet whole, glance;
  trace_rows(sampler, 0, 0, block_rows({640, 360}), whole);
  trace_rows(sampler, 0, 0, block_rows({640, 360}, 600), glance, {}, 600);
  EXPECT_GT(glance.samples(), 500);
  EXPECT_LT(glance.samples(), 700);
  ChainIndex known;
  for (const auto& chain : glance.chains()) known.insert(chain);
  EXPECT_GT(known_share(whole, known), 0.65f) << "of a 24th of the rays";
  EXPECT_LE(block_rows({640, 360}, 1) * block_columns({640, 360}, 1), 2u);
}

}  // namespace
}  // namespace darm::tile_scheduler

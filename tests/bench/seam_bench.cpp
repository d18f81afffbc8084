// links: darm_daemon darm_client_core
// Error of texels beside the border of their patch, against that of all others, at the same number of samples.
//   seam_bench SETUP.toml SCENE CAMERA STATE_DIR Q TILES TEXELS SAMPLES SEED COUNT...
// Lights TILES random tiles (drawn by SEED) of a still view and what lies around them to COUNT samples a texel (1: a
// first pass) by the product's own code, paths ending in a coarse level of 16 rounds; compares the displayed values of
// TEXELS texels that the view's taps read with SAMPLES traced samples of each, in two independent halves. Light and
// truth are kept in STATE_DIR. Prints one JSON object; for each count
//   ratio    of RMSE (display units, the truth's noise cancelled) and of mean absolute error (it is in): border over
//            elsewhere. Border: gutter, and texels that have gutter or another patch beside them
//   classes  RMSE, mean absolute error, RMSE by soft light alone, what the filter says of that, mean signed error,
//            texels; by distance from the border
//   draw_us  thread CPU time of a picture, mean of tiles
//   estimate RMS of the error that tiles say they have, over the true one of their measured texels
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <fstream>
#include <map>
#include <random>
#include <set>

#include "tests/bench/lit_view.hpp"

namespace {

using namespace darm;
using namespace darm::bench;

constexpr std::uint32_t kCoarseRounds = 16;

enum Place : std::uint8_t { kGutter, kOutermost, kNear, kFar };
constexpr const char* kPlaceNames[] = {"gutter", "outermost", "near", "far"};

/// A measured texel and its converged light, exposed but for albedo, by halves.
struct Truth {
  TileId tile;
  int texel = 0;
  Place place = kFar;
  glm::vec3 sharp[2]{};
  glm::vec3 soft[2]{};
  glm::vec3 albedo{0.0f};
  glm::vec3 emission{0.0f};
  glm::vec3 mean_soft() const { return 0.5f * (soft[0] + soft[1]); }
};

struct Shown {
  glm::vec3 display{0.0f};  // 0..1
  glm::vec3 soft{0.0f};     // before albedo, not exposed
  float soft_error = 0;     // its standard error, as the filter says
  bool known = false;
};

float shown(float linear) {
  const float c = std::clamp(linear, 0.0f, 1.0f);
  return c <= 0.0031308f ? 12.92f * c : 1.055f * std::pow(c, 1 / 2.4f) - 0.055f;
}

class PlaceFinder {
 public:
  explicit PlaceFinder(const LitView& view) : view_(view), levels_(renderer::level_tiles_of(*view.world.layout)) {}

  Place place_of(TileId tile, int texel) {
    if (gutter(tile, texel % kTileSize, texel / kTileSize)) return kGutter;
    for (int reach = 1; reach <= 3; ++reach)
      for (int dy = -reach; dy <= reach; ++dy)
        for (int dx = -reach; dx <= reach; ++dx)
          if (at_border(tile, texel, dx, dy)) return reach == 1 ? kOutermost : kNear;
    return kFar;
  }

 private:
  const atlas::TileTexels& tile_of(TileId tile) {
    auto& kept = tiles_[tile];
    if (!kept) kept = view_.world.mapper->tile(tile);
    return *kept;
  }
  bool gutter(TileId tile, int x, int y) { return tile_of(tile).is_gutter(x, y); }
  template <class Visit>
  bool step(TileId tile, int texel, int dx, int dy, const Visit& visit) {
    int x = texel % kTileSize + dx, y = texel / kTileSize + dy;
    const auto wrap = [](int& c) {
      const int tiles = c < 0 ? -1 : c >= kTileSize ? 1 : 0;
      c -= tiles * kTileSize;
      return tiles;
    };
    const int tx = wrap(x), ty = wrap(y);
    const auto other = renderer::neighbour_of(tile, levels_[static_cast<std::size_t>(tile.level())], tx, ty);
    if (other) visit(*other, y * kTileSize + x);
    return other.has_value();
  }
  bool at_border(TileId tile, int texel, int dx, int dy) {
    const auto own = tile_of(tile).patch_at(texel % kTileSize, texel / kTileSize);
    bool border = false;
    const bool inside = step(tile, texel, dx, dy, [&](TileId other, int at) {
      const int x = at % kTileSize, y = at / kTileSize;
      border = tile_of(other).patch_at(x, y) != own || gutter(other, x, y);
    });
    return border || !inside;
  }

  const LitView& view_;
  std::vector<renderer::LevelTiles> levels_;
  std::map<TileId, std::shared_ptr<const atlas::TileTexels>> tiles_;
};

// As many texels beside borders as elsewhere, of random tiles.
std::vector<Truth> pick_texels(const LitView& view, std::size_t tiles, std::size_t count, std::uint32_t seed) {
  const auto seen = sharp_texels(view);
  std::vector<std::pair<TileId, TexelMask>> chosen(seen.begin(), seen.end());
  std::mt19937 random(seed);
  std::shuffle(chosen.begin(), chosen.end(), random);
  chosen.resize(std::min(chosen.size(), tiles));
  PlaceFinder places(view);
  std::vector<Truth> halves[2];
  for (const auto& [tile, mask] : chosen)
    for (int t = 0; t < kTileTexels; ++t) {
      if (!mask.test(t) || view.world.mapper->tile(tile)->patch_at(t % kTileSize, t / kTileSize) == kNoPatch) continue;
      Truth truth{tile, t};
      truth.place = places.place_of(tile, t);
      halves[truth.place <= kOutermost ? 0 : 1].push_back(truth);
    }
  std::vector<Truth> all;
  for (auto& half : halves) {
    std::shuffle(half.begin(), half.end(), random);
    half.resize(std::min(half.size(), count / 2));
    all.insert(all.end(), half.begin(), half.end());
  }
  std::sort(all.begin(), all.end(),
            [](const Truth& a, const Truth& b) { return std::pair(a.tile, a.texel) < std::pair(b.tile, b.texel); });
  return all;
}

void trace_truth(const LitView& view, std::vector<Truth>& texels, std::uint32_t samples) {
  const Halves halves = make_halves(view, 1);
  atlas::parallel_for(texels.size(), kThreads, [&](std::size_t i) {
    const renderer::trace::DenormalsAreZero denormals;
    Truth& t = texels[i];
    const auto surface = halves[0]->tile(t.tile);
    for (std::size_t h = 0; h < 2; ++h) {
      const auto from = halves[h]->tile(t.tile);
      glm::dvec3 sharp(0.0), soft(0.0);
      for (std::uint32_t n = 0; n < samples / 2; ++n) {
        sharp += glm::dvec3(from->sharp(t.texel, n).value_or(glm::vec3(0.0f)));
        soft += glm::dvec3(from->soft(t.texel, n).value_or(glm::vec3(0.0f)));
      }
      t.sharp[h] = glm::vec3(sharp / double(samples / 2));
      t.soft[h] = glm::vec3(soft / double(samples / 2));
    }
    for (std::uint32_t n = 0; n < 32; ++n) {  // the product's own last number of points
      t.albedo += surface->albedo(t.texel, n).value_or(glm::vec3(0.0f)) / 32.0f;
      t.emission += surface->emission(t.texel, n) / 32.0f;
    }
  });
}

void truth_from_file_or_traced(const LitView& view, const std::string& file, std::vector<Truth>& texels,
                               std::uint32_t samples) {
  std::vector<Truth> kept(texels.size());
  const auto bytes = static_cast<std::streamsize>(texels.size() * sizeof(Truth));
  if (std::ifstream in(file, std::ios::binary); in.read(reinterpret_cast<char*>(kept.data()), bytes)) {
    const bool same = std::equal(kept.begin(), kept.end(), texels.begin(),
                                 [](const Truth& a, const Truth& b) { return a.tile == b.tile && a.texel == b.texel; });
    if (same) {
      for (std::size_t i = 0; i < kept.size(); ++i) kept[i].place = texels[i].place;
      texels = kept;
      return;
    }
  }
  trace_truth(view, texels, samples);
  std::ofstream(file, std::ios::binary).write(reinterpret_cast<const char*>(texels.data()), bytes);
}

// The measured tiles and their neighbours, with the texels that a daemon lights for this view.
TileMasks tiles_to_light(const LitView& view, const std::vector<Truth>& texels) {
  const auto levels = renderer::level_tiles_of(*view.world.layout);
  const auto wanted = wanted_texels(view);
  TileMasks masks;
  for (const auto& t : texels)
    for (int d = 0; d < 9; ++d)
      if (const auto near =
              renderer::neighbour_of(t.tile, levels[static_cast<std::size_t>(t.tile.level())], d % 3 - 1, d / 3 - 1))
        if (const auto it = wanted.find(*near); it != wanted.end()) masks.insert(*it);
  return masks;
}

double thread_us() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) * 1e6 + static_cast<double>(now.tv_nsec) * 1e-3;
}

struct Pictures {
  std::vector<Shown> texels;  // parallel to the truth
  double estimate = 0;        // RMS of what the tiles say, each as often as it is measured
  double draw_us = 0;
};

Pictures light_and_draw(const LitView& view, const std::vector<Truth>& texels, const TileMasks& masks,
                        const renderer::TileSurfaces& surfaces, atlas::RadianceStore& store, std::uint32_t count) {
  const std::vector<std::pair<TileId, TexelMask>> tiles(masks.begin(), masks.end());
  const auto levels = renderer::level_tiles_of(*view.world.layout);
  const auto level_of = [&](TileId tile) { return levels[static_cast<std::size_t>(tile.level())]; };
  renderer::TileFactsCache facts(tiles.size() + 16);
  atlas::parallel_for(tiles.size(), kThreads, [&](std::size_t i) {
    const renderer::trace::DenormalsAreZero denormals;
    const auto& [tile, mask] = tiles[i];
    const auto surface = surfaces.tile(tile);
    auto progress = renderer::survey_tile(store, tile, mask, *surface);
    if (progress.unshaded > 0 && !renderer::shade_tile(store, tile, mask, 1, *surface, count)) return;
    for (std::uint32_t n = 1; count > 1 && n <= count; n *= 2)  // a tile's passes double, as the schedule's do
      if (!renderer::shade_tile(store, tile, mask, std::max(n / 2, 1u), *surface, count)) return;
    if (const auto known = facts.get(tile, surfaces, store); known && known->learn_albedo(*surface, mask,
                                                                                          count <= 1   ? 2
                                                                                          : count < 16 ? 16
                                                                                                       : 32))
      if (auto update = store.begin_update(tile)) update->put_albedo(known->albedo_means);
  });
  std::vector<std::size_t> first;
  for (std::size_t i = 0; i < texels.size(); ++i)
    if (i == 0 || texels[i].tile != texels[i - 1].tile) first.push_back(i);
  Pictures made;
  made.texels.resize(texels.size());
  std::vector<double> estimates(texels.size());
  std::vector<double> times(first.size());
  atlas::parallel_for(first.size(), kThreads, [&](std::size_t f) {
    const TileId tile = texels[first[f]].tile;
    renderer::TileDisplay display(store, facts, {view.world.exposure});
    (void)display.draw(tile, level_of(tile), masks.at(tile));  // its scratch memory is kept
    const double begin = thread_us();
    const auto picture = display.draw(tile, level_of(tile), masks.at(tile));
    times[f] = thread_us() - begin;
    const auto light = store.read(tile);
    if (!picture || !light) return;
    for (std::size_t i = first[f]; i < texels.size() && texels[i].tile == tile; ++i) {
      const int t = texels[i].texel;
      const auto slot = static_cast<std::size_t>((t / kTileSize + 1) * kSlotSize + t % kTileSize + 1);
      auto& out = made.texels[i];
      for (std::size_t c = 0; c < 3; ++c)
        out.display[static_cast<int>(c)] = static_cast<float>(picture->image->rgb[slot * 3 + c]) / 255.0f;
      const auto& f_texel = display.filtered()[slot];
      out.soft = f_texel.known ? glm::vec3(f_texel.irradiance[0], f_texel.irradiance[1], f_texel.irradiance[2])
                               : light->mean(atlas::Layer::kSoft, t);
      out.soft_error = std::sqrt(f_texel.known ? f_texel.variance : light->variance_of_mean(atlas::Layer::kSoft, t, 0));
      out.known = true;
      estimates[i] = double{picture->error} * double{picture->error};
    }
  });
  for (const double e : estimates) made.estimate += e / static_cast<double>(texels.size());
  made.estimate = std::sqrt(made.estimate);
  for (const double t : times) made.draw_us += t / static_cast<double>(times.size());
  return made;
}

struct Sums {
  double squares = 0, absolute = 0, soft_squares = 0, soft_variance = 0, bias = 0;
  std::size_t texels = 0;

  void add(const Truth& t, const Shown& s, float exposure) {
    ++texels;
    for (int c = 0; c < 3; ++c) {
      float off[2], soft_off[2];
      for (int h = 0; h < 2; ++h) {
        const float truth = shown(exposure * ((t.sharp[h][c] + t.soft[h][c]) * t.albedo[c] + t.emission[c]));
        off[h] = s.display[c] - truth;
        soft_off[h] = shown(exposure * ((t.sharp[h][c] + s.soft[c]) * t.albedo[c] + t.emission[c])) - truth;
      }
      squares += double{off[0] * off[1]} / 3.0;
      soft_squares += double{soft_off[0] * soft_off[1]} / 3.0;
      absolute += double{std::abs(off[0] + off[1])} / 6.0;
      bias += double{off[0] + off[1]} / 6.0;
      const float light = exposure * ((t.sharp[0][c] + s.soft[c]) * t.albedo[c] + t.emission[c]);
      const float more = shown(light + exposure * t.albedo[c] * s.soft_error) - shown(light);
      soft_variance += double{more * more} / 3.0;
    }
  }
  [[nodiscard]] double n() const { return static_cast<double>(std::max<std::size_t>(texels, 1)); }
  [[nodiscard]] double rmse() const { return std::sqrt(std::max(squares / n(), 0.0)); }
  [[nodiscard]] double soft_rmse() const { return std::sqrt(std::max(soft_squares / n(), 0.0)); }
  [[nodiscard]] double mean() const { return absolute / n(); }
};

void report(const std::vector<Truth>& texels, const Pictures& made, float exposure, std::uint32_t count) {
  Sums border, elsewhere, all;
  std::map<std::string, Sums> classes;
  for (std::size_t i = 0; i < texels.size(); ++i) {
    const auto& t = texels[i];
    (t.place <= kOutermost ? border : elsewhere).add(t, made.texels[i], exposure);
    all.add(t, made.texels[i], exposure);
    classes[kPlaceNames[t.place]].add(t, made.texels[i], exposure);
  }
  std::printf("{\"count\": %u, \"ratio\": {\"rmse\": %.3f, \"mean\": %.3f, \"soft_rmse\": %.3f}, ", count,
              border.rmse() / elsewhere.rmse(), border.mean() / elsewhere.mean(),
              border.soft_rmse() / elsewhere.soft_rmse());
  std::printf("\"border\": %.5f, \"elsewhere\": %.5f, \"estimate\": %.2f, \"draw_us\": %.0f, \"classes\": {",
              border.rmse(), elsewhere.rmse(), made.estimate / all.rmse(), made.draw_us);
  const char* comma = "";
  for (const auto& [name, s] : classes) {
    std::printf(
        "%s\n  \"%s\": {\"rmse\": %.5f, \"mean\": %.5f, \"soft\": %.5f, \"soft_noise\": %.5f, \"bias\": %.5f, "
        "\"texels\": %zu}",
        comma, name.c_str(), s.rmse(), s.mean(), s.soft_rmse(), std::sqrt(s.soft_variance / s.n()), s.bias / s.n(),
        s.texels);
    comma = ",";
  }
  std::printf("}}");
}

Result<void> run(int argc, char** argv) {
  LitView view;
  if (auto opened = open_view(view, argv[1], argv[2], argv[3], argv[4], std::strtod(argv[5], nullptr)); !opened)
    return opened;
  const auto number = [&](int i) { return static_cast<std::uint32_t>(std::strtoul(argv[i], nullptr, 10)); };
  const std::uint32_t samples = number(8);
  auto texels = pick_texels(view, number(6), number(7), number(9));
  if (texels.empty() || samples < 2) return fail("nothing is seen, or SAMPLES is under 2");
  const std::string name =
      std::string(argv[4]) + "/seam-truth-" + argv[3] + "-" + argv[6] + "-" + argv[7] + "-" + argv[8] + "-" + argv[9];
  truth_from_file_or_traced(view, name + ".truth", texels, samples);
  const auto surfaces = renderer::make_scene_surfaces(view.world.scene, view.world.mapper, view.world.transport, 2);
  light_coarse(view, *surfaces, kCoarseRounds);
  const auto masks = tiles_to_light(view, texels);
  std::printf("{\"camera\": \"%s\", \"q\": %g, \"tiles\": %zu, \"texels\": %zu, \"counts\": [", argv[3],
              double(view.world.layout->q), masks.size(), texels.size());
  for (int i = 10; i < argc; ++i) {
    const auto store =
        atlas::RadianceStore::open(std::string(argv[4]) + "/seam-" + argv[3] + "-" + argv[i], {}, *view.world.layout);
    if (!store) return std::unexpected(store.error());
    const auto made = light_and_draw(view, texels, masks, *surfaces, **store, number(i));
    std::printf("%s\n", i > 10 ? "," : "");
    report(texels, made, view.world.exposure, number(i));
  }
  std::printf("]}\n");
  return {};
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 11) {
    std::fprintf(stderr, "usage: %s SETUP.toml SCENE CAMERA STATE_DIR Q TILES TEXELS SAMPLES SEED COUNT...\n", argv[0]);
    return 2;
  }
  if (const auto done = run(argc, argv); !done) {
    std::fprintf(stderr, "%s\n", done.error().message.c_str());
    return 1;
  }
  return 0;
}

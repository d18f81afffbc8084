#include "actors/renderer/tile_display.hpp"

#include <algorithm>
#include <cmath>

#include "actors/renderer/display_curve.hpp"
#include "actors/renderer/outliers.hpp"
#include "actors/renderer/sampling.hpp"
#include "actors/renderer/tile_fill.hpp"

namespace darm::renderer {

using atlas::Layer;
using atlas::Plane;

namespace {

// What is left of a texel's variance in the mean that a pixel shows, if the errors of `texels` around it are the same:
// the areas of two averages, one after the other, add.
float left_in_pixel(float texels) { return texels / (texels + kPixelTexels - 1); }

// Squared display error, mean over the channels, of a linear colour whose luminance has this squared error and whose
// hue is right: of two values as far to either side of it. What is over white is not seen.
double display_square(const std::array<float, 3>& linear, float squared) {
  if (!(squared > 0)) return 0;
  const float grey = luminance(glm::vec3(linear[0], linear[1], linear[2]));
  const float spread = grey > 0 ? std::sqrt(squared) / grey : 0.0f;
  double sum = 0;
  for (const float value : linear) {
    const float off = grey > 0 ? value * spread : std::sqrt(squared);
    const float middle = srgb(value);
    const float above = srgb(value + off) - middle;
    const float below = srgb(std::max(value - off, 0.0f)) - middle;
    sum += 0.5 * (double{above} * double{above} + double{below} * double{below});
  }
  return std::min(sum / 3, 0.25);
}

// What texels filled from others are off by: as much as those differ from one another. As if one more of them were
// known that is a quarter of the display's range off, which stands for what all of them have missed.
class FillError {
 public:
  void see(const std::array<float, 3>& linear) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double shown = srgb(linear[c]);
      sum_[c] += shown;
      squares_[c] += shown * shown;
    }
    ++known_;
  }
  [[nodiscard]] double square() const {
    const double n = known_;
    double apart = 0;  // n times the variance, mean of the channels
    for (std::size_t c = 0; c < 3 && known_ > 0; ++c) apart += std::max(squares_[c] - sum_[c] * sum_[c] / n, 0.0) / 3;
    return (apart + 0.25 * 0.25) / (n + 1);
  }

 private:
  std::array<double, 3> sum_{}, squares_{};  // of values in 0..1, at most 900 of them
  int known_ = 0;
};

// A texel whose standard error is this share of its mean or less, of enough samples to say so, is what light is like
// there: rare bright samples are of no such accord before there are sixteen of them.
constexpr float kSure = 0.25f;
constexpr float kFewSamples = 8;
constexpr float kLoneSample = 0.1f;  // variance of one sharp sample over its square

}  // namespace

TileDisplay::Step TileDisplay::step_of(int coordinate) {
  if (coordinate < 0) return {0, coordinate + kTileSize};
  if (coordinate >= kTileSize) return {2, coordinate - kTileSize};
  return {1, coordinate};
}

struct SlotColours {
  SlotFill<3> fill;
  std::array<float, kSlotTexels> variance{};  // of the reflected light's luminance in a pixel, exposed
  std::array<float, kSlotTexels> smear{};     // its other square error, as FilteredTexel has it, likewise
  std::array<bool, kSlotTexels> lightless{};
};

void TileDisplay::look_around(TileId id, const LevelTiles& level) {
  for (int d = 0; d < 9; ++d) {
    auto& n = around_[static_cast<std::size_t>(d)];
    n = {};
    const auto other = neighbour_of(id, level, d % 3 - 1, d / 3 - 1);
    if (!other) continue;
    n.light = store_.read(*other);
    n.facts = facts_.find(*other);
  }
}

bool TileDisplay::wants_filter(const TexelMask& mask) const {
  const auto& own = around_[4];
  if (options_.filter_samples <= 0 || !own.light || !own.facts) return false;
  for (int t = 0; t < kTileTexels; ++t)
    if (mask.test(t) && own.light->count(Layer::kSoft, t) > 0) return true;
  return false;
}

// The nine tiles, as they were measured.
void TileDisplay::gather_nine() {
  square_.reset(3 * kTileSize);
  for (int tile = 0; tile < 9; ++tile) {
    const auto& from = around_[static_cast<std::size_t>(tile)];
    if (!from.facts) continue;
    for (int t = 0; t < kTileTexels; ++t) {
      const auto at = static_cast<std::size_t>((tile / 3 * kTileSize + t / kTileSize) * square_.size +
                                               tile % 3 * kTileSize + t % kTileSize);
      square_.patch[at] = from.facts->patch[static_cast<std::size_t>(t)];
      if (!from.light || square_.patch[at] == kNobody) continue;
      const float n = from.light->count(Layer::kSoft, t);
      if (n <= 0 || from.light->lightless(t)) continue;
      square_.count[at] = n;
      square_.grey[at] = luminance(from.light->mean(Layer::kSoft, t));
    }
  }
}

bool TileDisplay::sure_of(std::size_t at) const {
  const Place place = place_of_nine(at);
  const auto& light = *around_[place.tile].light;
  const float grey = square_.grey[at];
  return square_.count[at] >= kFewSamples &&
         light.variance_of_mean(Layer::kSoft, place.texel, grey * grey) <= kSure * kSure * grey * grey;
}

TileDisplay::Place TileDisplay::place_of_nine(std::size_t at) const {
  const int x = static_cast<int>(at) % square_.size;
  const int y = static_cast<int>(at) / square_.size;
  return {static_cast<std::size_t>(y / kTileSize * 3 + x / kTileSize), y % kTileSize * kTileSize + x % kTileSize};
}

void TileDisplay::find_lost() {
  find_outliers(square_, outliers_);
  std::erase_if(outliers_, [&](const Outlier& outlier) { return sure_of(outlier.at); });
  lost_.clear();
  for (const Outlier& outlier : outliers_) {
    const Place place = place_of_nine(outlier.at);
    const glm::vec3 soft = around_[place.tile].light->mean(Layer::kSoft, place.texel);
    lost_.take(static_cast<int>(place.tile), square_.patch[outlier.at], soft * (1 - outlier.scale),
               square_.grey[outlier.at] * (1 - outlier.scale));
  }
  lost_.measure(square_);
}

// In the window as it was measured.
void TileDisplay::tame() {
  const int margin = margin_of_window();
  for (const Outlier& outlier : outliers_) {
    const int x = static_cast<int>(outlier.at) % square_.size - margin;
    const int y = static_cast<int>(outlier.at) / square_.size - margin;
    if (x < 0 || y < 0 || x >= window_.size || y >= window_.size) continue;
    const auto at = static_cast<std::size_t>(y * window_.size + x);
    for (auto& channel : window_.irradiance) channel[at] *= outlier.scale;
    window_.grey[at] *= outlier.scale;
    window_.grey_m2[at] *= outlier.scale * outlier.scale;
  }
}

void TileDisplay::share_out() {
  lost_share_ = 0;
  if (lost_.empty()) return;
  double lost = 0, shown = 0;
  for (int y = 0; y < kSlotSize; ++y)
    for (int x = 0; x < kSlotSize; ++x) {
      auto& texel = filtered_[static_cast<std::size_t>(y * kSlotSize + x)];
      if (!texel.known) continue;
      const auto at = static_cast<std::size_t>((y + window_.radius) * window_.size + x + window_.radius);
      const auto share = lost_.at(window_.patch[at], x, y);
      for (std::size_t c = 0; c < 3; ++c) {
        const float all = share.irradiance[static_cast<int>(c)];
        texel.irradiance[c] += all * share.trusted;
        texel.withheld[c] = all * (1 - share.trusted);
      }
      texel.lost_error = share.error;
      lost += double{share.grey};
      shown += double{luminance({texel.irradiance[0], texel.irradiance[1], texel.irradiance[2]})};
    }
  lost_share_ = lost > 0 ? static_cast<float>(lost / (lost + shown)) : 0.0f;
}

// Around the window, of the nine tiles.
int TileDisplay::margin_of_window() const { return kTileSize - 1 - window_.radius; }

// A tile knows of walls on its border with the next as far as they stand on its own side.
std::uint8_t TileDisplay::walls_at(const Step& row, const Step& column) const {
  const auto bit_of = [&](int down, int right, bool in_row, int line, int bit) {
    const int y = row.tile + down, x = column.tile + right;
    if (x < 0 || y < 0) return false;
    const auto& facts = around_[static_cast<std::size_t>(y * 3 + x)].facts;
    if (!facts) return false;
    const auto& lines = in_row ? facts->walls.rows : facts->walls.columns;
    return (lines[static_cast<std::size_t>(line)] >> bit & 1u) != 0;
  };
  const bool before =
      bit_of(0, 0, true, row.texel, column.texel) || (column.texel == 0 && bit_of(0, -1, true, row.texel, kTileSize));
  const bool above =
      bit_of(0, 0, false, column.texel, row.texel) || (row.texel == 0 && bit_of(-1, 0, false, column.texel, kTileSize));
  return static_cast<std::uint8_t>((before ? kWallBefore : 0) | (above ? kWallAbove : 0));
}

void TileDisplay::gather() {
  window_.reset(kMaxFilterRadius);
  const int margin = margin_of_window();
  const bool walled = std::ranges::any_of(around_, [](const auto& n) { return n.facts && n.facts->walls.any(); });
  for (int y = 0; y < window_.size; ++y) {
    const Step row = step_of(y - window_.radius - 1);
    for (int x = 0; x < window_.size; ++x) {
      const Step column = step_of(x - window_.radius - 1);
      const auto& from = around_[static_cast<std::size_t>(row.tile * 3 + column.tile)];
      const auto at = static_cast<std::size_t>(y * window_.size + x);
      const auto of_nine = static_cast<std::size_t>((y + margin) * square_.size + x + margin);
      const int texel = row.texel * kTileSize + column.texel;
      window_.patch[at] = square_.patch[of_nine];
      if (walled) window_.walls[at] = walls_at(row, column);
      if (!from.facts || !from.light || window_.patch[at] == kNobody) continue;
      if (from.facts->knows_albedo(texel) && from.light->count(Layer::kSharp, texel) > 0) {
        const glm::vec3 albedo = from.facts->albedo(texel);
        window_.tint[at] = options_.exposure * luminance(albedo);
        window_.floor[at] = options_.exposure *
                            luminance(from.light->mean(Layer::kSharp, texel) * albedo + from.facts->emission(texel));
      }
      if (square_.count[of_nine] <= 0) continue;
      const glm::vec3 soft = from.light->mean(Layer::kSoft, texel);
      window_.count[at] = square_.count[of_nine];
      for (int c = 0; c < 3; ++c) window_.irradiance[static_cast<std::size_t>(c)][at] = soft[c];
      window_.grey[at] = square_.grey[of_nine];
      window_.grey_m2[at] = from.light->plane(Plane::kSoftM2)[texel];
    }
  }
}

// Sharp and soft light of a texel as far as it has samples (soft light: or the filter has). Which layers it has.
TileDisplay::Lit TileDisplay::light_of(const Neighbour& from, int texel, const FilteredTexel& filtered) {
  Lit lit;
  if (!from.light) return lit;
  if (from.light->lightless(texel)) {
    lit.lightless = lit.has_sharp = lit.has_soft = true;
    return lit;
  }
  if (from.light->count(Layer::kSharp, texel) > 0) {
    lit.has_sharp = true;
    lit.sharp.mean = from.light->mean(Layer::kSharp, texel);
    const float grey = luminance(lit.sharp.mean);
    // One shadow ray a sample: a lone sample is mostly right, its spread is about a third of its value (measured).
    lit.sharp.variance = from.light->variance_of_mean(Layer::kSharp, texel, kLoneSample * grey * grey);
  }
  if (filtered.known) {
    lit.has_soft = true;
    lit.soft = {
        {filtered.irradiance[0], filtered.irradiance[1], filtered.irradiance[2]}, filtered.variance, filtered.texels};
    lit.smear = filtered.smear + filtered.lost_error * filtered.lost_error;
  } else if (from.light->count(Layer::kSoft, texel) > 0) {
    lit.has_soft = true;
    lit.soft.mean = from.light->mean(Layer::kSoft, texel);
    const float grey = luminance(lit.soft.mean);
    lit.soft.variance = from.light->variance_of_mean(Layer::kSoft, texel, grey * grey);
  }
  return lit;
}

// Gives the layers a texel lacks what the coarse level has of its place; `at` as in StoredLight::guess().
void TileDisplay::add_guess(Lit& lit, TileId id, std::uint32_t patch, const glm::vec2& at) const {
  if (coarse_ == nullptr || id.level() == coarse_->level() || (lit.has_sharp && lit.has_soft)) return;
  const auto guess = coarse_->guess(PatchId{patch}, id.level(), at);
  if (!guess) return;
  if (!lit.has_sharp) lit.sharp = sharp_of(*guess);
  if (!lit.has_soft) lit.soft = soft_of(*guess);
  lit.has_sharp = lit.has_soft = true;
}

void TileDisplay::shade_slot(TileId id, const LevelTiles& level, SlotColours& colours) {
  if (level.x == 0) return;  // no such level
  const glm::vec2 first(static_cast<float>(id.index() % level.x * kTileSize) - 0.5f,
                        static_cast<float>(id.index() / level.x * kTileSize) - 0.5f);  // centre of slot texel (0, 0)
  for (int y = 0; y < kSlotSize; ++y) {
    const Step row = step_of(y - 1);
    for (int x = 0; x < kSlotSize; ++x) {
      const Step column = step_of(x - 1);
      const auto& from = around_[static_cast<std::size_t>(row.tile * 3 + column.tile)];
      const auto at = static_cast<std::size_t>(y * kSlotSize + x);
      const int texel = row.texel * kTileSize + column.texel;
      if (!from.facts) continue;
      const std::uint32_t patch = from.facts->patch[static_cast<std::size_t>(texel)];
      colours.fill.patch[at] = patch;
      if (patch == kNobody || !from.facts->knows_albedo(texel)) continue;
      Lit lit = light_of(from, texel, filtered_[at]);
      add_guess(lit, id, patch, first + glm::vec2(x, y));
      if (!lit.has_sharp || !lit.has_soft) continue;  // filled from those that have it
      const glm::vec3 albedo = from.facts->albedo(texel);
      const float grey = luminance(albedo) * options_.exposure;
      colours.variance[at] =
          grey * grey *
          (lit.soft.variance * left_in_pixel(lit.soft.texels) + lit.sharp.variance * left_in_pixel(lit.sharp.texels));
      colours.smear[at] = grey * grey * lit.smear;
      const glm::vec3 all =
          ((lit.sharp.mean + lit.soft.mean) * albedo + from.facts->emission(texel)) * options_.exposure;
      colours.fill.set(static_cast<int>(at), {all.x, all.y, all.z});
      colours.lightless[at] = lit.lightless;
    }
  }
}

double TileDisplay::fill_square(const TexelMask& mask, const SlotColours& colours,
                                const std::array<bool, kSlotTexels>& known) const {
  FillError fill;
  for (int t = 0; t < kTileTexels; ++t) {
    const auto at = static_cast<std::size_t>((t / kTileSize + 1) * kSlotSize + t % kTileSize + 1);
    const bool wanted = mask.test(t) && known[at];
    if (wanted && !(around_[4].facts && around_[4].facts->patch[static_cast<std::size_t>(t)] == kNobody))
      fill.see(colours.fill.value[at]);
  }
  return fill.square();
}

float TileDisplay::error_of(const TexelMask& mask, const SlotColours& colours,
                            const std::array<bool, kSlotTexels>& known, float& samples) const {
  double squares = 0;
  double smear = 0;
  double count = 0;
  int texels = 0;
  int filled = 0;
  for (int t = 0; t < kTileTexels; ++t) {
    if (!mask.test(t)) continue;
    const auto at = static_cast<std::size_t>((t / kTileSize + 1) * kSlotSize + t % kTileSize + 1);
    if (around_[4].facts && around_[4].facts->patch[static_cast<std::size_t>(t)] == kNobody) continue;
    ++texels;
    if (around_[4].light) count += around_[4].light->count(Layer::kSoft, t);
    if (!known[at]) {
      ++filled;
      continue;
    }
    const auto& shown = colours.fill.value[at];
    squares += display_square(shown, colours.variance[at]);
    smear += std::copysign(display_square(shown, std::abs(colours.smear[at])), double{colours.smear[at]});
  }
  if (texels == 0) return samples = 0;
  // They have the errors of those they are filled from besides.
  if (filled < texels) squares *= static_cast<double>(texels) / (texels - filled);
  if (filled > 0) squares += filled * fill_square(mask, colours, known);
  samples = static_cast<float>(count / texels);
  return static_cast<float>(std::sqrt((squares + std::max(smear, 0.0)) / texels));
}

std::optional<TilePicture> TileDisplay::draw(TileId id, const LevelTiles& level, const TexelMask& mask, Unlit unlit) {
  look_around(id, level);
  if (wants_filter(mask)) {
    gather_nine();
    find_lost();
    gather();
    tame();
    filter_.run(window_, options_.filter_samples, filtered_);
    share_out();
  } else {
    filtered_.assign(kSlotTexels, FilteredTexel{});
    lost_share_ = 0;
  }
  SlotColours colours;
  shade_slot(id, level, colours);
  if (std::none_of(colours.fill.known.begin(), colours.fill.known.end(), [](bool k) { return k; })) return std::nullopt;
  const auto known = colours.fill.known;  // before the others are filled
  colours.fill.replace_by_neighbours(colours.lightless);
  if (unlit == Unlit::kGrey)
    colours.fill.run_neutral([](const std::array<float, 3>& mean) {
      const float grey = luminance(glm::vec3(mean[0], mean[1], mean[2]));
      return std::array{grey, grey, grey};
    });
  else
    colours.fill.run();

  auto image = std::make_shared<TileImage>();
  for (std::size_t at = 0; at < kSlotTexels; ++at)
    for (std::size_t c = 0; c < 3; ++c) image->rgb[at * 3 + c] = srgb_code(colours.fill.value[at][c]);
  convert_to_planes(*image);
  if (around_[4].facts) image->coverage = around_[4].facts->coverage;

  TilePicture picture;
  picture.error = error_of(mask, colours, known, picture.samples);
  picture.image = std::move(image);
  picture.lost_share = lost_share_;
  return picture;
}

}  // namespace darm::renderer

#include "actors/tile_scheduler/chain_loss.hpp"

#include <algorithm>
#include <array>
#include <memory>
#include <numeric>

namespace darm::tile_scheduler {
namespace {

constexpr int kHalvings = 5;  // of a slot's 32 texels, down to one

// Bilinear look-up at position (x, y); texel (i, j) has its centre at (i + 0.5, j + 0.5). At least 2 texels a side.
float look_up(const std::uint8_t* luma, int width, int height, glm::vec2 at) {
  const float fx = std::clamp(at.x - 0.5f, 0.0f, static_cast<float>(width - 1));
  const float fy = std::clamp(at.y - 0.5f, 0.0f, static_cast<float>(height - 1));
  const int x = std::min(static_cast<int>(fx), width - 2);
  const int y = std::min(static_cast<int>(fy), height - 2);
  const float wx = fx - static_cast<float>(x), wy = fy - static_cast<float>(y);
  const auto* row = luma + static_cast<std::ptrdiff_t>(y) * width + x;
  const float top = static_cast<float>(row[0]) + static_cast<float>(row[1] - row[0]) * wx;
  const float bottom = static_cast<float>(row[width]) + static_cast<float>(row[width + 1] - row[width]) * wx;
  return top + (bottom - top) * wy;
}

// Box averages of a slot's luma: 16x16, 8x8, 4x4, 2x2, 1x1, one after the other.
class Halvings {
 public:
  explicit Halvings(const TileImage& image) {
    const std::uint8_t* from = image.y.data();
    for (int k = 1; k <= kHalvings; ++k) {
      auto* to = luma_.data() + kFirst[static_cast<std::size_t>(k)];
      const int side = kSlotSize >> k;
      for (int y = 0; y < side; ++y)
        for (int x = 0; x < side; ++x) {
          const auto* p = from + 4 * y * side + 2 * x;
          to[y * side + x] = static_cast<std::uint8_t>((p[0] + p[1] + p[2 * side] + p[2 * side + 1] + 2) / 4);
        }
      from = to;
    }
  }
  /// After 1..5 halvings, at a position in texels of the full size.
  [[nodiscard]] float at(int halvings, glm::vec2 slot) const {
    const int side = kSlotSize >> halvings;
    const auto* p = luma_.data() + kFirst[static_cast<std::size_t>(halvings)];
    return side == 1 ? static_cast<float>(p[0]) : look_up(p, side, side, slot / static_cast<float>(1 << halvings));
  }

 private:
  static constexpr std::array<int, kHalvings + 1> kFirst{0, 0, 256, 320, 336, 340};
  std::array<std::uint8_t, 341> luma_;
};

// Sum of losses over samples.
struct Sum {
  std::array<double, kChainLength + 1> loss{};
  double samples = 0;

  void add(const Sum& other) {
    for (std::size_t i = 0; i < loss.size(); ++i) loss[i] += other.loss[i];
    samples += other.samples;
  }
  [[nodiscard]] double mean(std::size_t i) const { return samples > 0 ? loss[i] / samples : 0.0; }
};

class Measurement {
 public:
  Measurement(std::span<const WeightedChain> chains, const ImageLookup& images, const CoarseLuma* coarse,
              int coarse_level, const LossOptions& options)
      : chains_(chains),
        coarse_(coarse != nullptr && coarse->width >= 2 && coarse->height >= 2 ? coarse : nullptr),
        coarse_level_(coarse_level),
        options_(options),
        sums_(chains.size()) {
    numbers_.resize(chains.size());
    for (std::size_t c = 0; c < chains.size(); ++c)
      for (std::size_t i = 0; i < kChainLength; ++i) {
        const auto tile = chains[c].chain.tiles[i];
        numbers_[c][i] = TileIndex::kAbsent;
        if (tile == kNoTile) continue;
        const auto number = numbers_[c][i] = tiles_.insert(tile);
        if (number < pictures_.size()) continue;
        const auto* stored = images(tile);
        pictures_.push_back(stored != nullptr ? stored->image : nullptr);
      }
    halvings_.resize(pictures_.size());
  }

  void look(const SampleTaps& taps) {
    if (taps.chain >= chains_.size()) return;
    const auto& number = numbers_[taps.chain];
    const auto has_picture = [&](std::size_t i) {
      return number[i] != TileIndex::kAbsent && pictures_[number[i]] != nullptr;
    };
    std::size_t finest = 0;
    while (finest < kChainLength && !has_picture(finest)) ++finest;
    if (finest == kChainLength) return;
    const auto drawn = [&](std::size_t i) {
      return look_up(pictures_[number[i]]->y.data(), kSlotSize, kSlotSize, taps.position(i));
    };
    const auto halved = [&](int times) {
      if (times <= 0) return drawn(finest);
      return halvings_of(number[finest]).at(std::min(times, kHalvings), taps.position(finest));
    };
    const float sharp = drawn(finest);
    Sum sum;
    sum.samples = 1;
    const auto note = [&](std::size_t i, float v) { sum.loss[i] = double(v - sharp) * double(v - sharp); };
    for (std::size_t i = finest + 1; i < kChainLength; ++i)
      note(i, has_picture(i) ? drawn(i) : halved(static_cast<int>(i - finest)));
    note(kServedByCoarse,
         coarse_ != nullptr
             ? look_up(coarse_->luma.data(), static_cast<int>(coarse_->width), static_cast<int>(coarse_->height),
                       glm::vec2(taps.coarse[0], taps.coarse[1]) * 0.125f)
             : halved(coarse_level_ - chains_[taps.chain].chain.sharp_level() - static_cast<int>(finest)));
    sum.loss[kServedByCoarse] += double(options_.coarse_error);
    add_finer_octaves(sum, finest);
    sums_[taps.chain].add(sum);
  }

  [[nodiscard]] std::vector<ChainLoss> result() const {
    Sum view;
    std::vector<Sum> of_tile(tiles_.size());  // by the chain's first tile, and by its second
    for (std::size_t c = 0; c < sums_.size(); ++c) {
      view.add(sums_[c]);
      for (std::size_t i = 0; i < 2; ++i)
        if (numbers_[c][i] != TileIndex::kAbsent) of_tile[numbers_[c][i]].add(sums_[c]);
    }
    if (view.samples <= 0) return {};
    std::vector<ChainLoss> out(sums_.size());
    for (std::size_t c = 0; c < sums_.size(); ++c) {
      const Sum* prior = &view;
      for (std::size_t i = 2; i-- > 0;)
        if (numbers_[c][i] != TileIndex::kAbsent && of_tile[numbers_[c][i]].samples > 0)
          prior = &of_tile[numbers_[c][i]];
      const double weight = std::max(double(options_.prior_samples), 1e-3);
      float before = 0;
      for (std::size_t i = 0; i <= kChainLength; ++i) {
        const double loss = (sums_[c].loss[i] + weight * prior->mean(i)) / (sums_[c].samples + weight);
        before = out[c][i] = std::max(before, static_cast<float>(loss));
      }
    }
    return out;
  }

 private:
  const Halvings& halvings_of(std::uint32_t number) {
    if (halvings_[number] == nullptr) halvings_[number] = std::make_unique<Halvings>(*pictures_[number]);
    return *halvings_[number];
  }
  // The sharp level has no picture: what was measured from `finest` on is raised by what the octaves before it lose.
  void add_finer_octaves(Sum& sum, std::size_t finest) const {
    const double beside = sum.loss[finest + 1];
    double lost = 0;
    for (std::size_t i = 0; i < finest; ++i) {
      double octave = beside;
      for (std::size_t k = i; k < finest; ++k) octave *= double(options_.finer_octave);
      sum.loss[i] = lost;
      lost += octave;
    }
    for (std::size_t i = finest; i < sum.loss.size(); ++i) sum.loss[i] += lost;
  }

  std::span<const WeightedChain> chains_;
  const CoarseLuma* coarse_;
  int coarse_level_;
  LossOptions options_;
  TileIndex tiles_;
  std::vector<std::array<std::uint32_t, kChainLength>> numbers_;  // per chain
  std::vector<std::shared_ptr<const TileImage>> pictures_;        // per tile
  std::vector<std::unique_ptr<Halvings>> halvings_;               // per tile, made when first read
  std::vector<Sum> sums_;                                         // per chain
};

// The taps' order by chain: a chain's pictures are then read one after the other, while they are in the cache.
std::vector<std::uint32_t> by_chain(std::span<const SampleTaps> taps, std::size_t chains) {
  std::vector<std::uint32_t> first(chains + 2, 0);
  const auto bucket = [&](const SampleTaps& t) { return std::min<std::size_t>(t.chain, chains); };
  for (const auto& t : taps) ++first[bucket(t) + 1];
  std::partial_sum(first.begin(), first.end(), first.begin());
  std::vector<std::uint32_t> order(taps.size());
  for (std::uint32_t i = 0; i < taps.size(); ++i) order[first[bucket(taps[i])]++] = i;
  return order;
}

}  // namespace

std::vector<ChainLoss> measure_losses(std::span<const WeightedChain> chains, std::span<const SampleTaps> taps,
                                      const ImageLookup& images, const CoarseLuma* coarse, int coarse_level,
                                      const LossOptions& options) {
  Measurement measurement(chains, images, coarse, coarse_level, options);
  for (const auto i : by_chain(taps, chains.size())) measurement.look(taps[i]);
  return measurement.result();
}

}  // namespace darm::tile_scheduler

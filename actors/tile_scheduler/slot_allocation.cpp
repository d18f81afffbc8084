#include "actors/tile_scheduler/slot_allocation.hpp"

#include <algorithm>
#include <numeric>
#include <queue>

namespace darm::tile_scheduler {
namespace {

constexpr std::uint32_t kNone = TileIndex::kAbsent;
constexpr int kRounds = 16;
constexpr std::size_t kFirstExchange = 8;   // the chosen over this are exchanged at first
constexpr std::size_t kLastExchange = 256;  // and over this at last

// The request with tiles as dense numbers, and per tile the chains it can serve.
class Problem {
 public:
  Problem(const AllocationRequest& request, const AllocationOptions& options) : request_(request), options_(options) {
    tiles_.reserve(request.chains.size());
    links_.resize(request.chains.size());
    loss_.resize(request.chains.size());
    for (std::size_t c = 0; c < request.chains.size(); ++c) read_chain(c);
    if (request.losses.size() == loss_.size()) loss_.assign(request.losses.begin(), request.losses.end());
    make_entries();
    resident_.assign(tiles_.size(), false);
    for (const auto tile : request.residents)
      if (const auto number = tiles_.find(tile); number != kNone) resident_[number] = true;
  }

  /// Tiles that are some chain's finest.
  [[nodiscard]] std::vector<std::uint32_t> finest() const {
    std::vector<std::uint32_t> out;
    std::vector<bool> taken(tiles_.size(), false);
    for (const auto& links : links_)
      for (const auto tile : links) {
        if (tile == kNone) continue;
        if (!taken[tile]) out.push_back(tile);
        taken[tile] = true;
        break;
      }
    return out;
  }

  /// Residents that serve some chain when only residents are there.
  [[nodiscard]] std::vector<std::uint32_t> useful_residents() const {
    std::vector<std::uint32_t> out;
    std::vector<bool> taken(tiles_.size(), false);
    for (const auto& links : links_)
      for (const auto tile : links) {
        if (tile == kNone || !resident_[tile]) continue;
        if (!taken[tile]) out.push_back(tile);
        taken[tile] = true;
        break;
      }
    return out;
  }

  /// Adds tiles to `chosen` by falling gain until the slots are full or nothing gains. Coarse tiles come first and are
  /// often outdone by finer ones later: those give their slots back.
  void fill(std::vector<std::uint32_t>& chosen, double bonus) const;
  /// Takes out tiles whose every sample has a finer one among `chosen`. True if there were any.
  bool prune(std::vector<std::uint32_t>& chosen) const;
  /// Trades tiles that matter least for tiles that would gain most, while that helps.
  void exchange(std::vector<std::uint32_t>& chosen, double bonus) const;
  /// Benefit if every allowed tile were chosen.
  [[nodiscard]] double upper_bound() const {
    double sum = 0;
    for (std::size_t c = 0; c < links_.size(); ++c) {
      std::size_t finest = 0;
      while (finest < kChainLength && links_[c][finest] == kNone) ++finest;
      sum += double(request_.chains[c].weight) *
             double(loss_[c][kServedByCoarse] - std::min(loss_[c][finest], loss_[c][kServedByCoarse]));
    }
    return sum;
  }
  [[nodiscard]] Allocation result(std::vector<std::uint32_t> chosen) const;

 private:
  struct Entry {
    std::uint32_t chain;
    float loss;    // of the chain if this tile serves it
    float weight;  // of the chain
  };

  void read_chain(std::size_t c) {
    const auto& chain = request_.chains[c].chain;
    for (std::size_t i = 0; i < chain.tiles.size(); ++i) {
      links_[c][i] = kNone;
      if (chain.tiles[i] == kNoTile) continue;
      const auto number = tiles_.insert(chain.tiles[i]);
      if (number == allowed_.size()) allowed_.push_back(!request_.available || request_.available(chain.tiles[i]));
      if (allowed_[number]) links_[c][i] = number;
    }
    for (int i = 0; i <= kChainLength; ++i)
      loss_[c][static_cast<std::size_t>(i)] = serving_loss(chain, i, request_.coarse_level, options_);
  }

  void drop_least(std::vector<std::uint32_t>& chosen, std::size_t count) const;
  [[nodiscard]] double benefit_of(const std::vector<std::uint32_t>& chosen) const;

  void make_entries() {
    first_.assign(tiles_.size() + 1, 0);
    for (const auto& links : links_)
      for (const auto tile : links)
        if (tile != kNone) ++first_[tile + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    entries_.resize(first_.back());
    auto next = first_;
    for (std::size_t c = 0; c < links_.size(); ++c)
      for (std::size_t i = 0; i < links_[c].size(); ++i)
        if (links_[c][i] != kNone)
          entries_[next[links_[c][i]]++] = {static_cast<std::uint32_t>(c), loss_[c][i], request_.chains[c].weight};
  }

  [[nodiscard]] double gain(std::uint32_t tile, const std::vector<float>& best) const {
    double sum = 0;
    for (auto e = first_[tile]; e < first_[tile + 1]; ++e) {
      const auto& entry = entries_[e];
      const float better = best[entry.chain] - entry.loss;
      if (better > 0) sum += double(entry.weight * better);
    }
    return sum;
  }
  void take(std::uint32_t tile, std::vector<float>& best) const {
    for (auto e = first_[tile]; e < first_[tile + 1]; ++e) {
      const auto& entry = entries_[e];
      best[entry.chain] = std::min(best[entry.chain], entry.loss);
    }
  }

  const AllocationRequest& request_;
  const AllocationOptions& options_;
  TileIndex tiles_;
  std::vector<bool> allowed_;
  std::vector<bool> resident_;
  std::vector<std::array<std::uint32_t, kChainLength>> links_;  // per chain: allowed tiles, else kNone
  std::vector<ChainLoss> loss_;
  std::vector<std::uint32_t> first_;  // per tile: its entries
  std::vector<Entry> entries_;
};

void Problem::fill(std::vector<std::uint32_t>& chosen, double bonus) const {
  struct Candidate {
    double gain;
    std::uint32_t tile;
  };
  const auto worse = [this](const Candidate& a, const Candidate& b) {
    if (a.gain != b.gain) return a.gain < b.gain;
    return tiles_.keys()[a.tile] >
           tiles_.keys()[b.tile];  // ties by tile id: the same answer whatever the order of chains
  };
  std::vector<float> best(links_.size());
  for (std::size_t c = 0; c < best.size(); ++c) best[c] = loss_[c][kServedByCoarse];
  std::vector<bool> taken(tiles_.size(), false);
  for (const auto tile : chosen) {
    take(tile, best);
    taken[tile] = true;
  }
  const auto value = [&](std::uint32_t tile) { return gain(tile, best) * (resident_[tile] ? 1.0 + bonus : 1.0); };
  std::vector<Candidate> initial;
  initial.reserve(tiles_.size());
  for (std::uint32_t tile = 0; tile < tiles_.size(); ++tile)
    if (!taken[tile])
      if (const double v = value(tile); v > 0) initial.push_back({v, tile});
  std::priority_queue queue(worse, std::move(initial));
  for (int round = 0; round < kRounds; ++round) {
    while (chosen.size() < request_.slots && !queue.empty()) {
      auto top = queue.top();
      queue.pop();
      top.gain = value(top.tile);  // gains only fall (submodular): a fresh one that still leads is the largest
      if (top.gain <= 0) continue;
      if (!queue.empty() && worse(top, queue.top())) {
        queue.push(top);
        continue;
      }
      chosen.push_back(top.tile);
      take(top.tile, best);
    }
    // What is pruned serves nobody: the losses, and so the queue, stay right without it.
    if (!prune(chosen)) break;
  }
}

bool Problem::prune(std::vector<std::uint32_t>& chosen) const {
  std::vector<bool> taken(tiles_.size(), false);
  std::vector<bool> serves(tiles_.size(), false);
  for (const auto tile : chosen) taken[tile] = true;
  for (const auto& links : links_)
    for (const auto tile : links)
      if (tile != kNone && taken[tile]) {
        serves[tile] = true;
        break;
      }
  return std::erase_if(chosen, [&](std::uint32_t tile) { return !serves[tile]; }) > 0;
}

// Greedy picks coarse tiles first; finer ones that come later leave some of them with little to do, yet never nothing.
// Those are taken back, a share of the slots at a time, and the slots given anew.
void Problem::exchange(std::vector<std::uint32_t>& chosen, double bonus) const {
  double best = benefit_of(chosen);
  const std::size_t least = std::max<std::size_t>(1, chosen.size() / kLastExchange);
  std::size_t count = std::max(least, chosen.size() / kFirstExchange);
  while (count >= least) {
    auto trial = chosen;
    drop_least(trial, count);
    fill(trial, bonus);
    const double benefit = benefit_of(trial);
    if (benefit > best) {
      best = benefit;
      chosen = std::move(trial);
    } else {
      count /= 2;
    }
  }
}

void Problem::drop_least(std::vector<std::uint32_t>& chosen, std::size_t count) const {
  std::vector<bool> taken(tiles_.size(), false);
  for (const auto tile : chosen) taken[tile] = true;
  std::vector<double> loss(tiles_.size(), 0.0);  // if the tile alone were taken out
  for (std::size_t c = 0; c < links_.size(); ++c) {
    const auto is_there = [&](std::size_t i) { return links_[c][i] != kNone && taken[links_[c][i]]; };
    std::size_t served = 0;
    while (served < kChainLength && !is_there(served)) ++served;
    if (served == kChainLength) continue;
    std::size_t next = served + 1;
    while (next < kChainLength && !is_there(next)) ++next;
    loss[links_[c][served]] += double(request_.chains[c].weight) * double(loss_[c][next] - loss_[c][served]);
  }
  std::sort(chosen.begin(), chosen.end(), [&](std::uint32_t a, std::uint32_t b) {
    return loss[a] != loss[b] ? loss[a] > loss[b] : tiles_.keys()[a] < tiles_.keys()[b];
  });
  chosen.resize(chosen.size() - std::min(count, chosen.size()));
}

double Problem::benefit_of(const std::vector<std::uint32_t>& chosen) const {
  std::vector<bool> taken(tiles_.size(), false);
  for (const auto tile : chosen) taken[tile] = true;
  double sum = 0;
  for (std::size_t c = 0; c < links_.size(); ++c) {
    std::size_t position = 0;
    while (position < kChainLength && (links_[c][position] == kNone || !taken[links_[c][position]])) ++position;
    sum += double(request_.chains[c].weight) * double(loss_[c][kServedByCoarse] - loss_[c][position]);
  }
  return sum;
}

Allocation Problem::result(std::vector<std::uint32_t> chosen) const {
  std::vector<bool> taken(tiles_.size(), false);
  for (const auto tile : chosen) taken[tile] = true;
  Allocation out;
  out.served.resize(links_.size());
  std::vector<float> weight(tiles_.size(), 0.0f);
  for (std::size_t c = 0; c < links_.size(); ++c) {
    std::size_t position = 0;
    while (position < kChainLength && (links_[c][position] == kNone || !taken[links_[c][position]])) ++position;
    const float w = request_.chains[c].weight;
    if (position < kChainLength) weight[links_[c][position]] += w;
    out.served[c] = static_cast<std::uint8_t>(position);
    out.benefit += double(w) * (loss_[c][kServedByCoarse] - loss_[c][position]);
  }
  std::erase_if(chosen, [&](std::uint32_t tile) { return weight[tile] <= 0; });
  std::sort(chosen.begin(), chosen.end(), [&](std::uint32_t a, std::uint32_t b) {
    return weight[a] != weight[b] ? weight[a] > weight[b] : tiles_.keys()[a] < tiles_.keys()[b];
  });
  for (const auto tile : chosen) {
    out.tiles.push_back(tiles_.keys()[tile]);
    out.weights.push_back(weight[tile]);
  }
  return out;
}

}  // namespace

float serving_loss(const Chain& chain, int position, int coarse_level, const AllocationOptions& options) {
  if (position < kChainLength) return options.loss[static_cast<std::size_t>(position)];
  const int distance = std::max(0, coarse_level - chain.sharp_level());
  const int known = std::min(distance, kMaxCoarserLevels);
  return options.loss[static_cast<std::size_t>(known)] + options.coarse_penalty +
         static_cast<float>(distance - known) * options.loss_per_further_level;
}

Allocation allocate_slots(const AllocationRequest& request, const AllocationOptions& options) {
  const Problem problem(request, options);
  if (auto all = problem.finest(); all.size() <= request.slots) return problem.result(std::move(all));
  // Greedy picks near the cut-off depend on small changes of weight. What is there stays unless that costs something.
  const double most = problem.upper_bound();
  Allocation stay;
  std::vector<std::uint32_t> chosen;
  if (auto kept = problem.useful_residents(); !kept.empty() && kept.size() <= request.slots) {
    problem.fill(kept, 0);
    if (request.moves != Moves::kFreely) chosen = kept;
    stay = problem.result(std::move(kept));
    if (most - stay.benefit <= double(options.negligible) * most) return stay;
  }
  const bool anew = chosen.empty();
  const double bonus = double(anew ? options.resident_bonus : options.resting_bonus);
  if (anew) problem.fill(chosen, bonus);
  if (request.exchange) problem.exchange(chosen, bonus);
  auto best = problem.result(std::move(chosen));
  const double lost = std::max(0.0, most - best.benefit);
  const double spared = best.benefit - stay.benefit;
  const bool hardly = request.moves == Moves::kHardlyAny;
  const double share = double(hardly ? options.rested_improvement : options.least_improvement);
  const double enough = std::max(share * lost, double(options.negligible) * most);
  return !stay.tiles.empty() && spared <= enough ? stay : best;
}

}  // namespace darm::tile_scheduler

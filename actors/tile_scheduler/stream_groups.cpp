#include "actors/tile_scheduler/stream_groups.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "actors/tile_scheduler/stream_state.hpp"

namespace darm::tile_scheduler {
namespace {

constexpr std::size_t kFew = 64;

bool within(std::size_t size, std::size_t slots, std::size_t largest, const GroupLimit& limit) {
  return static_cast<double>(size) <=
         std::max(limit.slots * static_cast<double>(slots), limit.own * static_cast<double>(largest));
}

// Sets with their tiles as dense numbers, and per tile the sets that want it.
class Clusters {
 public:
  Clusters(std::span<const std::span<const TileId>> sets, std::size_t slots, const GroupLimit& limit)
      : slots_(slots), limit_(limit), tiles_(sets.size()), left_(sets.size(), true), missing_(sets.size()) {
    TileIndex index;
    for (std::size_t s = 0; s < sets.size(); ++s)
      for (const auto tile : sets[s]) tiles_[s].push_back(index.insert(tile));
    first_.assign(index.size() + 1, 0);
    for (const auto& tiles : tiles_)
      for (const auto tile : tiles) ++first_[tile + 1];
    std::partial_sum(first_.begin(), first_.end(), first_.begin());
    wanting_.resize(first_.back());
    auto next = first_;
    for (std::size_t s = 0; s < tiles_.size(); ++s)
      for (const auto tile : tiles_[s]) wanting_[next[tile]++] = s;
    order_.resize(sets.size());
    std::iota(order_.begin(), order_.end(), std::size_t{0});
    std::ranges::stable_sort(order_, [&](std::size_t a, std::size_t b) { return tiles_[a].size() > tiles_[b].size(); });
  }

  std::vector<std::vector<std::size_t>> make() {
    std::vector<std::vector<std::size_t>> out;
    for (const auto seed : order_)
      if (left_[seed]) out.push_back(grow(seed));
    return out;
  }

 private:
  std::vector<std::size_t> grow(std::size_t seed) {
    std::vector<bool> taken(first_.size() - 1, false);
    for (std::size_t s = 0; s < tiles_.size(); ++s) missing_[s] = tiles_[s].size();
    std::vector<std::size_t> cluster;
    std::size_t size = 0;
    auto next = seed;
    while (next != kNone && (cluster.empty() || within(size + missing_[next], slots_, tiles_[seed].size(), limit_))) {
      cluster.push_back(next);
      left_[next] = false;
      for (const auto tile : tiles_[next]) {
        if (taken[tile]) continue;
        taken[tile] = true;
        ++size;
        for (auto w = first_[tile]; w < first_[tile + 1]; ++w) --missing_[wanting_[w]];
      }
      next = nearest();
    }
    return cluster;
  }

  [[nodiscard]] std::size_t nearest() const {
    std::size_t best = kNone;
    for (const auto s : order_)
      if (left_[s] && (best == kNone || missing_[s] < missing_[best])) best = s;
    return best;
  }

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::size_t slots_;
  GroupLimit limit_;
  std::vector<std::vector<std::uint32_t>> tiles_;  // by set
  std::vector<bool> left_;
  std::vector<std::size_t> missing_;  // tiles of each set that the cluster lacks
  std::vector<std::size_t> first_;    // by tile: where its wanting_ begin
  std::vector<std::size_t> wanting_;
  std::vector<std::size_t> order_;  // by falling size
};

// About one in eight, always the same ones.
std::vector<TileId> some_of(std::span<const TileId> tiles) {
  std::vector<TileId> out;
  for (const auto tile : tiles)
    if (tiles.size() <= kFew || TileHash()(tile) % 8 == 0) out.push_back(tile);
  std::ranges::sort(out);
  return out;
}

}  // namespace

std::vector<std::vector<std::size_t>> cluster_sets(std::span<const std::span<const TileId>> sets, std::size_t slots,
                                                   const GroupLimit& limit) {
  return Clusters(sets, slots, limit).make();
}

StreamGroups::StreamGroups(GroupOptions options, std::function<StreamId()> new_stream)
    : options_(options), new_stream_(std::move(new_stream)) {}

std::optional<StreamId> StreamGroups::stream_of(SessionId session) const {
  const auto it = members_.find(session);
  return it == members_.end() ? std::nullopt : std::optional(it->second.stream);
}

std::vector<SessionId> StreamGroups::members(StreamId stream) const {
  const auto it = groups_.find(stream);
  return it == groups_.end() ? std::vector<SessionId>() : it->second.members;
}

std::size_t StreamGroups::union_of(StreamId stream) const {
  const auto it = groups_.find(stream);
  return it == groups_.end() ? 0 : it->second.tally.distinct();
}

std::size_t StreamGroups::largest(const Group& group) const {
  std::size_t most = 0;
  for (const auto id : group.members)
    if (const auto& member = members_.at(id); member.counts) most = std::max(most, member.tiles.size());
  return most;
}

// The stream that lacks fewest of `tiles` and has room for them.
std::optional<StreamId> StreamGroups::room_for(const StreamFormat& format, std::span<const TileId> tiles,
                                               std::size_t largest_of_them, StreamId but) const {
  if (!options_.share) return std::nullopt;
  std::optional<StreamId> best;
  std::size_t fewest = 0;
  for (const auto& [id, group] : groups_) {
    if (id == but || !(group.format == format)) continue;
    const auto missing = group.tally.missing(tiles);
    const auto most = std::max(largest_of_them, largest(group));
    if (!within(group.tally.distinct() + missing, slot_count(format), most, options_.join)) continue;
    if (best && missing >= fewest) continue;
    best = id;
    fewest = missing;
  }
  return best;
}

StreamId StreamGroups::put(SessionId session, const StreamFormat& format, std::vector<TileId> tiles) {
  changed_ = true;
  if (const auto it = members_.find(session); it != members_.end()) {
    auto& member = it->second;
    auto& group = groups_.at(member.stream);
    if (member.counts) group.tally.remove(member.tiles);
    note_jump(member, group, tiles);
    if (member.counts) group.tally.add(tiles);
    member.tiles = std::move(tiles);
    member.changes_to.reset();
    if (!(group.format == format)) {
      member.changes_to = format;
      formats_change_ = true;
    }
    return member.stream;
  }
  const auto found = room_for(format, tiles, tiles.size(), StreamId{});
  auto& member = members_[session];
  member.some = some_of(tiles);
  member.tiles = std::move(tiles);
  enter(session, member, found ? *found : new_stream_(), format);
  return member.stream;
}

// From one set to the next. Of few each has a good part of the stream, and soon one of its own.
void StreamGroups::note_jump(Member& member, const Group& group, std::span<const TileId> tiles) const {
  auto now = some_of(tiles);
  std::size_t left = 0;
  for (const auto tile : member.some) left += std::ranges::binary_search(now, tile) ? 1 : 0;
  const bool jumped = static_cast<double>(left) < options_.jumped * static_cast<double>(member.some.size());
  member.some = std::move(now);
  if (!jumped || group.members.size() < options_.crowd) return;
  member.counts = false;
  member.jumped_at.reset();
}

void StreamGroups::count_who_stays(Microseconds now) {
  for (auto& [session, member] : members_) {
    if (member.counts) continue;
    if (!member.jumped_at) member.jumped_at = now;
    if (now - *member.jumped_at < options_.stay_after) continue;
    member.counts = true;
    groups_.at(member.stream).tally.add(member.tiles);
    changed_ = true;
  }
}

void StreamGroups::remove(SessionId session) {
  const auto it = members_.find(session);
  if (it == members_.end()) return;
  leave(session, it->second);
  members_.erase(it);
  changed_ = true;
}

void StreamGroups::enter(SessionId session, Member& member, StreamId stream, const StreamFormat& format) {
  auto& group = groups_[stream];
  group.format = format;
  if (group.members.empty()) member.counts = true;
  group.members.insert(std::ranges::lower_bound(group.members, session), session);
  if (member.counts) group.tally.add(member.tiles);
  member.stream = stream;
}

void StreamGroups::leave(SessionId session, const Member& member) {
  const auto it = groups_.find(member.stream);
  std::erase(it->second.members, session);
  if (member.counts) it->second.tally.remove(member.tiles);
  if (it->second.members.empty()) groups_.erase(it);
}

void StreamGroups::move(SessionId session, StreamId to, const StreamFormat& format, bool split,
                        std::vector<GroupMove>& moves) {
  auto& member = members_.at(session);
  leave(session, member);
  enter(session, member, to, format);
  moves.push_back({session, to, split});
  changed_ = true;
}

void StreamGroups::change_formats(std::vector<GroupMove>& moves) {
  for (auto& [session, member] : members_) {
    if (!member.changes_to) continue;
    const auto format = *std::exchange(member.changes_to, std::nullopt);
    const auto found = room_for(format, member.tiles, member.tiles.size(), member.stream);
    move(session, found ? *found : new_stream_(), format, true, moves);
  }
}

std::vector<GroupMove> StreamGroups::regroup(Microseconds now) {
  std::vector<GroupMove> moves;
  if (std::exchange(formats_change_, false)) change_formats(moves);
  if (!options_.share) return moves;
  count_who_stays(now);
  std::vector<StreamId> due;
  for (auto& [id, group] : groups_) {
    const bool fits = within(group.tally.distinct(), slot_count(group.format), largest(group), options_.stay);
    if (fits) {
      group.over_since.reset();
      continue;
    }
    if (!group.over_since) group.over_since = now;
    if (now - *group.over_since >= options_.split_after) due.push_back(id);
  }
  for (const auto id : due) split(id, moves);
  if (!planned_at_ || now - *planned_at_ >= options_.plan_every) {
    if (changed_) plan_joins(now);
    planned_at_ = now;
    join(now, moves);
  }
  return moves;
}

// Whoever sees much the same stays together. The most stay where they are, without a key frame; the others go where
// there is room, or begin a stream.
void StreamGroups::split(StreamId stream, std::vector<GroupMove>& moves) {
  auto& group = groups_.at(stream);
  group.over_since.reset();
  const auto format = group.format;
  auto everybody = group.members;
  std::erase_if(everybody, [&](SessionId id) { return !members_.at(id).counts; });  // these stay, whatever they see
  std::vector<std::span<const TileId>> sets;
  for (const auto id : everybody) sets.emplace_back(members_.at(id).tiles);
  const auto clusters = cluster_sets(sets, slot_count(format), options_.part);
  const auto stays =
      std::ranges::max_element(clusters, {}, [](const auto& cluster) { return cluster.size(); }) - clusters.begin();
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    if (static_cast<std::ptrdiff_t>(c) == stays) continue;
    TileTally together;
    for (const auto i : clusters[c]) together.add(sets[i]);
    const auto tiles = together.tiles();
    const auto found = room_for(format, tiles, sets[clusters[c].front()].size(), stream);
    const auto to = found ? *found : new_stream_();
    for (const auto i : clusters[c]) move(everybody[i], to, format, true, moves);
  }
}

void StreamGroups::plan_joins(Microseconds now) {
  changed_ = false;
  std::vector<StreamId> left;
  for (const auto& [id, group] : groups_) left.push_back(id);
  while (!left.empty()) {
    const auto format = groups_.at(left.front()).format;
    std::vector<StreamId> alike;
    std::erase_if(left, [&](StreamId id) {
      if (!(groups_.at(id).format == format)) return false;
      alike.push_back(id);
      return true;
    });
    plan_joins(alike, now);
  }
}

// Streams that would fit together are named by the first of them, whichever is the largest just now.
void StreamGroups::plan_joins(std::span<const StreamId> alike, Microseconds now) {
  std::vector<std::vector<TileId>> unions;
  for (const auto id : alike) unions.push_back(groups_.at(id).tally.tiles());
  const std::vector<std::span<const TileId>> sets(unions.begin(), unions.end());
  // A union is no set of one view: the allowance for those that are larger than a PhysTex is left to join().
  for (const auto& cluster : cluster_sets(sets, slot_count(groups_.at(alike.front()).format), options_.join)) {
    const auto name = cluster.size() > 1 ? alike[*std::ranges::min_element(cluster)] : StreamId{};
    for (const auto i : cluster) {
      auto& group = groups_.at(alike[i]);
      if (group.joins != name) group.joins_since = now;
      group.joins = name;
    }
  }
}

void StreamGroups::join(Microseconds now, std::vector<GroupMove>& moves) {
  std::map<StreamId, std::vector<StreamId>> ready;  // by name
  for (const auto& [id, group] : groups_)
    if (group.joins != StreamId{} && now - group.joins_since >= options_.join_after) ready[group.joins].push_back(id);
  for (const auto& [name, streams] : ready) {
    const auto to = *std::ranges::max_element(
        streams, {}, [&](StreamId id) { return groups_.at(id).members.size(); });  // the first of the largest
    for (const auto id : streams) {
      if (id == to) continue;
      const auto& group = groups_.at(id);
      const auto& target = groups_.at(to);
      const auto size = target.tally.distinct() + target.tally.missing(group.tally.tiles());
      const auto most = std::max(largest(group), largest(target));
      if (!within(size, slot_count(group.format), most, options_.join)) continue;
      const auto everybody = group.members;
      const auto format = group.format;
      for (const auto session : everybody) move(session, to, format, false, moves);
    }
  }
}

}  // namespace darm::tile_scheduler

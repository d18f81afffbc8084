// Which sessions share a stream: those whose working sets fit one PhysTex together. Pure.
#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "actors/tile_scheduler/tile_scheduler_messages.hpp"
#include "actors/tile_scheduler/tile_tally.hpp"

namespace darm::tile_scheduler {

/// How large a union may be: `slots` is a share of the PhysTex, `own` of the largest set in it. A set that alone is
/// larger than the PhysTex is drawn coarser as it is; others that see nearly the same make it no worse.
struct GroupLimit {
  double slots = 1;
  double own = 1;
};

struct GroupOptions {
  bool share = true;                     ///< false: every session has a stream of its own
  GroupLimit join{0.85, 1.05};           ///< to join, the union must fit with room,
  GroupLimit part{0.95, 1.12};           ///< what is split has some room again,
  GroupLimit stay{1.0, 1.2};             ///< and what is together stays so up to this
  Microseconds join_after = 4'000'000;   ///< streams join when they would have fitted for so long
  Microseconds split_after = 1'000'000;  ///< and split when they have not fitted for so long
  Microseconds plan_every = 250'000;     ///< how often joins are looked for
  /// One of so many or more whose set has less than this share of the one before in it has jumped: the union counts it
  /// again when it has stayed for `stay_after`, and meanwhile it is served by what the stream has. Who jumps every
  /// second widens nothing, and so neither splits the others nor keeps anybody from joining them.
  std::size_t crowd = 8;
  double jumped = 0.5;
  Microseconds stay_after = 2'000'000;
};

/// A session goes to another stream.
struct GroupMove {
  SessionId session{};
  StreamId to{};
  bool split = false;  ///< it did not fit where it was; else two streams join
  bool operator==(const GroupMove&) const = default;
};

/// Greedy clusters of sets, as numbers into `sets`: the largest set that is left begins one, and whichever adds fewest
/// tiles follows while the union is within the limit. Every set is in one cluster; one alone always fits. Sets are of
/// distinct tiles. O(tiles in all sets + clusters * sets + sets^2).
[[nodiscard]] std::vector<std::vector<std::size_t>> cluster_sets(std::span<const std::span<const TileId>> sets,
                                                                 std::size_t slots, const GroupLimit& limit);

/// Keeps the assignment. Formats are compared as they come (see StreamFormat::shared_format). Deterministic; `now` must
/// not decrease.
class StreamGroups {
 public:
  /// `new_stream` names streams, never twice the same.
  StreamGroups(GroupOptions options, std::function<StreamId()> new_stream);

  /// The working set of `session` is now `tiles` (distinct). One that is new joins at once the stream that lacks fewest
  /// of its tiles, where the union fits with room, else it begins one. One whose format is another than before goes to
  /// a stream of that with the next regroup().
  StreamId put(SessionId session, const StreamFormat& format, std::vector<TileId> tiles);
  void remove(SessionId session);
  /// Who goes where, now; already done when this returns. Streams without members are gone.
  [[nodiscard]] std::vector<GroupMove> regroup(Microseconds now);

  [[nodiscard]] std::size_t streams() const { return groups_.size(); }
  /// Nothing if it has no stream yet.
  [[nodiscard]] std::optional<StreamId> stream_of(SessionId session) const;
  /// By session; none if there is no such stream.
  [[nodiscard]] std::vector<SessionId> members(StreamId stream) const;
  /// Tiles in the union of a stream.
  [[nodiscard]] std::size_t union_of(StreamId stream) const;

 private:
  struct Member {
    StreamId stream{};
    std::vector<TileId> tiles;
    std::vector<TileId> some;               // of them, sorted: what tells a jump from a step
    bool counts = true;                     // its tiles are in the tally
    std::optional<Microseconds> jumped_at;  // if they are not; nothing: since the last regroup()
    std::optional<StreamFormat> changes_to;
  };
  struct Group {
    StreamFormat format;
    std::vector<SessionId> members;  // sorted
    TileTally tally;
    std::optional<Microseconds> over_since;  // it has not fitted since then
    StreamId joins{};                        // first of the streams it would fit with; none: 0
    Microseconds joins_since = 0;
  };
  using Groups = std::map<StreamId, Group>;

  [[nodiscard]] std::size_t largest(const Group& group) const;
  [[nodiscard]] std::optional<StreamId> room_for(const StreamFormat& format, std::span<const TileId> tiles,
                                                 std::size_t largest_of_them, StreamId but) const;
  void note_jump(Member& member, const Group& group, std::span<const TileId> tiles) const;
  void count_who_stays(Microseconds now);
  void enter(SessionId session, Member& member, StreamId stream, const StreamFormat& format);
  void leave(SessionId session, const Member& member);
  void move(SessionId session, StreamId to, const StreamFormat& format, bool split, std::vector<GroupMove>& moves);
  void split(StreamId stream, std::vector<GroupMove>& moves);
  void change_formats(std::vector<GroupMove>& moves);
  void plan_joins(Microseconds now);
  void plan_joins(std::span<const StreamId> alike, Microseconds now);
  void join(Microseconds now, std::vector<GroupMove>& moves);

  GroupOptions options_;
  std::function<StreamId()> new_stream_;
  std::map<SessionId, Member> members_;
  Groups groups_;
  bool changed_ = false;  // a set or an assignment, since joins were looked for
  bool formats_change_ = false;
  std::optional<Microseconds> planned_at_;
};

}  // namespace darm::tile_scheduler

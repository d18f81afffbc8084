// Whether all clients of a stream have the same page table after the same frame. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <map>
#include <utility>

namespace darm::client::load {

/// One client cannot know that a key frame held the whole table; two that came to the same frame by different ways can.
class TableWitness {
 public:
  /// Frames remembered; older ones are not compared any more.
  static constexpr std::size_t kMostFrames = 4096;

  /// False: another client has another table after this frame of the stream. The first one's stands.
  [[nodiscard]] bool agrees(std::uint64_t stream, std::uint64_t frame, std::uint64_t table) {
    const auto [place, fresh] = tables_.try_emplace({stream, frame}, table);
    if (!fresh) return place->second == table;
    order_.push_back(place->first);
    if (order_.size() > kMostFrames) {
      tables_.erase(order_.front());
      order_.pop_front();
    }
    return true;
  }

 private:
  std::map<std::pair<std::uint64_t, std::uint64_t>, std::uint64_t> tables_;
  std::deque<std::pair<std::uint64_t, std::uint64_t>> order_;
};

}  // namespace darm::client::load

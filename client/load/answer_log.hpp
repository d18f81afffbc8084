// Cameras on their way, and how long each waited for its answer. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

namespace darm::client::load {

/// What a message says by the camera it answers.
enum class AnswerNews : std::uint8_t {
  kNone,       ///< answers no camera
  kAnswer,     ///< the first that answers this camera
  kAgain,      ///< was answered before
  kBackwards,  ///< an older camera than one that was answered before
  kUnsent,     ///< no such camera was sent
};

class AnswerLog {
 public:
  /// More that wait than this are given up, oldest first; at ten a second that is seven minutes.
  static constexpr std::size_t kMostWaiting = 4096;

  /// `sequence` rises.
  void sent(std::uint64_t sequence, std::int64_t at_us);
  /// A message that answers `sequence` (0: none) has come. What waited for it, older cameras included, is added to
  /// `waits_ms`: the message includes them.
  AnswerNews answered(std::uint64_t sequence, std::int64_t at_us, std::vector<float>& waits_ms);
  /// Adds how long those have waited that were sent from `from_us` on and wait for `least_us` or longer: the least that
  /// their answers will have taken.
  void still_waiting(std::int64_t from_us, std::int64_t at_us, std::int64_t least_us,
                     std::vector<float>& waits_ms) const;
  [[nodiscard]] std::size_t waiting() const { return waiting_.size(); }
  [[nodiscard]] std::uint64_t newest_sent() const { return newest_sent_; }

 private:
  struct Sent {
    std::uint64_t sequence = 0;
    std::int64_t at_us = 0;
  };
  std::deque<Sent> waiting_;
  std::uint64_t newest_sent_ = 0;
  std::uint64_t newest_answered_ = 0;
};

}  // namespace darm::client::load

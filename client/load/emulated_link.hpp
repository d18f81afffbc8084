// A slow, far or lossy line, emulated between socket and client: for machines without tc netem. Pure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <deque>
#include <optional>
#include <vector>

namespace darm::client::load {

struct LinkShape {
  double delay_ms = 0;          ///< one way
  double bytes_per_second = 0;  ///< 0: as fast as it comes
  double loss = 0;              ///< share of packets, 0..1
  [[nodiscard]] bool any() const { return delay_ms > 0 || bytes_per_second > 0 || loss > 0; }
};

/// One direction of a byte stream. Order is kept: a lost packet holds up what comes behind it by a round trip, as TCP
/// does. What congestion control makes of loss is not emulated.
class EmulatedLink {
 public:
  static constexpr std::size_t kPacketBytes = 1448;

  EmulatedLink(const LinkShape& shape, std::uint64_t seed) : shape_(shape), seed_(seed) {}

  void push(std::vector<std::uint8_t> bytes, std::int64_t now_us);
  /// What has arrived by `now_us`, piece by piece; nothing: no more for now.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> pop(std::int64_t now_us);
  /// Bytes the line takes before it is full: what is on its way is bounded, so that the rest waits with the sender.
  [[nodiscard]] std::size_t room() const;

 private:
  struct Piece {
    std::vector<std::uint8_t> bytes;
    std::int64_t due_us = 0;
  };
  [[nodiscard]] bool loses_one(std::size_t bytes);

  LinkShape shape_;
  std::uint64_t seed_;
  std::uint64_t packets_ = 0;
  std::deque<Piece> pieces_;
  std::size_t held_ = 0;
  double free_us_ = 0;  // when the line has sent what it was given
  std::int64_t last_due_us_ = 0;
};

}  // namespace darm::client::load

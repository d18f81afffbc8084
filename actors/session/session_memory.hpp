// What all sessions hold together, against what they may.
#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>

namespace darm::session {

/// What a private layer of `size` pixels square holds: its encoder's pictures and references, the picture it is
/// composed in, the tiles it was made of. An estimate: a hundred clients with layers of 1024 made the process 3.4 GB
/// larger (docs/load.md), other things of theirs included.
[[nodiscard]] constexpr std::size_t private_layer_bytes(std::uint32_t size) {
  constexpr std::size_t kBytesPerPixel = 24;
  return kBytesPerPixel * size * size;
}

/// Thread-safe. Counts what sessions say of themselves: messages that wait to be sent, their own or shared, and private
/// layers.
class SessionMemory {
 public:
  explicit SessionMemory(std::size_t most = std::numeric_limits<std::size_t>::max()) : most_(most) {}
  SessionMemory(const SessionMemory&) = delete;
  SessionMemory& operator=(const SessionMemory&) = delete;

  [[nodiscard]] std::size_t held() const { return held_.load(); }
  /// There is room for so much more.
  [[nodiscard]] bool has_room(std::size_t bytes) const {
    const auto now = held();
    return now <= most_ && bytes <= most_ - now;
  }

  /// Private layers, which a client can do without, leave a quarter to what waits to be sent: or the last of them would
  /// turn away whoever comes next.
  [[nodiscard]] bool has_room_for_layer(std::size_t bytes) const {
    const std::size_t most = most_ - most_ / 4;
    const auto now = held();
    return now <= most && bytes <= most - now;
  }

  /// What one session holds; nothing any more when it is destroyed.
  class Share {
   public:
    explicit Share(std::shared_ptr<SessionMemory> of) : of_(std::move(of)) {}
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;
    ~Share() { set(0); }
    void set(std::size_t bytes) {
      if (of_ == nullptr || bytes == mine_) return;
      of_->held_ += bytes - mine_;  // modulo 2^64: a smaller share is taken off
      mine_ = bytes;
    }
    [[nodiscard]] bool has_room(std::size_t bytes) const { return of_ == nullptr || of_->has_room(bytes); }
    [[nodiscard]] bool has_room_for_layer(std::size_t bytes) const {
      return of_ == nullptr || of_->has_room_for_layer(bytes);
    }

   private:
    std::shared_ptr<SessionMemory> of_;
    std::size_t mine_ = 0;
  };

 private:
  std::size_t most_;
  std::atomic<std::size_t> held_{0};
};

}  // namespace darm::session

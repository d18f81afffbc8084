// Which session a datagram belongs to, and whether it is genuine. Forged ones never reach a mailbox.
#pragma once

#include <expected>
#include <map>
#include <memory>
#include <mutex>
#include <span>
#include <utility>

#include "actors/types/ids.hpp"
#include "proto/datagram.hpp"

namespace darm::session {

/// Thread-safe.
class DatagramDirectory {
 public:
  void add(SessionId session, const proto::SipKey& key);
  void remove(SessionId session);
  [[nodiscard]] std::size_t size() const;

  struct Opened {
    SessionId session;
    std::shared_ptr<const wire::DatagramBody> body;
  };
  /// Unknown sessions count as forged: a stranger does not learn which sessions there are.
  [[nodiscard]] std::expected<Opened, proto::DatagramFault> open(std::span<const std::uint8_t> bytes);

 private:
  mutable std::mutex mutex_;
  std::map<SessionId, proto::DatagramGate> gates_;
};

}  // namespace darm::session

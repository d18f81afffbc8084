#include "actors/session/datagram_directory.hpp"

#include "proto/darm.pb.h"
#include "proto/limits.hpp"

namespace darm::session {

void DatagramDirectory::add(SessionId session, const proto::SipKey& key) {
  const std::lock_guard lock(mutex_);
  gates_.insert_or_assign(session, proto::DatagramGate(key, static_cast<std::uint64_t>(session)));
}

void DatagramDirectory::remove(SessionId session) {
  const std::lock_guard lock(mutex_);
  gates_.erase(session);
}

std::size_t DatagramDirectory::size() const {
  const std::lock_guard lock(mutex_);
  return gates_.size();
}

std::expected<DatagramDirectory::Opened, proto::DatagramFault> DatagramDirectory::open(
    std::span<const std::uint8_t> bytes) {
  if (bytes.size() > proto::kMaxDatagram) return std::unexpected(proto::DatagramFault::kTooLong);
  const auto claimed = proto::claimed_session(bytes);
  if (!claimed) return std::unexpected(proto::DatagramFault::kGarbage);
  const std::lock_guard lock(mutex_);
  const auto gate = gates_.find(SessionId{*claimed});
  if (gate == gates_.end()) return std::unexpected(proto::DatagramFault::kForged);
  auto body = std::make_shared<wire::DatagramBody>();
  if (auto ok = gate->second.open(bytes, *body); !ok) return std::unexpected(ok.error());
  return Opened{gate->first, std::move(body)};
}

}  // namespace darm::session

// links: darm_session
// Datagrams from anybody: without the key nothing is let in; with it, only what is well formed.
#include <cstdlib>
#include <cstring>

#include "actors/session/datagram_directory.hpp"
#include "proto/darm.pb.h"

using namespace darm;

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  session::DatagramDirectory directory;
  const proto::SipKey key{1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16};
  directory.add(SessionId{1}, key);
  // As it is: the tag cannot be right.
  if (directory.open({data, size})) std::abort();
  // As the payload of a genuine datagram: taken only if it is a body.
  wire::Datagram datagram;
  datagram.set_session(1);
  datagram.set_sequence(1);
  datagram.set_payload(data, std::min<std::size_t>(size, 1000));
  const auto tag = proto::datagram_tag(key, 1, 1, datagram.payload());
  datagram.set_tag(tag.data(), tag.size());
  const auto bytes = datagram.SerializeAsString();
  const std::span<const std::uint8_t> view(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  const auto opened = directory.open(view);
  if (opened && opened->body->body_case() == wire::DatagramBody::BODY_NOT_SET) std::abort();
  if (directory.open(view)) std::abort();  // a replay
  return 0;
}

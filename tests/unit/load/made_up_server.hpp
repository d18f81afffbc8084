// What a server sends, made by hand: frames without a codec behind them, over the scene of the client's tests.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "proto/darm.pb.h"
#include "proto/framing.hpp"
#include "proto/limits.hpp"
#include "tests/unit/client/synthetic.hpp"

namespace darm::client::load::made_up {

inline constexpr std::uint32_t kPhysTex = 1024;  // 32 x 32 slots

inline std::string unit(char header) { return std::string("\0\0\0\1", 4) + header + "\x11\x22"; }
/// Parameters, supplemental information and an IDR slice, as x264 begins a key frame.
inline std::string key_picture() { return unit(0x67) + unit(0x68) + unit(0x06) + unit(0x65); }
inline std::string delta_picture() { return unit(0x41); }

using Edits = std::vector<std::pair<std::uint32_t, std::uint32_t>>;  // tile, slot

inline wire::StreamFrame frame(std::uint64_t number, bool key, const Edits& edits = {}) {
  wire::StreamFrame f;
  f.set_frame(number);
  f.set_key(key);
  f.set_h264(key ? key_picture() : delta_picture());
  f.set_error(0.01f);
  for (const auto& [tile, slot] : edits) {
    auto& edit = *f.add_page_edits();
    edit.set_tile(tile);
    edit.set_slot(slot);
  }
  return f;
}

inline wire::Welcome welcome(std::uint32_t udp_port = 0) {
  wire::Welcome w;
  w.set_version(proto::kProtocolVersion);
  w.set_session(7);
  w.set_key(std::string(proto::kSessionKeyBytes, 'k'));
  w.set_udp_port(udp_port);
  w.set_phystex_size(kPhysTex);
  w.set_updates_per_second(10);
  return w;
}

inline wire::CoarseTexture coarse() {
  wire::CoarseTexture c;
  c.set_version(1);
  c.set_width(synthetic::kTilesPerAxis.back() * 30);
  c.set_height(synthetic::kTilesPerAxis.back() * 30);
  c.set_h264(key_picture());
  return c;
}

template <class Message>
std::vector<std::uint8_t> bytes(Message message, Message* (wire::Envelope::*slot)()) {
  wire::Envelope envelope;
  *(envelope.*slot)() = std::move(message);
  return proto::frame(envelope);
}

}  // namespace darm::client::load::made_up

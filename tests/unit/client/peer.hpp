// One accepted connection of a server that follows a script, for tests of what connects to it.
#pragma once

#include <sys/socket.h>
#include <unistd.h>

#include <cstdint>
#include <span>
#include <vector>

#include "proto/darm.pb.h"
#include "proto/framing.hpp"

namespace darm::client {

class Peer {
 public:
  explicit Peer(int fd) : fd_(fd) {}
  ~Peer() { ::close(fd_); }
  Peer(const Peer&) = delete;
  Peer& operator=(const Peer&) = delete;

  /// False: the client is gone.
  bool send(const wire::Envelope& e) { return send_bytes(proto::frame(e)); }
  bool send_bytes(const std::vector<std::uint8_t>& bytes) {
    return ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(bytes.size());
  }

  /// The next message; an empty one once the client is gone.
  wire::Envelope read() {
    wire::Envelope e;
    std::uint8_t buffer[4096];
    for (;;) {
      const auto got = frames_.next(e);
      if (!got || *got) return e;
      const auto n = ::recv(fd_, buffer, sizeof(buffer), 0);
      if (n <= 0) return {};
      frames_.feed(std::span(buffer, static_cast<std::size_t>(n)));
    }
  }

  /// The next camera; an empty one once the client is gone.
  wire::CameraUpdate camera() {
    for (;;) {
      const auto e = read();
      if (e.body_case() == wire::Envelope::BODY_NOT_SET || e.has_camera()) return e.camera();
    }
  }

  void hold_until_gone() {
    while (read().body_case() != wire::Envelope::BODY_NOT_SET) {
    }
  }

 private:
  int fd_;
  proto::FrameReader frames_{1 << 20};
};

}  // namespace darm::client

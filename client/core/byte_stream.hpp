// A connected TCP socket, bare or under TLS. The only place of the client that sees OpenSSL.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <stop_token>
#include <string>
#include <utility>

#include "client/core/result.hpp"

namespace darm::client {

enum class Tls : std::uint8_t {
  kNone,
  kVerified,    ///< the server's certificate must be for this host and vouched for
  kUnverified,  ///< encrypted, but nobody says with whom
};

struct ByteStreamOptions {
  std::string host;
  std::uint16_t port = 0;
  Tls tls = Tls::kNone;
  /// PEM; vouches beside the system's authorities. Empty: none.
  std::filesystem::path authority;
  std::chrono::milliseconds timeout{5000};  ///< for each address, and for TLS's handshake
  std::stop_token stop;                     ///< ends the wait
};

/// One thread may receive while another sends. Under TLS the process must ignore SIGPIPE: OpenSSL writes with write().
class ByteStream {
 public:
  [[nodiscard]] static Result<std::unique_ptr<ByteStream>> open(const ByteStreamOptions& options);
  ~ByteStream();
  ByteStream(const ByteStream&) = delete;
  ByteStream& operator=(const ByteStream&) = delete;

  /// Bytes that are there, at most buffer.size(); 0: none yet. Error: the stream has ended.
  [[nodiscard]] Result<std::size_t> receive(std::span<std::uint8_t> buffer);
  /// True if receive() has something though the socket may not.
  [[nodiscard]] bool holds_bytes() const;
  /// All of `bytes`. A full socket is waited for, `timeout` each time: half a message must not stay behind.
  [[nodiscard]] Result<void> send(std::span<const std::uint8_t> bytes, std::chrono::milliseconds timeout);
  /// Nothing more will be sent.
  void finish();
  /// For poll() and getpeername() alone.
  [[nodiscard]] int socket() const;

 private:
  struct State;
  explicit ByteStream(std::unique_ptr<State> state);
  std::unique_ptr<State> state_;
};

/// An owned file descriptor. -1: none.
class Descriptor {
 public:
  explicit Descriptor(int fd = -1) : fd_(fd) {}
  Descriptor(Descriptor&& other) noexcept : fd_(other.fd_) { other.fd_ = -1; }
  Descriptor& operator=(Descriptor&& other) noexcept {
    std::swap(fd_, other.fd_);
    return *this;
  }
  ~Descriptor();
  [[nodiscard]] int get() const { return fd_; }

 private:
  int fd_;
};

}  // namespace darm::client

#include "client/core/byte_stream.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <netdb.h>
#include <netinet/tcp.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <climits>
#include <cstring>
#include <mutex>
#include <utility>

namespace darm::client {
namespace {

using std::chrono::milliseconds;

constexpr milliseconds kSlice{50};  // how late a stop may be noticed

struct AddressList {
  addrinfo* list = nullptr;
  ~AddressList() {
    if (list != nullptr) ::freeaddrinfo(list);
  }
};

struct Free {
  void operator()(SSL_CTX* p) const { SSL_CTX_free(p); }
  void operator()(SSL* p) const { SSL_free(p); }
};

std::string errno_text() { return std::strerror(errno); }

// True once the socket is ready; false after `timeout` or when asked to stop.
bool wait_for(int fd, short events, milliseconds timeout, const std::stop_token& stop) {
  for (auto left = timeout; left.count() > 0 && !stop.stop_requested(); left -= kSlice) {
    pollfd p{fd, events, 0};
    if (::poll(&p, 1, static_cast<int>(std::min(left, kSlice).count())) > 0) return true;
  }
  return false;
}

// Connects without blocking longer than `timeout` an address; leaves the socket non-blocking.
Result<Descriptor> connect_to(const ByteStreamOptions& o) {
  const std::string where = fmt::format("{}:{}", o.host, o.port);
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  AddressList found;
  if (const int code = ::getaddrinfo(o.host.c_str(), std::to_string(o.port).c_str(), &hints, &found.list); code != 0) {
    return fail(where + ": " + ::gai_strerror(code));
  }
  std::string reason = "no address";
  for (const addrinfo* a = found.list; a != nullptr && !o.stop.stop_requested(); a = a->ai_next) {
    Descriptor fd(::socket(a->ai_family, a->ai_socktype | SOCK_NONBLOCK | SOCK_CLOEXEC, a->ai_protocol));
    if (fd.get() < 0) continue;
    if (::connect(fd.get(), a->ai_addr, a->ai_addrlen) != 0 && errno != EINPROGRESS) {
      reason = errno_text();
      continue;
    }
    if (!wait_for(fd.get(), POLLOUT, o.timeout, o.stop)) {
      reason = "no answer in time";
      continue;
    }
    int code = 0;
    socklen_t size = sizeof(code);
    ::getsockopt(fd.get(), SOL_SOCKET, SO_ERROR, &code, &size);
    if (code != 0) {
      reason = std::strerror(code);
      continue;
    }
    const int on = 1;
    ::setsockopt(fd.get(), IPPROTO_TCP, TCP_NODELAY, &on, sizeof(on));
    return fd;
  }
  return fail(where + ": " + reason + "; is darmd serve running there?");
}

std::string tls_text() {
  const char* reason = ERR_reason_error_string(ERR_peek_last_error());
  ERR_clear_error();
  return reason != nullptr ? reason : "the other side went away";
}

Result<std::unique_ptr<SSL_CTX, Free>> make_context(const ByteStreamOptions& o) {
  std::unique_ptr<SSL_CTX, Free> context(SSL_CTX_new(TLS_client_method()));
  if (!context || SSL_CTX_set_min_proto_version(context.get(), TLS1_2_VERSION) != 1) return fail("TLS: " + tls_text());
  SSL_CTX_set_mode(context.get(), SSL_MODE_ENABLE_PARTIAL_WRITE | SSL_MODE_ACCEPT_MOVING_WRITE_BUFFER);
  if (o.tls == Tls::kUnverified) return context;
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_PEER, nullptr);
  SSL_CTX_set_default_verify_paths(context.get());
  if (!o.authority.empty() && SSL_CTX_load_verify_locations(context.get(), o.authority.c_str(), nullptr) != 1)
    return fail(o.authority.string() + ": no certificates in it (" + tls_text() + ")");
  return context;
}

// The name or address that the certificate must be for.
bool expect_host(SSL* ssl, const std::string& host) {
  in6_addr address{};
  const bool numeric =
      ::inet_pton(AF_INET, host.c_str(), &address) == 1 || ::inet_pton(AF_INET6, host.c_str(), &address) == 1;
  if (numeric) return X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(ssl), host.c_str()) == 1;
  return SSL_set_tlsext_host_name(ssl, host.c_str()) == 1 && SSL_set1_host(ssl, host.c_str()) == 1;
}

Result<std::unique_ptr<SSL, Free>> shake_hands(int fd, SSL_CTX& context, const ByteStreamOptions& o) {
  const std::string where = fmt::format("{}:{}: TLS: ", o.host, o.port);
  std::unique_ptr<SSL, Free> ssl(SSL_new(&context));
  if (!ssl || SSL_set_fd(ssl.get(), fd) != 1 || !expect_host(ssl.get(), o.host)) return fail(where + tls_text());
  for (;;) {
    ERR_clear_error();
    const int code = SSL_connect(ssl.get());
    if (code == 1) return ssl;
    const int wanted = SSL_get_error(ssl.get(), code);
    if (wanted != SSL_ERROR_WANT_READ && wanted != SSL_ERROR_WANT_WRITE) break;
    if (!wait_for(fd, wanted == SSL_ERROR_WANT_READ ? POLLIN : POLLOUT, o.timeout, o.stop))
      return fail(where + "no answer in time");
  }
  const long verified = SSL_get_verify_result(ssl.get());
  if (o.tls == Tls::kVerified && verified != X509_V_OK) {
    ERR_clear_error();
    return fail(where + "the certificate is refused (" + X509_verify_cert_error_string(verified) +
                    "); trust a self-signed one with --authority FILE, or take any with --insecure",
                Cause::kRefused);
  }
  return fail(where + tls_text());
}

}  // namespace

Descriptor::~Descriptor() {
  if (fd_ >= 0) ::close(fd_);
}

struct ByteStream::State {
  Descriptor fd;
  std::unique_ptr<SSL_CTX, Free> context;
  std::unique_ptr<SSL, Free> ssl;  // null: bare
  std::mutex mutex;                // of ssl, which takes one thread at a time
};

ByteStream::ByteStream(std::unique_ptr<State> state) : state_(std::move(state)) {}
ByteStream::~ByteStream() = default;

Result<std::unique_ptr<ByteStream>> ByteStream::open(const ByteStreamOptions& options) {
  auto fd = connect_to(options);
  if (!fd) return std::unexpected(fd.error());
  auto state = std::make_unique<State>();
  state->fd = std::move(*fd);
  if (options.tls != Tls::kNone) {
    auto context = make_context(options);
    if (!context) return std::unexpected(context.error());
    auto ssl = shake_hands(state->fd.get(), **context, options);
    if (!ssl) return std::unexpected(ssl.error());
    state->context = std::move(*context);
    state->ssl = std::move(*ssl);
  }
  return std::unique_ptr<ByteStream>(new ByteStream(std::move(state)));
}

int ByteStream::socket() const { return state_->fd.get(); }

Result<std::size_t> ByteStream::receive(std::span<std::uint8_t> buffer) {
  State& s = *state_;
  if (!s.ssl) {
    const auto n = ::recv(s.fd.get(), buffer.data(), buffer.size(), 0);
    if (n > 0) return static_cast<std::size_t>(n);
    if (n == 0) return fail("server: closed the connection");
    if (errno == EAGAIN || errno == EWOULDBLOCK || errno == EINTR) return std::size_t{0};
    return fail("server: connection lost: " + errno_text());
  }
  const std::lock_guard lock(s.mutex);
  ERR_clear_error();
  const int n = SSL_read(s.ssl.get(), buffer.data(), static_cast<int>(std::min<std::size_t>(buffer.size(), INT_MAX)));
  if (n > 0) return static_cast<std::size_t>(n);
  const int wanted = SSL_get_error(s.ssl.get(), n);
  if (wanted == SSL_ERROR_WANT_READ || wanted == SSL_ERROR_WANT_WRITE) return std::size_t{0};
  if (wanted == SSL_ERROR_ZERO_RETURN) return fail("server: closed the connection");
  return fail("server: connection lost: " + tls_text());
}

bool ByteStream::holds_bytes() const {
  if (!state_->ssl) return false;
  const std::lock_guard lock(state_->mutex);
  return SSL_pending(state_->ssl.get()) > 0;
}

Result<void> ByteStream::send(std::span<const std::uint8_t> bytes, milliseconds timeout) {
  State& s = *state_;
  while (!bytes.empty()) {
    short wait = POLLOUT;
    if (!s.ssl) {
      const auto n = ::send(s.fd.get(), bytes.data(), bytes.size(), MSG_NOSIGNAL);
      if (n > 0) bytes = bytes.subspan(static_cast<std::size_t>(n));
      if (n > 0 || (n < 0 && errno == EINTR)) continue;
      if (n == 0 || (errno != EAGAIN && errno != EWOULDBLOCK)) return fail("server: connection lost: " + errno_text());
    } else {
      const std::lock_guard lock(s.mutex);
      ERR_clear_error();
      const int n =
          SSL_write(s.ssl.get(), bytes.data(), static_cast<int>(std::min<std::size_t>(bytes.size(), INT_MAX)));
      if (n > 0) {
        bytes = bytes.subspan(static_cast<std::size_t>(n));
        continue;
      }
      const int wanted = SSL_get_error(s.ssl.get(), n);
      if (wanted != SSL_ERROR_WANT_READ && wanted != SSL_ERROR_WANT_WRITE)
        return fail("server: connection lost: " + tls_text());
      if (wanted == SSL_ERROR_WANT_READ) wait = POLLIN;
    }
    if (!wait_for(s.fd.get(), wait, timeout, {})) return fail("server: takes no more data");
  }
  return {};
}

void ByteStream::finish() {
  if (state_->ssl) {
    const std::lock_guard lock(state_->mutex);
    SSL_shutdown(state_->ssl.get());
    ERR_clear_error();
  }
  ::shutdown(state_->fd.get(), SHUT_WR);
}

}  // namespace darm::client

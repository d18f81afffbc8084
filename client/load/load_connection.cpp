#include "client/load/load_connection.hpp"

#include <algorithm>
#include <array>
#include <boost/asio/buffer.hpp>
#include <boost/asio/socket_base.hpp>
#include <boost/asio/write.hpp>
#include <chrono>

namespace darm::client::load {
namespace {

namespace asio = boost::asio;
using asio::ip::tcp;
using asio::ip::udp;
using boost::system::error_code;

constexpr std::size_t kReadBytes = 256 * 1024;
constexpr int kReadsATurn = 4;  // then others have theirs
constexpr std::size_t kMostUnsent = 256 * 1024;
constexpr int kSlowReceiveBuffer = 32 * 1024;  // else the kernel would read megabytes for a client that reads slowly
constexpr std::size_t kMostDatagrams = 1024;

// All clients read in turn, on one thread.
std::array<std::uint8_t, kReadBytes>& shared_buffer() {
  thread_local std::array<std::uint8_t, kReadBytes> buffer;
  return buffer;
}

}  // namespace

std::int64_t clock_us() {
  return std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

LoadConnection::LoadConnection(asio::io_context& io, tcp::endpoint server, std::unique_ptr<ClientMachine> machine,
                               const LinkShape& link)
    : tcp_(io), udp_(io), server_(std::move(server)), machine_(std::move(machine)), link_(link) {
  if (!link_.any()) return;
  down_.emplace(link_, machine_->plan().seed);
  LinkShape up = link_;
  up.bytes_per_second = 0;  // what a client sends is little
  up_.emplace(up, machine_->plan().seed + 1);
}

void LoadConnection::start() {
  error_code ec;
  tcp_.open(server_.protocol(), ec);
  if (ec) return end_by("connect_failed");
  if (link_.bytes_per_second > 0) tcp_.set_option(asio::socket_base::receive_buffer_size(kSlowReceiveBuffer), ec);
  tcp_.async_connect(server_, [self = shared_from_this()](error_code failed) {
    if (self->gone()) return;
    if (failed) return self->end_by("connect_failed");
    error_code ignored;
    self->tcp_.set_option(tcp::no_delay(true), ignored);
    self->tcp_.non_blocking(true, ignored);
    self->connected_ = true;
    const auto now = clock_us();
    self->send({false, self->machine_->hello(now)}, now);
    self->await_bytes();
  });
}

void LoadConnection::await_bytes() {
  if (waiting_ || silent_ || stalled() || gone() || !connected_ || (down_ && down_->room() == 0)) return;
  waiting_ = true;
  tcp_.async_wait(tcp::socket::wait_read, [self = shared_from_this()](error_code ec) {
    self->waiting_ = false;
    if (self->gone() || self->silent_ || self->stalled()) return;
    if (ec) return self->end_by("connection_broken");
    self->read_bytes();
  });
}

void LoadConnection::read_bytes() {
  auto& buffer = shared_buffer();
  for (int turn = 0; turn < kReadsATurn && !gone(); ++turn) {
    const std::size_t most = down_ ? std::min(down_->room(), std::size_t{16} * 1024) : buffer.size();
    if (most == 0) break;
    error_code ec;
    const std::size_t n = tcp_.read_some(asio::buffer(buffer.data(), most), ec);
    if (ec == asio::error::would_block || ec == asio::error::try_again) break;
    const auto now = clock_us();
    if (ec) {
      // A goodbye that is still on an emulated line says why.
      while (down_ && !gone()) {
        const auto piece = down_->pop(INT64_MAX);
        if (!piece) break;
        deliver(*piece, now);
      }
      if (!gone()) end_by(ec == asio::error::eof ? "closed_by_server" : "connection_broken");
      return;
    }
    if (down_) {
      down_->push({buffer.begin(), buffer.begin() + static_cast<std::ptrdiff_t>(n)}, now);
    } else {
      deliver({buffer.data(), n}, now);
    }
    if (n < most) break;
  }
  await_bytes();
}

void LoadConnection::deliver(std::span<const std::uint8_t> bytes, std::int64_t now_us) {
  machine_->receive(bytes, now_us);
  if (machine_->phase() == ClientMachine::Phase::kEnded) end_by(machine_->end());
}

void LoadConnection::deliver_due(std::int64_t now_us) {
  while (down_ && !gone()) {
    const auto piece = down_->pop(now_us);
    if (!piece) break;
    deliver(*piece, now_us);
  }
  while (up_ && !gone()) {
    auto piece = up_->pop(now_us);
    if (!piece) break;
    unsent_bytes_ += piece->size();
    unsent_.push_back(std::move(*piece));
  }
  while (!datagrams_.empty() && datagrams_.front().first <= now_us) {
    send_datagram(datagrams_.front().second);
    datagrams_.pop_front();
  }
}

void LoadConnection::tick(std::int64_t now_us) {
  if (gone() || silent_ || !connected_) return;
  if (now_us >= stalled_until_) stalled_until_ = 0;
  if (!stalled()) deliver_due(now_us);
  if (gone()) return;
  for (auto& message : machine_->due(now_us)) send(std::move(message), now_us);
  if (machine_->phase() == ClientMachine::Phase::kEnded) return end_by(machine_->end());
  write_next();
  await_bytes();
}

void LoadConnection::send(Outgoing message, std::int64_t now_us) {
  if (message.datagram) {
    const bool lost = link_.loss > 0 && chance(machine_->plan().seed + 2, datagrams_sent_) < link_.loss;
    ++datagrams_sent_;
    if (lost || datagrams_.size() >= kMostDatagrams) return;
    if (link_.delay_ms <= 0 && !stalled()) return send_datagram(message.bytes);
    datagrams_.emplace_back(now_us + static_cast<std::int64_t>(link_.delay_ms * 1000), std::move(message.bytes));
    return;
  }
  if (unsent_bytes_ + message.bytes.size() > kMostUnsent) return;  // the server does not read: the camera is lost
  if (up_) return up_->push(std::move(message.bytes), now_us);
  unsent_bytes_ += message.bytes.size();
  unsent_.push_back(std::move(message.bytes));
  write_next();
}

// A lost datagram is replaced by the next one, so a failure to send is no error.
void LoadConnection::send_datagram(const std::vector<std::uint8_t>& bytes) {
  error_code ignored;
  if (!udp_.is_open()) {
    const udp::endpoint to(server_.address(), static_cast<std::uint16_t>(machine_->udp_port()));
    udp_.open(to.protocol(), ignored);
    udp_.connect(to, ignored);
    udp_.non_blocking(true, ignored);
  }
  udp_.send(asio::buffer(bytes), 0, ignored);
}

void LoadConnection::write_next() {
  if (writing_ || stalled() || gone() || unsent_.empty()) return;
  writing_ = true;
  asio::async_write(tcp_, asio::buffer(unsent_.front()), [self = shared_from_this()](error_code ec, std::size_t) {
    self->writing_ = false;
    if (self->gone()) return;
    if (ec) {
      // What the server said last may still be there to be read.
      self->unsent_.clear();
      self->unsent_bytes_ = 0;
      return self->await_bytes();
    }
    self->unsent_bytes_ -= self->unsent_.front().size();
    self->unsent_.pop_front();
    self->write_next();
  });
}

void LoadConnection::leave() {
  if (gone() || silent_) return;
  by_plan_ = true;
  error_code ignored;
  const auto bytes = ClientMachine::goodbye();
  // Between two messages, or not at all: half a message and a goodbye would be read as nonsense.
  if (connected_ && !writing_) tcp_.send(asio::buffer(bytes), 0, ignored);
  end_by("left");
}

void LoadConnection::vanish(bool reset) {
  if (gone()) return;
  by_plan_ = true;
  if (!reset) {
    silent_ = true;
    return;
  }
  error_code ignored;
  tcp_.set_option(asio::socket_base::linger(true, 0), ignored);
  end_by("vanished");
}

void LoadConnection::stall(std::int64_t until_us) {
  stalled_until_ = until_us;
  machine_->stalls(until_us);
}

void LoadConnection::drop() {
  if (!gone()) end_by(silent_ ? "vanished" : "left");
}

void LoadConnection::end_by(std::string reason) {
  if (gone()) return;
  end_ = std::move(reason);
  close();
}

void LoadConnection::close() {
  error_code ignored;
  tcp_.close(ignored);
  udp_.close(ignored);
}

}  // namespace darm::client::load

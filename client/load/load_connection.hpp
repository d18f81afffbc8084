// A client machine and its sockets: TCP for everything, UDP for cameras where the server offers it.
#pragma once

#include <boost/asio/io_context.hpp>
#include <boost/asio/ip/tcp.hpp>
#include <boost/asio/ip/udp.hpp>
#include <cstdint>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "client/load/client_machine.hpp"
#include "client/load/emulated_link.hpp"

namespace darm::client::load {

/// This process's clock, microseconds.
[[nodiscard]] std::int64_t clock_us();

/// One client on one thread with all others. Ends by itself where the server or the machine ends it.
class LoadConnection : public std::enable_shared_from_this<LoadConnection> {
 public:
  LoadConnection(boost::asio::io_context& io, boost::asio::ip::tcp::endpoint server,
                 std::unique_ptr<ClientMachine> machine, const LinkShape& link);

  void start();
  /// To be called every few milliseconds: sends what is due, delivers what an emulated line has held.
  void tick(std::int64_t now_us);
  /// With a goodbye, unless it has vanished.
  void leave();
  /// Without a word: the sockets stay, and nobody reads or writes them any more; or (`reset`) the connection is broken
  /// off.
  void vanish(bool reset);
  /// The line carries nothing until then; what is sent meanwhile goes out afterwards.
  void stall(std::int64_t until_us);
  /// Ends at once.
  void drop();

  [[nodiscard]] ClientMachine& machine() { return *machine_; }
  [[nodiscard]] const ClientMachine& machine() const { return *machine_; }
  [[nodiscard]] bool gone() const { return !end_.empty(); }
  /// Why it is gone: left, vanished, or what the machine or the network says. Empty while it goes on.
  [[nodiscard]] const std::string& end() const { return end_; }
  [[nodiscard]] bool by_plan() const { return by_plan_; }

 private:
  [[nodiscard]] bool stalled() const { return stalled_until_ > 0; }
  void await_bytes();
  void read_bytes();
  void deliver(std::span<const std::uint8_t> bytes, std::int64_t now_us);
  void deliver_due(std::int64_t now_us);
  void send(Outgoing message, std::int64_t now_us);
  void send_datagram(const std::vector<std::uint8_t>& bytes);
  void write_next();
  void end_by(std::string reason);
  void close();

  boost::asio::ip::tcp::socket tcp_;
  boost::asio::ip::udp::socket udp_;
  boost::asio::ip::tcp::endpoint server_;
  std::unique_ptr<ClientMachine> machine_;
  LinkShape link_;
  std::optional<EmulatedLink> down_, up_;
  std::deque<std::pair<std::int64_t, std::vector<std::uint8_t>>> datagrams_;  // on an emulated line, with their times
  std::uint64_t datagrams_sent_ = 0;
  std::deque<std::vector<std::uint8_t>> unsent_;
  std::size_t unsent_bytes_ = 0;
  std::int64_t stalled_until_ = 0;
  bool writing_ = false, waiting_ = false, connected_ = false, silent_ = false, by_plan_ = false;
  std::string end_;
};

}  // namespace darm::client::load

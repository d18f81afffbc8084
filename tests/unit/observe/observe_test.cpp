#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <chrono>
#include <memory>
#include <string>
#include <thread>
#include <vector>

#include "daemon/observe/log.hpp"
#include "daemon/observe/process_stats.hpp"
#include "daemon/observe/prometheus_sink.hpp"

namespace darm::observe {
namespace {

// A connection to a local port, waiting at most 6 s for what it reads; -1: none.
int connect_to(std::uint16_t port) {
  const int fd = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  const timeval patience{.tv_sec = 6, .tv_usec = 0};
  setsockopt(fd, SOL_SOCKET, SO_RCVTIMEO, &patience, sizeof patience);
  if (connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) return fd;
  close(fd);
  return -1;
}

// The answer to GET /metrics on a local port.
std::string fetch(std::uint16_t port) {
  const int fd = connect_to(port);
  std::string answer;
  if (fd >= 0) {
    const std::string request = "GET /metrics HTTP/1.0\r\nHost: localhost\r\nConnection: close\r\n\r\n";
    (void)!send(fd, request.data(), request.size(), MSG_NOSIGNAL);
    char buffer[4096];
    for (ssize_t n = 0; (n = recv(fd, buffer, sizeof buffer, 0)) > 0;)
      answer.append(buffer, static_cast<std::size_t>(n));
  }
  close(fd);
  return answer;
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(PrometheusSinkTest, CountersGaugesAndHistogramsAreShown) {
  PrometheusSink sink;
  sink.count("darm_frames_total", 2, {{"stream", "1"}});
  sink.count("darm_frames_total", 3, {{"stream", "1"}});
  sink.set("darm_sessions", 4, {});
  sink.observe("darm_encode_seconds", 0.004, {});
  const std::string text = sink.text();
  EXPECT_TRUE(has(text, "darm_frames_total{stream=\"1\"} 5")) << text;
  EXPECT_TRUE(has(text, "darm_sessions 4")) << text;
  EXPECT_TRUE(has(text, "darm_encode_seconds_bucket{le=\"0.005\"} 1")) << text;
  EXPECT_TRUE(has(text, "darm_encode_seconds_bucket{le=\"0.003\"} 0")) << text;
}

TEST(PrometheusSinkTest, NonsenseIsDroppedNotThrown) {
  PrometheusSink sink;
  sink.count("darm_a_total", 1, {});
  sink.set("darm_a_total", 7, {});     // another method
  sink.count("not a name!", 1, {});    // not a metric name
  sink.count("darm_a_total", -5, {});  // counters do not fall
  sink.observe("darm_b_seconds", 0.0 / 0.0, {});
  EXPECT_TRUE(has(sink.text(), "darm_a_total 1")) << sink.text();
  EXPECT_TRUE(has(sink.text(), "darm_b_seconds_count 0")) << sink.text();
}

TEST(PrometheusSinkTest, SeriesAreBounded) {
  PrometheusSink sink;
  for (int i = 0; i < 10'100; ++i) sink.count("darm_x_total", 1, {{"id", std::to_string(i)}});
  EXPECT_TRUE(has(sink.text(), "darm_metric_series_dropped_total 100"));
}

TEST(PrometheusSinkTest, ThreadsMayMeasureAtOnce) {
  PrometheusSink sink;
  std::vector<std::thread> threads;
  for (int t = 0; t < 4; ++t)
    threads.emplace_back([&sink] {
      for (int i = 0; i < 1000; ++i) sink.count("darm_y_total", 1, {{"k", std::to_string(i % 10)}});
    });
  for (auto& thread : threads) thread.join();
  EXPECT_TRUE(has(sink.text(), "darm_y_total{k=\"3\"} 400"));
}

TEST(PrometheusSinkTest, ServesOverHttpOnAnyFreePort) {
  PrometheusSink sink;
  Health health(sink, "1.2.3");
  health.set_ready(true);
  const auto exposed = sink.expose("127.0.0.1", 0);
  ASSERT_TRUE(exposed) << exposed.error().message;
  EXPECT_GT(sink.port(), 0);
  const std::string answer = fetch(sink.port());
  EXPECT_TRUE(has(answer, "200 OK")) << answer;
  EXPECT_TRUE(has(answer, "darm_ready 1")) << answer;
  EXPECT_TRUE(has(answer, "darm_build_info{version=\"1.2.3\"} 1")) << answer;
}

// The value of a series without labels; -1: there is none.
double value_of(const std::string& text, const std::string& name) {
  const auto at = text.find("\n" + name + " ");
  return at == std::string::npos ? -1 : std::stod(text.substr(at + name.size() + 2));
}

TEST(PrometheusSinkTest, TheStandardMetricsOfAProcessAreShown) {
  PrometheusSink sink;
  ASSERT_TRUE(sink.expose("127.0.0.1", 0));
  const std::string before = fetch(sink.port());
  EXPECT_TRUE(has(before, "# TYPE process_cpu_seconds_total counter")) << before;
  EXPECT_TRUE(has(before, "# TYPE process_resident_memory_bytes gauge")) << before;
  EXPECT_GT(value_of(before, "process_resident_memory_bytes"), 1 << 20);
  EXPECT_GT(value_of(before, "process_max_fds"), 2);
  std::vector<int> files;
  for (int i = 0; i < 20; ++i) files.push_back(dup(0));
  const auto end = std::chrono::steady_clock::now() + std::chrono::milliseconds(50);
  while (std::chrono::steady_clock::now() < end) continue;
  const std::string after = sink.text();
  for (const int file : files) close(file);
  EXPECT_GE(value_of(after, "process_open_fds"), value_of(sink.text(), "process_open_fds") + 18) << "but for a socket";
  EXPECT_GT(value_of(after, "process_cpu_seconds_total"), value_of(before, "process_cpu_seconds_total"));
}

TEST(ProcessStats, PagesInMemoryAreTheSecondNumber) {
  EXPECT_EQ(resident_pages("1000 250 30 4 0 99 0\n"), 250u);
  EXPECT_FALSE(resident_pages("").has_value());
  EXPECT_FALSE(resident_pages("1000").has_value());
  EXPECT_FALSE(resident_pages("1000 x").has_value());
}

TEST(PrometheusSinkTest, AnyAndLoopbackOfIpv6AreServedOneWayOrTheOther) {
  for (const char* address : {"::", "::1"}) {
    PrometheusSink sink;
    const auto exposed = sink.expose(address, 0);
    ASSERT_TRUE(exposed) << exposed.error().message;
    EXPECT_TRUE(has(sink.url(), std::to_string(sink.port()).append("/metrics"))) << sink.url();
    if (has(sink.url(), "[")) continue;  // a build with IPv6
    EXPECT_TRUE(has(fetch(sink.port()), "200 OK")) << sink.url();
  }
  const auto elsewhere = PrometheusSink().expose("2001:db8::1", 0);
  ASSERT_FALSE(elsewhere);
  EXPECT_TRUE(has(elsewhere.error().message, "[2001:db8::1]:0")) << elsewhere.error().message;
  EXPECT_TRUE(has(elsewhere.error().message, "built without IPv6")) << elsewhere.error().message;
  EXPECT_TRUE(has(elsewhere.error().message, "CivetServer")) << "the reason as it was given";
}

TEST(PrometheusSinkTest, AnAddressOfAnotherMachineIsNamedAndNotThePort) {
  const auto exposed = PrometheusSink().expose("203.0.113.7", 0);  // for documentation: nobody's
  ASSERT_FALSE(exposed);
  EXPECT_TRUE(has(exposed.error().message, "203.0.113.7")) << exposed.error().message;
  EXPECT_TRUE(has(exposed.error().message, "listen.address is no address of this machine")) << exposed.error().message;
  EXPECT_FALSE(has(exposed.error().message, "metrics_port")) << exposed.error().message;
}

TEST(PrometheusSinkTest, WhoConnectsAndSaysNothingKeepsNobodyOut) {
  auto sink = std::make_unique<PrometheusSink>();
  ASSERT_TRUE(sink->expose("127.0.0.1", 0));
  std::vector<int> idle;
  for (int i = 0; i < 12; ++i) idle.push_back(connect_to(sink->port()));
  EXPECT_TRUE(has(fetch(sink->port()), "200 OK"));
  const auto start = std::chrono::steady_clock::now();
  sink.reset();
  EXPECT_LT(std::chrono::steady_clock::now() - start, std::chrono::seconds(4));
  for (const int fd : idle) close(fd);
}

TEST(PrometheusSinkTest, TakenPortIsAnErrorThatNamesIt) {
  PrometheusSink first;
  ASSERT_TRUE(first.expose("127.0.0.1", 0));
  PrometheusSink second;
  const auto exposed = second.expose("127.0.0.1", first.port());
  ASSERT_FALSE(exposed);
  EXPECT_TRUE(has(exposed.error().message, "127.0.0.1:" + std::to_string(first.port()))) << exposed.error().message;
  EXPECT_FALSE(PrometheusSink().expose("no such address", 0));
}

TEST(LogTest, MessagesCannotBreakOutOfTheirJsonString) {
  EXPECT_EQ(json_escaped("a\"b\\c\nd"), "a\\\"b\\\\c\\u000ad");
  EXPECT_EQ(json_escaped("gr\xc3\xbc\xc3\x9f"), "gr\xc3\xbc\xc3\x9f");
  EXPECT_EQ(json_escaped("\xff\xc3"), "\\ufffd\\ufffd");
  EXPECT_EQ(json_escaped("\xed\xa0\x80"), "\\ufffd\\ufffd\\ufffd");
  set_up_log("debug", true);
  set_up_log("nonsense", false);
}

}  // namespace
}  // namespace darm::observe

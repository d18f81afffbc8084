#include "client/load/load_report.hpp"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "client/load/percentile.hpp"
#include "client/load/plot.hpp"
#include "tests/unit/accuracy_report/well_formed.hpp"

namespace darm::client::load {
namespace {

ClientRecord client(Role role, std::uint64_t answers, std::vector<float> waits) {
  ClientRecord record;
  record.role = role;
  auto& f = record.figures;
  f.begun_us = 1'000'000;
  f.welcomed_us = 1'100'000;
  f.first_frame_us = 2'000'000;
  f.from_us = 3'000'000;
  f.to_us = 13'000'000;  // ten seconds
  f.answers = f.stream_frames = answers;
  f.no_changes = 10;
  f.bytes = 1'000'000;
  f.waits_ms = std::move(waits);
  return record;
}

LoadReport report() {
  LoadReport r;
  std::vector<ClientRecord> records = {client(Role::kHealthy, 100, {10, 20, 30}), client(Role::kHealthy, 80, {40}),
                                       client(Role::kSlow, 10, {9'000})};
  records[2].figures.faults.add(Fault::kTile, 2);
  records[2].cut_off = true;
  r.all = summarise(records, std::nullopt);
  for (std::size_t i = 0; i < kRoles; ++i) r.by_role[i] = summarise(records, static_cast<Role>(i));
  r.disconnects["TOO_SLOW"] = 1;
  r.server_rss_bytes = StartMaxEnd{1, 3, 2};
  for (int t = 1; t <= 3; ++t) r.moments.push_back({double(t), {0, 10, 20, 30}, 10, 0, 0.5, 0.1});
  return r;
}

TEST(Percentile, IsTheSmallestThatSoManyDoNotExceed) {
  std::vector<float> values = {5, 1, 4, 2, 3};
  EXPECT_EQ(percentile(values, 0.5), 3);
  EXPECT_EQ(percentile(values, 0.01), 1);
  EXPECT_EQ(percentile(values, 0.99), 5);
  EXPECT_EQ(percentile(values, 0.2), 1);
  std::vector<float> none;
  EXPECT_EQ(percentile(none, 0.5), 0);
}

TEST(Summary, RatesAreOfEachClientsOwnTimeAndWaitsOfAllCameras) {
  const auto s = report().by_role[0];
  EXPECT_EQ(s.clients, 2u);
  EXPECT_EQ(s.connected, 2u);
  EXPECT_DOUBLE_EQ(s.updates_per_second.p1, 8);
  EXPECT_DOUBLE_EQ(s.stream_frames_per_second, 9);
  EXPECT_DOUBLE_EQ(s.no_changes_per_second, 1);
  EXPECT_DOUBLE_EQ(s.answer_ms.p50, 20);
  EXPECT_DOUBLE_EQ(s.answer_ms.p99, 40);
  EXPECT_DOUBLE_EQ(s.bytes_per_client_per_second, 100'000);
  EXPECT_DOUBLE_EQ(s.first_frame_seconds.p50, 1);
}

TEST(Summary, WhoJoinedLateIsCountedFromItsFirstFrame) {
  auto late = client(Role::kHealthy, 50, {});
  late.figures.first_frame_us = 8'000'000;
  EXPECT_DOUBLE_EQ(summarise({late}, std::nullopt).updates_per_second.p50, 10);
  late.figures.first_frame_us = 0;
  const auto never = summarise({late}, std::nullopt);
  EXPECT_EQ(never.connected, 1u);
  EXPECT_EQ(never.without_frame, 1u);
  EXPECT_DOUBLE_EQ(never.updates_per_second.p50, 0);
  late.figures.welcomed_us = 0;
  EXPECT_EQ(summarise({late}, std::nullopt).connected, 0u);
}

TEST(LoadReport, FiguresAreOfHealthyClientsAndCountsOfAll) {
  const auto j = nlohmann::json::parse(to_json(report()));
  for (const char* key : {"clients", "connected", "updates_per_second", "stream_frames_per_second",
                          "no_changes_per_second", "integrity_faults", "integrity_faults_by_kind", "answer_ms",
                          "server_cpu_seconds_per_second", "harness_cpu_seconds_per_second", "server_rss_bytes",
                          "bytes_per_client_per_second", "key_frames", "frames_dropped", "disconnects"})
    EXPECT_TRUE(j.contains(key)) << key;
  EXPECT_EQ(j["clients"], 3);
  EXPECT_EQ(j["connected"], 2);
  EXPECT_EQ(j["answer_ms"]["p99"], 40);
  EXPECT_EQ(j["slow"]["answer_ms"]["p99"], 9'000);
  EXPECT_EQ(j["integrity_faults"], 2);
  EXPECT_EQ(j["integrity_faults_by_kind"]["tile"], 2);
  EXPECT_EQ(j["integrity_faults_by_kind"].size(), kFaultKinds);
  EXPECT_EQ(j["disconnects"]["TOO_SLOW"], 1);
  EXPECT_EQ(j["server_rss_bytes"]["max"], 3);
  EXPECT_TRUE(j["server_cpu_seconds_per_second"].is_null());
}

TEST(LoadReport, TheTableNamesEachKindOfClientThatTookPart) {
  const auto text = to_text(report());
  EXPECT_NE(text.find("healthy"), std::string::npos);
  EXPECT_NE(text.find("slow"), std::string::npos);
  EXPECT_EQ(text.find("vanishing"), std::string::npos);
  EXPECT_NE(text.find("2 tile"), std::string::npos) << text;
  EXPECT_NE(text.find("1 TOO_SLOW"), std::string::npos) << text;
}

TEST(Plot, IsWellFormedInBothColourSchemesForAnyRun) {
  auto r = report();
  EXPECT_EQ(accuracy::testing::fault_of(plot(r)), "");
  EXPECT_NE(plot(r).find("prefers-color-scheme:dark"), std::string::npos);
  EXPECT_NE(plot(r).find("<path"), std::string::npos);
  r.moments[1].answer_ms.p99 = INFINITY;
  r.moments[1].server_cpu.reset();
  EXPECT_EQ(accuracy::testing::fault_of(plot(r)), "");
  EXPECT_EQ(plot(r).find("inf"), std::string::npos);
  r.moments.clear();
  EXPECT_EQ(accuracy::testing::fault_of(plot(r)), "");
  for (int t = 0; t < 2'000; ++t) r.moments.push_back({double(t), {0, 1, 2, 3}, 10, 0, {}, 0.1});
  EXPECT_EQ(accuracy::testing::fault_of(plot(r)), "");
  EXPECT_LT(plot(r).size(), 200'000u) << "long runs are thinned";
}

}  // namespace
}  // namespace darm::client::load

#include "client/load/load_report.hpp"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

namespace darm::client::load {
namespace {

using Json = nlohmann::ordered_json;

Json faults_of(const FaultCounts& faults) {
  Json j = Json::object();
  for (std::size_t i = 0; i < kFaultKinds; ++i)
    j[std::string(to_string(static_cast<Fault>(i)))] = faults.of(static_cast<Fault>(i));
  return j;
}

Json to_json(const std::optional<StartMaxEnd>& value) {
  if (!value) return nullptr;
  return {{"start", value->start}, {"max", value->max}, {"end", value->end}};
}

void put_summary(const Summary& s, Json& j) {
  j["updates_per_second"] = {{"p1", s.updates_per_second.p1}, {"p50", s.updates_per_second.p50}};
  j["stream_frames_per_second"] = s.stream_frames_per_second;
  j["no_changes_per_second"] = s.no_changes_per_second;
  j["answer_ms"] = {{"p50", s.answer_ms.p50}, {"p95", s.answer_ms.p95}, {"p99", s.answer_ms.p99}};
  j["bytes_per_client_per_second"] = s.bytes_per_client_per_second;
  j["cameras"] = s.cameras;
  j["key_frames"] = s.key_frames;
  j["frames_dropped"] = s.frames_dropped;
  j["first_frame_seconds"] = {{"p50", s.first_frame_seconds.p50}, {"p99", s.first_frame_seconds.p99}};
}

Json of_role(const Summary& s) {
  Json j{{"clients", s.clients}, {"connected", s.connected}, {"without_frame", s.without_frame}};
  put_summary(s, j);
  j["integrity_faults"] = s.faults.total();
  return j;
}

Json timeline(const std::vector<Moment>& moments) {
  Json j = Json::array();
  for (const auto& m : moments) {
    j.push_back({{"t", m.t},
                 {"answer_ms", {{"p50", m.answer_ms.p50}, {"p95", m.answer_ms.p95}, {"p99", m.answer_ms.p99}}},
                 {"stream_frames", m.stream_frames},
                 {"no_changes", m.no_changes},
                 {"server_cpu", m.server_cpu ? Json(*m.server_cpu) : Json(nullptr)},
                 {"harness_cpu", m.harness_cpu}});
  }
  return j;
}

std::string row(std::string_view name, const Summary& s) {
  return fmt::format(
      "{:<12} {:>7} {:>9} {:>7.2f} {:>7.2f} {:>8.2f} {:>9.2f} {:>7.0f} {:>7.0f} {:>7.0f} {:>9.1f} {:>7} {:>6}\n", name,
      s.clients, s.connected, s.updates_per_second.p1, s.updates_per_second.p50, s.stream_frames_per_second,
      s.no_changes_per_second, s.answer_ms.p50, s.answer_ms.p95, s.answer_ms.p99, s.bytes_per_client_per_second / 1000,
      s.frames_dropped, s.faults.total());
}

}  // namespace

std::string to_json(const LoadReport& r) {
  const Summary& healthy = r.by_role[static_cast<std::size_t>(Role::kHealthy)];
  Json j{{"clients", r.all.clients}, {"connected", r.all.connected}};
  put_summary(healthy, j);
  j["integrity_faults"] = r.all.faults.total();
  j["integrity_faults_by_kind"] = faults_of(r.all.faults);
  j["server_cpu_seconds_per_second"] =
      r.server_cpu_seconds_per_second ? Json(*r.server_cpu_seconds_per_second) : Json(nullptr);
  j["harness_cpu_seconds_per_second"] = r.harness_cpu_seconds_per_second;
  j["server_rss_bytes"] = to_json(r.server_rss_bytes);
  j["server_descriptors"] = to_json(r.server_descriptors);
  j["disconnects"] = Json::object();
  for (const auto& [reason, count] : r.disconnects) j["disconnects"][reason] = count;
  j["joins"] = r.joins;
  j["without_frame"] = r.all.without_frame;
  j["seconds"] = r.seconds;
  j["seconds_to_ready"] = r.seconds_to_ready;
  j["all_ready"] = r.all_ready;
  for (std::size_t i = 0; i < kRoles; ++i) j[std::string(to_string(static_cast<Role>(i)))] = of_role(r.by_role[i]);
  const Summary& stalling = r.by_role[static_cast<std::size_t>(Role::kStalling)];
  j["stall"] = {{"caught_up", stalling.caught_up},
                {"caught_up_ms", {{"p50", stalling.caught_up_ms.p50}, {"p99", stalling.caught_up_ms.p99}}},
                {"fresh_picture_ms", {{"p50", stalling.fresh_picture_ms.p50}, {"p99", stalling.fresh_picture_ms.p99}}},
                {"drawn", r.drawn_while_stalled}};
  j["pictures"] = {{"decoded", r.pictures.decoded},
                   {"skipped", r.pictures.skipped},
                   {"refused", r.pictures.refused},
                   {"drawn", r.pictures.drawn}};
  j["timeline"] = timeline(r.moments);
  return j.dump(2, ' ', false, Json::error_handler_t::replace);
}

std::string to_text(const LoadReport& r) {
  std::string text = fmt::format("{:.1f} s counted, after {:.1f} s of connecting{}\n", r.seconds, r.seconds_to_ready,
                                 r.all_ready ? "" : " (not all clients had a frame by then)");
  text +=
      fmt::format("{:<12} {:>7} {:>9} {:>15} {:>8} {:>9} {:>23} {:>9} {:>7} {:>6}\n", "", "", "", "updates/s p1 p50",
                  "frames/s", "no change", "answer ms p50 p95 p99", "kB/s", "dropped", "faults");
  for (std::size_t i = 0; i < kRoles; ++i)
    if (r.by_role[i].clients > 0) text += row(to_string(static_cast<Role>(i)), r.by_role[i]);
  if (r.server_cpu_seconds_per_second) text += fmt::format("server {:.2f} CPU s/s, ", *r.server_cpu_seconds_per_second);
  text += fmt::format("harness {:.2f} CPU s/s\n", r.harness_cpu_seconds_per_second);
  if (r.server_rss_bytes)
    text += fmt::format("server memory {:.0f} MB at the start, {:.0f} at most, {:.0f} at the end\n",
                        static_cast<double>(r.server_rss_bytes->start) / 1e6,
                        static_cast<double>(r.server_rss_bytes->max) / 1e6,
                        static_cast<double>(r.server_rss_bytes->end) / 1e6);
  if (const auto& s = r.by_role[static_cast<std::size_t>(Role::kStalling)]; s.clients > 0)
    text += fmt::format(
        "after the stall {} of {} answered anew after {:.0f} ms, with a frame after {:.0f} ms (p50); {} "
        "pictures drawn meanwhile\n",
        s.caught_up, s.clients, s.caught_up_ms.p50, s.fresh_picture_ms.p50, r.drawn_while_stalled);
  if (r.pictures.decoded > 0)
    text += fmt::format("{} pictures decoded, {} skipped, {} refused, {} drawn\n", r.pictures.decoded,
                        r.pictures.skipped, r.pictures.refused, r.pictures.drawn);
  for (std::size_t i = 0; i < kFaultKinds; ++i)
    if (const auto n = r.all.faults.of(static_cast<Fault>(i)); n > 0)
      text += fmt::format("integrity: {} {}\n", n, to_string(static_cast<Fault>(i)));
  for (const auto& [reason, count] : r.disconnects) text += fmt::format("disconnected: {} {}\n", count, reason);
  return text;
}

}  // namespace darm::client::load

#include <algorithm>

#include "client/load/load_report.hpp"
#include "client/load/percentile.hpp"

namespace darm::client::load {
namespace {

// A client that was counted for less says nothing of its rate.
constexpr double kLeastSeconds = 2.0;

double counted_seconds(const ClientFigures& f) {
  if (f.from_us == 0 || f.first_frame_us == 0) return 0;
  return static_cast<double>(f.to_us - std::max(f.from_us, f.first_frame_us)) / 1e6;
}

}  // namespace

Percentiles percentiles(std::vector<float> values) {
  return {percentile(values, 0.01), percentile(values, 0.5), percentile(values, 0.95), percentile(values, 0.99)};
}

Summary summarise(const std::vector<ClientRecord>& records, std::optional<Role> role) {
  Summary s;
  std::vector<float> rates, waits, joins, caught_up, fresh;
  double seconds = 0;
  std::uint64_t frames = 0, no_changes = 0, bytes = 0;
  for (const auto& record : records) {
    if (role && record.role != *role) continue;
    const auto& f = record.figures;
    ++s.clients;
    const bool connected = f.welcomed_us > 0 && !record.cut_off;
    s.connected += connected ? 1 : 0;
    s.without_frame += connected && f.first_frame_us == 0 ? 1 : 0;
    s.faults += f.faults;
    if (f.first_frame_us > 0) joins.push_back(static_cast<float>(f.first_frame_us - f.begun_us) / 1e6f);
    if (f.caught_up_us > 0) caught_up.push_back(static_cast<float>(f.caught_up_us - f.stalled_until_us) / 1e3f);
    if (f.fresh_picture_us > 0) fresh.push_back(static_cast<float>(f.fresh_picture_us - f.stalled_until_us) / 1e3f);
    s.cameras += f.cameras;
    s.key_frames += f.key_frames;
    s.frames_dropped += f.frames_dropped;
    s.view_frames += f.view_frames;
    waits.insert(waits.end(), f.waits_ms.begin(), f.waits_ms.end());
    const double counted = counted_seconds(f);
    if (counted <= 0) continue;
    seconds += counted;
    frames += f.stream_frames;
    no_changes += f.no_changes;
    bytes += f.bytes;
    if (counted >= kLeastSeconds) rates.push_back(static_cast<float>(static_cast<double>(f.answers) / counted));
  }
  s.updates_per_second = percentiles(std::move(rates));
  s.answer_ms = percentiles(std::move(waits));
  s.first_frame_seconds = percentiles(std::move(joins));
  s.caught_up = static_cast<std::uint32_t>(caught_up.size());
  s.caught_up_ms = percentiles(std::move(caught_up));
  s.fresh_picture_ms = percentiles(std::move(fresh));
  if (seconds > 0) {
    s.stream_frames_per_second = static_cast<double>(frames) / seconds;
    s.no_changes_per_second = static_cast<double>(no_changes) / seconds;
    s.bytes_per_client_per_second = static_cast<double>(bytes) / seconds;
  }
  return s;
}

}  // namespace darm::client::load

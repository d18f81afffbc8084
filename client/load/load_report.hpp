// What a run has shown: figures of all clients put together. Pure.
#pragma once

#include <array>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "client/load/client_figures.hpp"
#include "client/load/crowd.hpp"

namespace darm::client::load {

/// One client at the end of its life, or of the run.
struct ClientRecord {
  Role role = Role::kHealthy;
  ClientFigures figures;
  bool cut_off = false;  ///< it ended before its time: by the server, the network or a broken stream
};

struct Percentiles {
  double p1 = 0, p50 = 0, p95 = 0, p99 = 0;
};

/// Of the clients of one role, or of all. Rates are of the counted time: from its first frame on, for each client.
struct Summary {
  std::uint32_t clients = 0;
  std::uint32_t connected = 0;      ///< were welcomed and not cut off
  std::uint32_t without_frame = 0;  ///< of these, never had a frame
  Percentiles updates_per_second;   ///< over clients: messages that were the first to answer a camera
  double stream_frames_per_second = 0, no_changes_per_second = 0;  ///< of one client, mean
  Percentiles answer_ms;                                           ///< over all cameras
  std::uint64_t cameras = 0;
  double bytes_per_client_per_second = 0;
  std::uint64_t key_frames = 0, frames_dropped = 0, view_frames = 0;
  Percentiles first_frame_seconds;  ///< from connecting, whole life
  /// Of those whose line stood and went on: from then to the first answer to a camera sent since, and the first frame.
  Percentiles caught_up_ms, fresh_picture_ms;
  std::uint32_t caught_up = 0;
  FaultCounts faults;  ///< whole life
};

struct StartMaxEnd {
  std::uint64_t start = 0, max = 0, end = 0;
};

struct PictureCounts {
  std::uint64_t decoded = 0;  ///< frames that were decoded and applied
  std::uint64_t skipped = 0;  ///< frames that waited for a key frame, or for which the decoder had no time
  std::uint64_t refused = 0;  ///< frames that did not decode, or contradicted the manifest
  std::uint64_t drawn = 0;
};

/// One second of the counted time, of the healthy clients.
struct Moment {
  double t = 0;
  Percentiles answer_ms;
  double stream_frames = 0, no_changes = 0;  ///< per client
  std::optional<double> server_cpu;          ///< seconds a second
  double harness_cpu = 0;
};

struct LoadReport {
  Summary all;
  std::array<Summary, kRoles> by_role;
  double seconds = 0;           ///< that were counted
  double seconds_to_ready = 0;  ///< from the first connection until counting began
  bool all_ready = false;       ///< every client had a first frame by then
  double harness_cpu_seconds_per_second = 0;
  std::optional<double> server_cpu_seconds_per_second;
  std::optional<StartMaxEnd> server_rss_bytes, server_descriptors;
  PictureCounts pictures;
  std::map<std::string, std::uint64_t> disconnects;  ///< by reason, those by plan included
  std::uint64_t joins = 0;                           ///< after the start
  std::uint64_t drawn_while_stalled = 0;             ///< pictures, by all that draw
  std::vector<Moment> moments;
};

/// Of the records with `role`, or of all.
[[nodiscard]] Summary summarise(const std::vector<ClientRecord>& records, std::optional<Role> role);
[[nodiscard]] Percentiles percentiles(std::vector<float> values);

/// Keys are a contract: docs/load.md.
[[nodiscard]] std::string to_json(const LoadReport& report);
/// A table for people.
[[nodiscard]] std::string to_text(const LoadReport& report);

}  // namespace darm::client::load

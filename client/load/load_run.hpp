// A load test from the first connection to the last: who joins, leaves and vanishes when, and what is counted.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "client/core/result.hpp"
#include "client/load/client_machine.hpp"
#include "client/load/crowd.hpp"
#include "client/load/emulated_link.hpp"
#include "client/load/load_report.hpp"
#include "client/load/route.hpp"

namespace darm::client::load {

struct LoadPlan {
  std::string host;
  std::uint16_t port = 0;
  CrowdShape crowd;
  std::vector<CameraKey> walkthrough, places;  ///< either may be empty
  MachineSettings machine;
  LinkShape link;                   ///< of every client
  std::uint32_t draw_height = 360;  ///< of pictures that are drawn
  double slow_bytes_per_second = 10'000;
  double stall_seconds = 5;         ///< from the middle of the counted time on
  double seconds = 60;              ///< counted
  double warm_up = 60;              ///< counting begins after so long, though not all clients are ready
  double settle = 0;                ///< seconds the server is watched after all have left
  double connects_per_second = 20;  ///< at the start
  int server_pid = 0;               ///< 0: its processor time and memory are not known
};

/// Runs it on this thread. SIGINT and SIGTERM end the counted time early. Error: the server's name, the crowd or the
/// drawing; never what clients meet.
[[nodiscard]] Result<LoadReport> run_load(LoadPlan plan);

}  // namespace darm::client::load

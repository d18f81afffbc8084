// links: darm_client_load darm_proto
// What a hostile server can make of a client of the load test: any bytes, in pieces, are checked and counted.
#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <cstdlib>
#include <span>

#include "client/load/client_machine.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace darm::client::load;
  if (size > 1 << 20) return 0;
  static const Route route({}, {}, 1);
  Commons commons;
  ClientMachine machine(ClientPlan{}, MachineSettings{}, route, commons, nullptr, 1);
  machine.begin_counting(1);
  std::int64_t now = 1;
  for (std::size_t at = 0; at < size; now += 60'000) {
    const std::size_t piece = std::min<std::size_t>(size - at, 1 + at % 4096);
    machine.receive(std::span(data + at, piece), now);
    (void)machine.due(now);
    at += piece;
  }
  machine.end_counting(now);
  if (machine.figures().answers > machine.figures().cameras) std::abort();
  return 0;
}

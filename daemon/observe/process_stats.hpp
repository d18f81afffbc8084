// What this process uses, as Prometheus' client libraries tell it of theirs.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

namespace darm::observe {

struct ProcessStats {
  double cpu_seconds = 0;  ///< user and system, all threads
  std::uint64_t resident_bytes = 0;
  std::uint64_t open_descriptors = 0;
  std::uint64_t most_descriptors = 0;  ///< the limit
};

/// Of now. What the system does not tell is 0.
[[nodiscard]] ProcessStats process_stats();

/// Pages in memory, from the text of /proc/PID/statm (proc(5)).
[[nodiscard]] std::optional<std::uint64_t> resident_pages(std::string_view statm);

}  // namespace darm::observe

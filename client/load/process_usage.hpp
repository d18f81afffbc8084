// What a process has used, from /proc.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>

namespace darm::client::load {

struct ProcessUsage {
  double cpu_seconds = 0;  ///< user and system, all threads
  std::uint64_t rss_bytes = 0;
  std::uint64_t descriptors = 0;
};

/// From the text of /proc/PID/stat (proc(5)); `ticks` a second, `page` bytes. Nothing if it is no such text.
[[nodiscard]] std::optional<ProcessUsage> parse_stat(std::string_view text, double ticks, std::uint64_t page);
/// Nothing if there is no such process, or it is not ours to see. Descriptors are 0 where they may not be counted.
[[nodiscard]] std::optional<ProcessUsage> usage_of(int pid);
/// Of this process.
[[nodiscard]] double own_cpu_seconds();

/// One sentence if `allowed` descriptors are too few for `clients` (a TCP and a UDP socket each), else empty.
[[nodiscard]] std::string descriptor_warning(std::uint64_t allowed, std::uint32_t clients);
/// Raises the soft limit to the hard one; gives what is allowed then.
[[nodiscard]] std::uint64_t raise_descriptor_limit();

}  // namespace darm::client::load

#include "daemon/observe/process_stats.hpp"

#include <sys/resource.h>
#include <unistd.h>

#include <charconv>
#include <filesystem>
#include <fstream>
#include <string>
#include <system_error>

namespace darm::observe {
namespace {

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6; }

// The one that this reads the folder by is left out.
std::uint64_t count_descriptors() {
  std::uint64_t count = 0;
  std::error_code error;
  for (std::filesystem::directory_iterator at("/proc/self/fd", error), end; !error && at != end; at.increment(error))
    ++count;
  return count > 0 ? count - 1 : 0;
}

}  // namespace

std::optional<std::uint64_t> resident_pages(std::string_view statm) {
  const auto space = statm.find(' ');
  if (space == std::string_view::npos) return std::nullopt;
  std::uint64_t pages = 0;
  const auto [end, error] = std::from_chars(statm.data() + space + 1, statm.data() + statm.size(), pages);
  return error == std::errc() ? std::optional(pages) : std::nullopt;
}

ProcessStats process_stats() {
  ProcessStats stats;
  rusage usage{};
  if (::getrusage(RUSAGE_SELF, &usage) == 0) stats.cpu_seconds = seconds(usage.ru_utime) + seconds(usage.ru_stime);
  std::string line;
  std::ifstream in("/proc/self/statm");
  if (std::getline(in, line))
    stats.resident_bytes = resident_pages(line).value_or(0) * static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE));
  in.close();  // or it would be counted
  stats.open_descriptors = count_descriptors();
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) == 0) stats.most_descriptors = limit.rlim_cur;
  return stats;
}

}  // namespace darm::observe

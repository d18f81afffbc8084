#include "client/load/process_usage.hpp"

#include <fmt/format.h>
#include <sys/resource.h>
#include <unistd.h>

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <system_error>

namespace darm::client::load {
namespace {

constexpr std::uint64_t kOtherDescriptors = 64;  // libraries, decoders, the GL

double seconds(const timeval& t) { return static_cast<double>(t.tv_sec) + static_cast<double>(t.tv_usec) * 1e-6; }

}  // namespace

std::optional<ProcessUsage> parse_stat(std::string_view text, double ticks, std::uint64_t page) {
  // The second field is the name in brackets, which may hold anything; the third is the state.
  const auto name_end = text.rfind(')');
  if (name_end == std::string_view::npos || !(ticks > 0)) return std::nullopt;
  text.remove_prefix(name_end + 1);
  double cpu = 0;
  for (int field = 3; field <= 24; ++field) {
    const auto begin = text.find_first_not_of(" \n");
    if (begin == std::string_view::npos) return std::nullopt;
    text.remove_prefix(begin);
    const auto length = std::min(text.find_first_of(" \n"), text.size());
    const auto word = text.substr(0, length);
    text.remove_prefix(length);
    if (field != 14 && field != 15 && field != 24) continue;
    std::uint64_t value = 0;
    const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), value);
    if (error != std::errc() || end != word.data() + word.size()) return std::nullopt;
    if (field == 24) return ProcessUsage{cpu, value * page, 0};
    cpu += static_cast<double>(value) / ticks;
  }
  return std::nullopt;
}

std::optional<ProcessUsage> usage_of(int pid) {
  const std::filesystem::path folder = "/proc/" + std::to_string(pid);
  std::ifstream in(folder / "stat");
  const std::string text(std::istreambuf_iterator<char>(in), {});
  auto usage = parse_stat(text, static_cast<double>(::sysconf(_SC_CLK_TCK)),
                          static_cast<std::uint64_t>(::sysconf(_SC_PAGESIZE)));
  if (!usage) return std::nullopt;
  std::error_code error;
  for (std::filesystem::directory_iterator at(folder / "fd", error), end; !error && at != end; at.increment(error))
    ++usage->descriptors;
  return usage;
}

double own_cpu_seconds() {
  rusage usage{};
  ::getrusage(RUSAGE_SELF, &usage);
  return seconds(usage.ru_utime) + seconds(usage.ru_stime);
}

std::string descriptor_warning(std::uint64_t allowed, std::uint32_t clients) {
  const std::uint64_t needed = std::uint64_t{clients} * 2 + kOtherDescriptors;
  if (allowed >= needed) return {};
  return fmt::format("{} clients need {} file descriptors and {} are allowed: raise the limit with ulimit -n {}",
                     clients, needed, allowed, needed);
}

std::uint64_t raise_descriptor_limit() {
  rlimit limit{};
  if (::getrlimit(RLIMIT_NOFILE, &limit) != 0) return 0;
  const rlim_t before = limit.rlim_cur;
  limit.rlim_cur = limit.rlim_max;
  return ::setrlimit(RLIMIT_NOFILE, &limit) == 0 ? limit.rlim_max : before;
}

}  // namespace darm::client::load

#include "client/load/emulated_link.hpp"

#include <algorithm>
#include <utility>

#include "client/load/crowd.hpp"

namespace darm::client::load {
namespace {

constexpr std::size_t kLeastWindow = 16 * 1024;
constexpr std::size_t kLargestWindow = 4 * 1024 * 1024;

}  // namespace

bool EmulatedLink::loses_one(std::size_t bytes) {
  bool lost = false;
  for (std::size_t at = 0; at < bytes; at += kPacketBytes)
    lost = (shape_.loss > 0 && chance(seed_, packets_++) < shape_.loss) || lost;
  return lost;
}

void EmulatedLink::push(std::vector<std::uint8_t> bytes, std::int64_t now_us) {
  const double takes =
      shape_.bytes_per_second > 0 ? static_cast<double>(bytes.size()) / shape_.bytes_per_second * 1e6 : 0.0;
  free_us_ = std::max(free_us_, static_cast<double>(now_us)) + takes;
  double due = free_us_ + shape_.delay_ms * 1000;
  if (loses_one(bytes.size())) due += 2 * shape_.delay_ms * 1000;
  last_due_us_ = std::max(last_due_us_, static_cast<std::int64_t>(due));
  held_ += bytes.size();
  pieces_.push_back({std::move(bytes), last_due_us_});
}

std::optional<std::vector<std::uint8_t>> EmulatedLink::pop(std::int64_t now_us) {
  if (pieces_.empty() || pieces_.front().due_us > now_us) return std::nullopt;
  auto bytes = std::move(pieces_.front().bytes);
  pieces_.pop_front();
  held_ -= bytes.size();
  return bytes;
}

std::size_t EmulatedLink::room() const {
  // Two round trips of the rate; a line without a rate holds what a large window of TCP does.
  const double window = shape_.bytes_per_second > 0 ? shape_.bytes_per_second * (shape_.delay_ms * 4e-3 + 0.1) : 4e6;
  const auto most = static_cast<std::size_t>(std::clamp(window, double{kLeastWindow}, double{kLargestWindow}));
  return most > held_ ? most - held_ : 0;
}

}  // namespace darm::client::load

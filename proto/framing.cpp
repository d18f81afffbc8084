#include "proto/framing.hpp"

#include "proto/darm.pb.h"
#include "proto/limits.hpp"

namespace darm::proto {
namespace {

std::uint32_t get_length(const std::uint8_t* in) {
  return (std::uint32_t{in[0]} << 24) | (std::uint32_t{in[1]} << 16) | (std::uint32_t{in[2]} << 8) | in[3];
}

}  // namespace

void put_length(std::uint32_t length, std::uint8_t* out4) {
  out4[0] = static_cast<std::uint8_t>(length >> 24);
  out4[1] = static_cast<std::uint8_t>(length >> 16);
  out4[2] = static_cast<std::uint8_t>(length >> 8);
  out4[3] = static_cast<std::uint8_t>(length);
}

void FrameReader::check_length() {
  if (!error_.empty() || buffered() < kLengthBytes) return;
  const std::size_t length = get_length(buffer_.data() + begin_);
  if (length > limit_) {
    constexpr std::size_t kHttp = 0x48545450;  // the letters
    error_ = length == kHttp
                 ? "the other end speaks HTTP: is this its port for browsers?"
                 : "message of " + std::to_string(length) + " bytes is over the limit of " + std::to_string(limit_);
    buffer_ = {};
    begin_ = 0;
  }
}

void FrameReader::feed(std::span<const std::uint8_t> bytes) {
  if (!error_.empty()) return;
  if (begin_ > 0) {
    buffer_.erase(buffer_.begin(), buffer_.begin() + static_cast<std::ptrdiff_t>(begin_));
    begin_ = 0;
  }
  // The length is looked at before the rest of the piece is kept.
  if (buffer_.size() < kLengthBytes) {
    const auto head = bytes.first(std::min(bytes.size(), kLengthBytes - buffer_.size()));
    buffer_.insert(buffer_.end(), head.begin(), head.end());
    bytes = bytes.subspan(head.size());
    check_length();
    if (!error_.empty()) return;
  }
  buffer_.insert(buffer_.end(), bytes.begin(), bytes.end());
}

std::expected<bool, std::string> FrameReader::next(wire::Envelope& out) {
  check_length();
  if (!error_.empty()) return std::unexpected(error_);
  if (buffered() < kLengthBytes) return false;
  const std::size_t length = get_length(buffer_.data() + begin_);
  if (buffered() < kLengthBytes + length) return false;
  if (!out.ParseFromArray(buffer_.data() + begin_ + kLengthBytes, static_cast<int>(length))) {
    error_ = "message of " + std::to_string(length) + " bytes is not a valid Envelope";
    return std::unexpected(error_);
  }
  begin_ += kLengthBytes + length;
  if (begin_ == buffer_.size()) {
    buffer_.clear();
    begin_ = 0;
  }
  return true;
}

std::vector<std::uint8_t> frame(const wire::Envelope& envelope) {
  const std::size_t length = envelope.ByteSizeLong();
  std::vector<std::uint8_t> bytes(kLengthBytes + length);
  put_length(static_cast<std::uint32_t>(length), bytes.data());
  envelope.SerializeWithCachedSizesToArray(bytes.data() + kLengthBytes);
  return bytes;
}

}  // namespace darm::proto

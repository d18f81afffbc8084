// What a server has packed with DEFLATE (zlib), unpacked within a bound.
#pragma once

#include <cstddef>
#include <optional>
#include <string>

namespace darm::client {

/// Nothing if `packed` is damaged or holds more than `at_most` bytes; takes memory for no more than those.
[[nodiscard]] std::optional<std::string> inflate(const std::string& packed, std::size_t at_most);

}  // namespace darm::client

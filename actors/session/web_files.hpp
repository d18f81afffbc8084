// Files of the web client, as they lie in the binary.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>

namespace darm::session {

/// One file under a fixed path. The bytes live as long as the process. Empty `gzip` or `brotli`: not kept in that form.
struct WebFile {
  std::string_view path;  ///< "/index.html"
  std::string_view type;  ///< its Content-Type
  std::string_view tag;   ///< changes with the content; printable, without quotes
  bool lasting = false;   ///< its name changes with its content: a browser need never ask again
  std::span<const std::uint8_t> plain;
  std::span<const std::uint8_t> gzip;
  std::span<const std::uint8_t> brotli;
};

using WebFiles = std::span<const WebFile>;

}  // namespace darm::session

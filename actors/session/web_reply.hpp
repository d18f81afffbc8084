// What is said over HTTP, without a socket: which file or refusal answers a request, and who may open a stream.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "actors/session/web_files.hpp"

namespace darm::session {

/// Where the WebSocket is, and the subprotocol it speaks (its number is proto::kProtocolVersion).
inline constexpr std::string_view kStreamPath = "/stream";
inline constexpr std::string_view kStreamProtocol = "darm.2";

/// Of a request, what an answer depends on. Header values as they came; empty: absent.
struct WebRequest {
  std::string_view method;
  std::string_view target;
  std::string_view accept_encoding;
  std::string_view if_none_match;
  bool has_body = false;
};

struct WebReply {
  unsigned status = 200;
  std::vector<std::pair<std::string_view, std::string>> headers;  ///< all but Content-Length, Connection and Date
  std::span<const std::uint8_t> file;                             ///< the body, if it is a file's
  std::string text;                                               ///< else
  bool send_body = true;                                          ///< false: HEAD or 304, the length alone
  bool close = false;                                             ///< the connection is of no further use
  [[nodiscard]] std::span<const std::uint8_t> body() const;
};

/// What /healthz says.
struct WebHealth {
  bool ready = true;
  unsigned sessions = 0;
  unsigned max_sessions = 0;
  unsigned https_port = 0;  ///< where this server speaks HTTPS; 0: nowhere
};

/// GET and HEAD of a file or /healthz; everything else is refused with the status that says why. A path is looked up in
/// `files` as it stands, so nothing but them can be reached.
[[nodiscard]] WebReply answer(const WebRequest& request, WebFiles files, const WebHealth& health);
/// A refusal in one sentence; closes the connection.
[[nodiscard]] WebReply refusal(unsigned status, std::string text);

/// True if a page of `origin` may open a stream here: it came from this server (`host` is the request's Host), it is in
/// `allowed` ("https://example.org", "*": everybody), or there is no origin (not a browser).
[[nodiscard]] bool origin_allowed(std::string_view origin, std::string_view host,
                                  const std::vector<std::string>& allowed);
/// True if a comma-separated list of tokens has `token` (case matters).
[[nodiscard]] bool list_has(std::string_view list, std::string_view token);

}  // namespace darm::session

#include "actors/session/web_reply.hpp"

#include <algorithm>
#include <cctype>

#include "proto/limits.hpp"

namespace darm::session {
namespace {

static_assert(proto::kProtocolVersion == 2, "kStreamProtocol names the version");

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

char lower(char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); }

bool equal_ignoring_case(std::string_view a, std::string_view b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](char x, char y) { return lower(x) == lower(y); });
}

// Calls `see` with each element of a comma-separated list until it says true; says whether it did.
template <class See>
bool any_element(std::string_view list, See&& see) {
  while (!list.empty()) {
    const auto comma = list.find(',');
    if (const auto element = trimmed(list.substr(0, comma)); !element.empty() && see(element)) return true;
    if (comma == std::string_view::npos) break;
    list.remove_prefix(comma + 1);
  }
  return false;
}

// "gzip;q=0" and "gzip; q=0.000" refuse the coding (RFC 9110, 12.5.3); other weights do not change our choice.
bool is_refused(std::string_view parameters) {
  const auto q = parameters.find("q=");
  if (q == std::string_view::npos) return false;
  const auto weight = trimmed(parameters.substr(q + 2));
  return !weight.empty() && std::all_of(weight.begin(), weight.end(), [](char c) { return c == '0' || c == '.'; });
}

bool accepts(std::string_view accept_encoding, std::string_view coding) {
  return any_element(accept_encoding, [&](std::string_view element) {
    const auto semicolon = element.find(';');
    return equal_ignoring_case(trimmed(element.substr(0, semicolon)), coding) &&
           (semicolon == std::string_view::npos || !is_refused(element.substr(semicolon + 1)));
  });
}

bool tag_matches(std::string_view if_none_match, std::string_view tag) {
  return any_element(if_none_match, [&](std::string_view element) {
    if (element == "*") return true;
    if (element.starts_with("W/")) element.remove_prefix(2);
    return element == tag;
  });
}

void add_security(WebReply& reply) {
  reply.headers.emplace_back("X-Content-Type-Options", "nosniff");
  reply.headers.emplace_back("Referrer-Policy", "no-referrer");
  reply.headers.emplace_back("Cross-Origin-Opener-Policy", "same-origin");
  reply.headers.emplace_back("Cross-Origin-Resource-Policy", "same-origin");
  reply.headers.emplace_back("Permissions-Policy", "camera=(), geolocation=(), microphone=()");
  // Geometry is unpacked by WebAssembly that comes with the page.
  reply.headers.emplace_back("Content-Security-Policy",
                             "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src 'self'; "
                             "style-src 'self'; img-src 'self' data:; connect-src 'self'; base-uri 'none'; "
                             "form-action 'none'; frame-ancestors 'self'");
}

WebReply health_reply(const WebHealth& health) {
  WebReply reply;
  reply.status = health.ready ? 200 : 503;
  reply.headers.emplace_back("Content-Type", "application/json");
  reply.headers.emplace_back("Cache-Control", "no-store");
  add_security(reply);
  reply.text = std::string("{\"status\":\"") + (health.ready ? "ok" : "stopping") +
               "\",\"protocol\":" + std::to_string(proto::kProtocolVersion) +
               ",\"sessions\":" + std::to_string(health.sessions) +
               ",\"max_sessions\":" + std::to_string(health.max_sessions) +
               ",\"https_port\":" + std::to_string(health.https_port) + "}\n";
  return reply;
}

WebReply file_reply(const WebFile& file, const WebRequest& request) {
  WebReply reply;
  std::string tag = "\"" + std::string(file.tag);
  reply.file = file.plain;
  std::string_view coding;
  if (!file.brotli.empty() && accepts(request.accept_encoding, "br")) {
    reply.file = file.brotli;
    coding = "br";
  } else if (!file.gzip.empty() && accepts(request.accept_encoding, "gzip")) {
    reply.file = file.gzip;
    coding = "gzip";
  }
  if (!coding.empty()) {
    reply.headers.emplace_back("Content-Encoding", coding);
    tag += "-" + std::string(coding);  // each form has its own
  }
  tag += "\"";
  if (tag_matches(request.if_none_match, tag)) {
    reply.status = 304;
    reply.send_body = false;
    reply.file = {};
  }
  reply.headers.emplace_back("Content-Type", file.type);
  reply.headers.emplace_back("ETag", std::move(tag));
  reply.headers.emplace_back("Vary", "Accept-Encoding");
  reply.headers.emplace_back("Cache-Control", file.lasting ? "public, max-age=31536000, immutable" : "no-cache");
  add_security(reply);
  return reply;
}

}  // namespace

std::span<const std::uint8_t> WebReply::body() const {
  if (!file.empty()) return file;
  return {reinterpret_cast<const std::uint8_t*>(text.data()), text.size()};
}

WebReply refusal(unsigned status, std::string text) {
  WebReply reply;
  reply.status = status;
  reply.headers.emplace_back("Content-Type", "text/plain; charset=utf-8");
  reply.headers.emplace_back("Cache-Control", "no-store");
  add_security(reply);
  reply.text = std::move(text) + "\n";
  reply.close = true;
  return reply;
}

WebReply answer(const WebRequest& request, WebFiles files, const WebHealth& health) {
  const bool head = request.method == "HEAD";
  WebReply reply;
  auto path = request.target.substr(0, request.target.find_first_of("?#"));
  if (!head && request.method != "GET") {
    reply = refusal(405, "Only GET and HEAD are answered here.");
    reply.headers.emplace_back("Allow", "GET, HEAD");
  } else if (request.has_body) {
    reply = refusal(413, "A request with a body is not taken.");
  } else if (path == "/healthz") {
    reply = health_reply(health);
  } else if (path == kStreamPath) {
    reply = refusal(426, "This is where the stream is: it takes a WebSocket with the subprotocol " +
                             std::string(kStreamProtocol) + ".");
    reply.headers.emplace_back("Upgrade", "websocket");
  } else {
    if (path == "/") path = "/index.html";
    const auto found = std::find_if(files.begin(), files.end(), [&](const WebFile& f) { return f.path == path; });
    reply = found != files.end() ? file_reply(*found, request) : refusal(404, "There is nothing under this path.");
    if (found == files.end()) reply.close = false;
  }
  if (head) reply.send_body = false;
  return reply;
}

bool origin_allowed(std::string_view origin, std::string_view host, const std::vector<std::string>& allowed) {
  if (origin.empty()) return true;
  if (std::any_of(allowed.begin(), allowed.end(),
                  [&](const std::string& a) { return a == "*" || equal_ignoring_case(a, origin); }))
    return true;
  const auto scheme = origin.find("://");
  return scheme != std::string_view::npos && !host.empty() && equal_ignoring_case(origin.substr(scheme + 3), host);
}

bool list_has(std::string_view list, std::string_view token) {
  return any_element(list, [&](std::string_view element) { return element == token; });
}

}  // namespace darm::session

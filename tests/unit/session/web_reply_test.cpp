#include "actors/session/web_reply.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>

namespace darm::session {
namespace {

const std::array<std::uint8_t, 4> kPlain{'p', 'l', 'a', 'i'};
const std::array<std::uint8_t, 2> kGzip{0x1f, 0x8b};
const std::array<std::uint8_t, 1> kBrotli{0x0b};
const std::array<WebFile, 2> kFiles{
    WebFile{"/index.html", "text/html; charset=utf-8", "t1", false, kPlain, kGzip, kBrotli},
    WebFile{"/view-ABCDEFGH.js", "text/javascript", "t2", true, kPlain, {}, {}}};

WebReply get(std::string_view target, std::string_view accept = {}, std::string_view if_none_match = {}) {
  return answer({"GET", target, accept, if_none_match, false}, kFiles, {});
}

std::string header(const WebReply& reply, std::string_view name) {
  const auto found =
      std::find_if(reply.headers.begin(), reply.headers.end(), [&](const auto& h) { return h.first == name; });
  return found == reply.headers.end() ? "(absent)" : found->second;
}

bool sends(const WebReply& reply, std::span<const std::uint8_t> what) {
  const auto body = reply.body();
  return reply.send_body && std::equal(body.begin(), body.end(), what.begin(), what.end());
}

TEST(WebReply, the_root_is_the_page) {
  const auto reply = get("/");
  EXPECT_EQ(reply.status, 200u);
  EXPECT_TRUE(sends(reply, kPlain));
  EXPECT_EQ(header(reply, "Content-Type"), "text/html; charset=utf-8");
  EXPECT_EQ(header(reply, "Content-Encoding"), "(absent)");
  EXPECT_EQ(header(reply, "Cache-Control"), "no-cache");
  EXPECT_TRUE(sends(get("/?view=1,2,3#x"), kPlain)) << "a query names a view, not another file";
}

TEST(WebReply, a_name_that_changes_with_its_content_is_kept_for_good) {
  EXPECT_EQ(header(get("/view-ABCDEFGH.js"), "Cache-Control"), "public, max-age=31536000, immutable");
}

TEST(WebReply, the_smallest_form_that_the_client_takes_is_sent) {
  EXPECT_TRUE(sends(get("/", "gzip, deflate, br"), kBrotli));
  EXPECT_EQ(header(get("/", "gzip, deflate, br"), "Content-Encoding"), "br");
  EXPECT_TRUE(sends(get("/", "GZIP;q=0.5"), kGzip));
  EXPECT_TRUE(sends(get("/", "br;q=0, gzip;q=0.0"), kPlain)) << "q=0 refuses";
  EXPECT_TRUE(sends(get("/", "brotli, gzipped"), kPlain)) << "whole names only";
  EXPECT_TRUE(sends(get("/view-ABCDEFGH.js", "br"), kPlain)) << "what is not there in that form goes plain";
  EXPECT_EQ(header(get("/"), "Vary"), "Accept-Encoding");
}

TEST(WebReply, what_the_browser_has_is_not_sent_again) {
  const auto tag = header(get("/", "gzip"), "ETag");
  const auto reply = get("/", "gzip", "\"other\", W/" + tag);
  EXPECT_EQ(reply.status, 304u);
  EXPECT_FALSE(reply.send_body);
  EXPECT_EQ(get("/", "br", tag).status, 200u) << "each form has a tag of its own";
  EXPECT_EQ(get("/", "", "*").status, 304u);
  EXPECT_EQ(get("/", "", "t1").status, 200u) << "a tag has quotes";
}

TEST(WebReply, head_is_get_without_the_body) {
  const auto reply = answer({"HEAD", "/", "gzip", "", false}, kFiles, {});
  EXPECT_EQ(reply.status, 200u);
  EXPECT_FALSE(reply.send_body);
  EXPECT_EQ(reply.body().size(), kGzip.size()) << "the length is the body's";
  EXPECT_EQ(header(reply, "Content-Encoding"), "gzip");
}

TEST(WebReply, nothing_but_the_files_can_be_reached) {
  for (const auto* target :
       {"/../index.html", "/%2e%2e/index.html", "//index.html", "/index.html/", "/./index.html", "", "index.html",
        "/etc/passwd", "http://elsewhere/index.html", "/view-ABCDEFGH.js%00", "*"})
    EXPECT_EQ(get(target).status, 404u) << target;
}

TEST(WebReply, other_methods_and_bodies_are_refused) {
  for (const auto* method : {"POST", "PUT", "DELETE", "OPTIONS", "TRACE", "get", ""}) {
    const auto reply = answer({method, "/", "", "", false}, kFiles, {});
    EXPECT_EQ(reply.status, 405u) << method;
    EXPECT_EQ(header(reply, "Allow"), "GET, HEAD");
    EXPECT_TRUE(reply.close);
  }
  EXPECT_EQ(answer({"GET", "/", "", "", true}, kFiles, {}).status, 413u);
  EXPECT_EQ(get("/stream").status, 426u);
  EXPECT_EQ(header(get("/stream"), "Upgrade"), "websocket");
}

TEST(WebReply, every_answer_carries_the_security_headers) {
  for (const auto& reply : {get("/"), get("/nothing"), get("/healthz"), get("/stream"), get("/", "", "*")}) {
    EXPECT_EQ(header(reply, "X-Content-Type-Options"), "nosniff");
    EXPECT_NE(header(reply, "Content-Security-Policy").find("default-src 'none'"), std::string::npos);
    EXPECT_EQ(header(reply, "Content-Security-Policy").find("unsafe-inline"), std::string::npos);
  }
}

TEST(WebReply, health_is_told_in_numbers) {
  const auto well = answer({"GET", "/healthz", "", "", false}, kFiles, {true, 3, 64, 9080});
  EXPECT_EQ(well.status, 200u);
  EXPECT_EQ(well.text, "{\"status\":\"ok\",\"protocol\":2,\"sessions\":3,\"max_sessions\":64,\"https_port\":9080}\n");
  EXPECT_EQ(header(well, "Cache-Control"), "no-store");
  EXPECT_EQ(answer({"GET", "/healthz", "", "", false}, kFiles, {false, 0, 64}).status, 503u);
}

TEST(WebOrigin, pages_of_this_server_and_clients_without_pages_may_stream) {
  EXPECT_TRUE(origin_allowed("", "example.org", {}));
  EXPECT_TRUE(origin_allowed("https://example.org", "example.org", {}));
  EXPECT_TRUE(origin_allowed("http://[::1]:9080", "[::1]:9080", {}));
  EXPECT_TRUE(origin_allowed("https://Example.ORG:8443", "example.org:8443", {}));
}

TEST(WebOrigin, pages_of_others_may_not_unless_they_are_named) {
  for (const auto* origin : {"https://evil.org", "https://example.org.evil.org", "https://example.org:81", "null",
                             "example.org", "https://", "://example.org.x"})
    EXPECT_FALSE(origin_allowed(origin, "example.org", {})) << origin;
  EXPECT_FALSE(origin_allowed("https://", "", {})) << "no host is no match";
  EXPECT_TRUE(origin_allowed("https://friend.org", "example.org", {"https://friend.org"}));
  EXPECT_TRUE(origin_allowed("null", "example.org", {"*"}));
}

TEST(WebOrigin, subprotocols_are_whole_tokens) {
  EXPECT_TRUE(list_has("chat, darm.1", "darm.1"));
  EXPECT_FALSE(list_has("darm.10, xdarm.1,darm.1x", "darm.1"));
  EXPECT_FALSE(list_has("", "darm.1"));
}

}  // namespace
}  // namespace darm::session

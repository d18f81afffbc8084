// links: darm_session
// What a browser may say: any request, split at newlines into its parts, gets a well-formed answer.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "actors/session/web_reply.hpp"

namespace {

constexpr std::array<std::uint8_t, 3> kBytes{1, 2, 3};
const std::array<darm::session::WebFile, 1> kFiles{
    darm::session::WebFile{"/index.html", "text/html", "t", false, kBytes, kBytes, kBytes}};

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  std::string_view rest(reinterpret_cast<const char*>(data), size);
  std::array<std::string_view, 6> parts;
  for (auto& part : parts) {
    const auto end = rest.find('\n');
    part = rest.substr(0, end);
    rest.remove_prefix(end == std::string_view::npos ? rest.size() : end + 1);
  }
  const auto reply = darm::session::answer({parts[0], parts[1], parts[2], parts[3], !rest.empty()}, kFiles, {});
  if (reply.status < 200 || reply.status > 599 || reply.headers.empty()) std::abort();
  for (const auto& [name, value] : reply.headers)
    if (value.find_first_of("\r\n") != std::string::npos) std::abort();
  // A page of another host never streams here unless it is named.
  if (darm::session::origin_allowed(parts[4], parts[5], {}) && !parts[4].empty() &&
      (parts[5].empty() || parts[4].size() < parts[5].size() + 3))
    std::abort();
  static_cast<void>(darm::session::list_has(parts[2], "darm.1"));
  return 0;
}

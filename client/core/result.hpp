// Failures of the client as values. The client never includes the server's rooms, so it has its own.
#pragma once

#include <cstdint>
#include <expected>
#include <string>
#include <utility>

namespace darm::client {

/// Whether the same thing may go well later, for those who come again by themselves.
enum class Cause : std::uint8_t {
  kOther,     ///< said nowhere: networks, files, the GL
  kFull,      ///< the server has as many clients as it may have
  kVersion,   ///< client and server speak different versions
  kRefused,   ///< the server does not give what was asked for
  kProtocol,  ///< one of both has broken the protocol
};

/// `message` is one line: the thing at fault, what is wrong with it, the way out where there is one. Never empty.
struct Error {
  std::string message;
  Cause cause = Cause::kOther;
  explicit Error(std::string text, Cause why = Cause::kOther) : message(std::move(text)), cause(why) {}
};

template <class T>
using Result = std::expected<T, Error>;

/// Shorthand for `return fail("...")`.
[[nodiscard]] inline std::unexpected<Error> fail(std::string text, Cause why = Cause::kOther) {
  return std::unexpected<Error>(Error(std::move(text), why));
}

}  // namespace darm::client

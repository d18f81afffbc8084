// Failures of the client as values. The client never includes the server's rooms, so it has its own.
#pragma once

#include <expected>
#include <string>
#include <utility>

namespace darm::client {

/// `message` is one line: the thing at fault, what is wrong with it, the way out where there is one. Never empty.
struct Error {
  std::string message;
  explicit Error(std::string text) : message(std::move(text)) {}
};

template <class T>
using Result = std::expected<T, Error>;

/// Shorthand for `return fail("...")`.
[[nodiscard]] inline std::unexpected<Error> fail(std::string text) {
  return std::unexpected<Error>(Error(std::move(text)));
}

}  // namespace darm::client

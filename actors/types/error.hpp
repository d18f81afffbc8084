// One error type for the whole house: what went wrong, with which thing, and the way out.
#pragma once

#include <expected>
#include <string>
#include <utility>

namespace darm {

/// A failure as a value. `message` is one line, starts with the thing at fault (a file, a key, an address),
/// says what is wrong with it and, where there is one, the way out. Never empty.
struct Error {
  std::string message;

  Error() = default;
  explicit Error(std::string text) : message(std::move(text)) {}

  /// The same error seen from further out: "context: message".
  [[nodiscard]] Error within(const std::string& context) const { return Error(context + ": " + message); }
};

/// A value or an Error. Expected failures (files, network, config) travel this way; exceptions are for bugs only.
template <class T>
using Result = std::expected<T, Error>;

/// Shorthand for `return fail("...")`.
[[nodiscard]] inline std::unexpected<Error> fail(std::string text) {
  return std::unexpected<Error>(Error(std::move(text)));
}

}  // namespace darm

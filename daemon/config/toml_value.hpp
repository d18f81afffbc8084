// A parsed TOML file as plain values, so that toml++ stays behind one .cpp.
#pragma once

#include <cstdint>
#include <expected>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <variant>
#include <vector>

namespace darm::config {

struct TomlValue;
using TomlArray = std::vector<TomlValue>;
using TomlTable = std::vector<std::pair<std::string, TomlValue>>;

/// A value and the line it stands on. std::monostate: a date or a time, which no key of ours takes.
struct TomlValue {
  std::variant<std::monostate, bool, std::int64_t, double, std::string, std::shared_ptr<const TomlArray>,
               std::shared_ptr<const TomlTable>>
      data;
  int line = 0;
  /// Null if the value is something else.
  [[nodiscard]] const TomlArray* array() const;
  [[nodiscard]] const TomlTable* table() const;
  /// As it reads in a message: 3, "text", [array], {table}; long texts are cut, control characters masked.
  [[nodiscard]] std::string shown() const;
};

struct TomlSyntaxError {
  int line = 0;
  std::string text;
};

/// The root table. Nesting deeper than toml++ takes (256) is a syntax error.
[[nodiscard]] std::expected<TomlValue, TomlSyntaxError> parse_toml(std::string_view text);

}  // namespace darm::config

#include "daemon/config/toml_value.hpp"

#include <fmt/format.h>
#include <toml++/toml.h>

namespace darm::config {
namespace {

TomlValue convert(const toml::node& node) {
  TomlValue value;
  value.line = static_cast<int>(node.source().begin.line);
  node.visit([&value](const auto& concrete) {
    if constexpr (toml::is_boolean<decltype(concrete)>) {
      value.data = concrete.get();
    } else if constexpr (toml::is_integer<decltype(concrete)>) {
      value.data = concrete.get();
    } else if constexpr (toml::is_floating_point<decltype(concrete)>) {
      value.data = concrete.get();
    } else if constexpr (toml::is_string<decltype(concrete)>) {
      value.data = concrete.get();
    } else if constexpr (toml::is_array<decltype(concrete)>) {
      TomlArray array;
      array.reserve(concrete.size());
      for (const auto& element : concrete) array.push_back(convert(element));
      value.data = std::make_shared<const TomlArray>(std::move(array));
    } else if constexpr (toml::is_table<decltype(concrete)>) {
      TomlTable table;
      for (const auto& [key, element] : concrete) {
        table.emplace_back(std::string(key.str()), convert(element));
        // The line of a key is where it is written; a table made by "[a.b]" has none of its own.
        if (key.source().begin.line != 0 && !element.is_table())
          table.back().second.line = static_cast<int>(key.source().begin.line);
      }
      value.data = std::make_shared<const TomlTable>(std::move(table));
    }
  });
  return value;
}

}  // namespace

const TomlArray* TomlValue::array() const {
  const auto* held = std::get_if<std::shared_ptr<const TomlArray>>(&data);
  return held != nullptr ? held->get() : nullptr;
}

const TomlTable* TomlValue::table() const {
  const auto* held = std::get_if<std::shared_ptr<const TomlTable>>(&data);
  return held != nullptr ? held->get() : nullptr;
}

std::string TomlValue::shown() const {
  if (const auto* b = std::get_if<bool>(&data)) return *b ? "true" : "false";
  if (const auto* i = std::get_if<std::int64_t>(&data)) return fmt::format("{}", *i);
  if (const auto* d = std::get_if<double>(&data)) return fmt::format("{}", *d);
  if (array() != nullptr) return "a list";
  if (table() != nullptr) return "a table";
  const auto* s = std::get_if<std::string>(&data);
  if (s == nullptr) return "a date or time";
  std::string text = s->substr(0, 60);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return '"' + text + (s->size() > 60 ? "...\"" : "\"");
}

std::expected<TomlValue, TomlSyntaxError> parse_toml(std::string_view text) {
  try {
    return convert(toml::parse(text));
  } catch (const toml::parse_error& e) {
    return std::unexpected(TomlSyntaxError{static_cast<int>(e.source().begin.line), std::string(e.description())});
  }
}

}  // namespace darm::config

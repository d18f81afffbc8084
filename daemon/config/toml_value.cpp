#include "daemon/config/toml_value.hpp"

#include <fmt/format.h>

#include <stdexcept>

// toml++ 3.3 takes some malformed keys as failed assertions, and in release builds as undefined behaviour (found by
// fuzzing). Here they are errors like any other.
#undef NDEBUG
namespace {
[[noreturn]] void malformed_toml() { throw std::runtime_error("malformed"); }
}  // namespace
#define TOML_ASSERT(condition) (static_cast<bool>(condition) ? static_cast<void>(0) : malformed_toml())
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
  if (const auto* list = array()) return fmt::format("a list of {}", list->size());
  if (table() != nullptr) return "a table";
  const auto* s = std::get_if<std::string>(&data);
  if (s == nullptr) return "a date or time";
  std::string text = s->substr(0, 60);
  for (char& c : text)
    if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f) c = '?';
  return '"' + text + (s->size() > 60 ? "...\"" : "\"");
}

// Line of the first non-ASCII byte outside quotes and comments; 0: none. TOML allows none there, and toml++ 3.3 runs
// into undefined behaviour on some of them (found by fuzzing). Quotes are taken to end with their line.
static int line_of_bare_non_ascii(std::string_view text) {
  int line = 1;
  char inside = 0;  // '"', '\'' or '#'; 0: none
  for (std::size_t i = 0; i < text.size(); ++i) {
    const char c = text[i];
    if (c == '\n') {
      ++line;
      inside = 0;
    } else if (inside == '"' && c == '\\') {
      ++i;
      if (i < text.size() && text[i] == '\n') {
        ++line;
        inside = 0;
      }
    } else if (inside == 0 && (c == '"' || c == '\'' || c == '#')) {
      inside = c;
    } else if (inside == c && c != '#') {
      inside = 0;
    } else if (inside == 0 && static_cast<unsigned char>(c) >= 0x80) {
      return line;
    }
  }
  return 0;
}

std::expected<TomlValue, TomlSyntaxError> parse_toml(std::string_view text) {
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);  // byte-order mark
  if (const int line = line_of_bare_non_ascii(text); line > 0) {
    return std::unexpected(TomlSyntaxError{line, "a character that is not ASCII outside quotes and comments"});
  }
  try {
    return convert(toml::parse(text));
  } catch (const toml::parse_error& e) {
    return std::unexpected(TomlSyntaxError{static_cast<int>(e.source().begin.line), std::string(e.description())});
  } catch (const std::runtime_error& e) {
    return std::unexpected(TomlSyntaxError{0, e.what()});
  }
}

}  // namespace darm::config

// Is a text well-formed XML, as far as what we write can go wrong: tags, attributes, bare ampersands.
#pragma once

#include <cctype>
#include <string>
#include <string_view>
#include <vector>

namespace darm::accuracy::testing {

/// Empty: it is. Else what is wrong.
inline std::string fault_of(std::string_view text) {
  std::vector<std::string> open;
  const auto entities_fault = [](std::string_view part) {
    for (std::size_t i = part.find('&'); i != std::string_view::npos; i = part.find('&', i + 1)) {
      const auto end = part.find(';', i);
      if (end == std::string_view::npos || end - i > 7) return true;
      for (const char c : part.substr(i + 1, end - i - 1))
        if (std::isalnum(static_cast<unsigned char>(c)) == 0 && c != '#') return true;
    }
    return false;
  };
  if (text.starts_with("<!DOCTYPE html>")) text.remove_prefix(15);
  while (!text.empty()) {
    const auto tag = text.find('<');
    const auto words = text.substr(0, tag);
    if (words.find('>') != std::string_view::npos) return "a bare > in: " + std::string(words);
    if (entities_fault(words)) return "a bare & in: " + std::string(words);
    if (tag == std::string_view::npos) break;
    text.remove_prefix(tag + 1);
    std::size_t end = 0;
    for (bool quoted = false; end < text.size() && (quoted || text[end] != '>'); ++end) {
      if (text[end] == '"') quoted = !quoted;
      if (text[end] == '<') return "< within a tag";
    }
    if (end == text.size()) return "a tag has no end";
    const auto inside = text.substr(0, end);
    text.remove_prefix(end + 1);
    if (entities_fault(inside)) return "a bare & in: " + std::string(inside);
    if (inside.starts_with("/")) {
      if (open.empty() || open.back() != inside.substr(1)) return "closes what is not open: " + std::string(inside);
      open.pop_back();
    } else if (!inside.ends_with("/")) {
      open.emplace_back(inside.substr(0, inside.find_first_of(" \n")));
    }
  }
  return open.empty() ? std::string() : "never closed: " + open.back();
}

}  // namespace darm::accuracy::testing

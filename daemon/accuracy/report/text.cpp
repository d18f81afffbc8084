#include "daemon/accuracy/report/text.hpp"

#include <charconv>
#include <cmath>
#include <cstdint>
#include <cstdio>

namespace darm::accuracy {
namespace {

std::string printed(const char* format, double value) {
  char out[64];
  const int size = std::snprintf(out, sizeof out, format, value);
  return size > 0 ? std::string(out, static_cast<std::size_t>(std::min<int>(size, sizeof out - 1))) : std::string();
}

// Two significant digits without an exponent.
std::string two_digits(double value) {
  const double size = std::abs(value);
  if (size >= 9.95) return printed("%.0f", value);
  if (size >= 0.995 || size == 0) return printed("%.1f", value);
  if (size >= 0.0995) return printed("%.2f", value);
  if (size >= 0.00995) return printed("%.3f", value);
  return printed("%.4f", value);
}

// Length of the valid UTF-8 sequence at the start of `text` (0: none) and its code point.
std::size_t sequence(std::string_view text, std::uint32_t& code) {
  const auto byte = [&](std::size_t i) { return static_cast<std::uint8_t>(text[i]); };
  const std::uint8_t first = byte(0);
  if (first < 0x80) {
    code = first;
    return 1;
  }
  const std::size_t length = first >= 0xf0 ? 4 : first >= 0xe0 ? 3 : 2;
  if (first < 0xc2 || first > 0xf4 || text.size() < length) return 0;
  code = first & (0x7fu >> length);
  for (std::size_t i = 1; i < length; ++i) {
    if ((byte(i) & 0xc0) != 0x80) return 0;
    code = code << 6 | (byte(i) & 0x3fu);
  }
  const std::uint32_t least[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xd800 && code <= 0xdfff;
  return code < least[length] || code > 0x10ffff || surrogate ? 0 : length;
}

bool is_forbidden(std::uint32_t code) {
  return (code < 0x20 && code != '\t' && code != '\n' && code != '\r') || (code >= 0x7f && code < 0xa0) ||
         (code & 0xfffe) == 0xfffe;
}

// Calls put(code, bytes) for each character; what is no character comes as U+FFFD.
template <class Put>
void for_each_character(std::string_view text, const Put& put) {
  while (!text.empty()) {
    std::uint32_t code = 0;
    const std::size_t length = sequence(text, code);
    if (length == 0 || is_forbidden(code))
      put(0xfffdu, std::string_view("\xef\xbf\xbd"));
    else
      put(code, text.substr(0, length));
    text.remove_prefix(length == 0 ? 1 : length);
  }
}

}  // namespace

std::string seconds_text(double seconds) {
  if (!std::isfinite(seconds)) return kNothing;
  return seconds >= 0 && seconds < 0.00995 ? "under 0.01" : two_digits(seconds);
}
std::string db_text(double db) { return std::isfinite(db) ? printed("%.1f", db) : kNothing; }
std::string ratio_text(double ratio) { return std::isfinite(ratio) ? two_digits(ratio) : kNothing; }

std::string bytes_text(double bytes) {
  if (!std::isfinite(bytes)) return kNothing;
  return bytes < 999'500 ? printed("%.0f kB", bytes * 1e-3) : two_digits(bytes * 1e-6) + " MB";
}

std::string count_text(double count) {
  if (!std::isfinite(count)) return kNothing;
  if (count >= 999'500) return two_digits(count * 1e-6) + " M";
  if (count >= 9'950) return printed("%.0f k", count * 1e-3);
  return printed("%.0f", count);
}

std::string exact_text(double value) {
  if (!std::isfinite(value)) return {};
  char out[64];
  const auto end = std::to_chars(out, out + sizeof out, value);
  return std::string(out, end.ptr);
}

std::string xml_text(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  for_each_character(text, [&](std::uint32_t code, std::string_view bytes) {
    switch (code) {
      case '&':
        out += "&amp;";
        break;
      case '<':
        out += "&lt;";
        break;
      case '>':
        out += "&gt;";
        break;
      case '"':
        out += "&quot;";
        break;
      case '\'':
        out += "&#39;";
        break;
      default:
        out += bytes;
    }
  });
  return out;
}

std::string markdown_text(std::string_view text) {
  std::string out;
  for_each_character(text, [&](std::uint32_t code, std::string_view bytes) {
    if (code == '\n' || code == '\r' || code == '\t') {
      out += ' ';
      return;
    }
    if (code == '<') {
      out += "&lt;";
      return;
    }
    if (code < 0x80 && std::string_view("\\`*_[]|~").find(static_cast<char>(code)) != std::string_view::npos)
      out += '\\';
    out += bytes;
  });
  return out;
}

std::string csv_field(std::string_view text) {
  const bool blank = !text.empty() && (text.front() == ' ' || text.back() == ' ');
  if (!blank && text.find_first_of("\",\r\n") == std::string_view::npos) return std::string(text);
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"') out += '"';
    out += c;
  }
  return out + '"';
}

}  // namespace darm::accuracy

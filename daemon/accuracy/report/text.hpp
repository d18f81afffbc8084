// Numbers and names as people read them, safe in HTML, SVG, Markdown and CSV. Pure.
#pragma once

#include <string>
#include <string_view>

namespace darm::accuracy {

/// What stands where there is no number; NaN and infinity are never printed.
inline constexpr const char* kNothing = "–";

/// Two significant digits up to 10 s, whole seconds from there: "0.34", "2.1", "14"; "under 0.01" where it is.
[[nodiscard]] std::string seconds_text(double seconds);
/// One decimal: "37.6".
[[nodiscard]] std::string db_text(double db);
/// Two significant digits, whole from 10: "0.85", "3.2", "14".
[[nodiscard]] std::string ratio_text(double ratio);
/// "830 kB", "1.4 MB".
[[nodiscard]] std::string bytes_text(double bytes);
/// "1.2 M", "45 k", "16".
[[nodiscard]] std::string count_text(double count);
/// A number for a machine, shortest form that reads back the same; empty where it is not finite.
[[nodiscard]] std::string exact_text(double value);

/// Text within XML or HTML, attributes included. Bytes that are not UTF-8 and characters that XML forbids become
/// U+FFFD.
[[nodiscard]] std::string xml_text(std::string_view text);
/// Text within a cell of a Markdown table: bars and what would be mark-up or HTML escaped, line ends are spaces.
[[nodiscard]] std::string markdown_text(std::string_view text);
/// A CSV field (RFC 4180): in quotes where it holds a quote, comma, line end, or blanks at an end.
[[nodiscard]] std::string csv_field(std::string_view text);

}  // namespace darm::accuracy

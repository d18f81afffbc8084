// Measurements on disk, one JSON object a line: a run that was cut off goes on after the last whole line.
#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

#include "actors/types/error.hpp"
#include "daemon/accuracy/report/measurement.hpp"

namespace darm::accuracy {

/// A measurement as one line, without the line's end.
[[nodiscard]] std::string to_line(const Measurement& measurement);

/// Errors: not JSON, a key that is missing or of another kind, a number that is not finite or out of any range, a curve
/// whose times do not increase.
[[nodiscard]] Result<Measurement> parse_line(std::string_view line);

/// The measurements of a text. Lines that are none (cut off, of another version) are left out: they are made anew. Of
/// two with one key the later counts.
[[nodiscard]] std::vector<Measurement> parse_results(std::string_view text);

/// Reads a file of at most 64 MiB; one that is not there holds nothing. Errors: it is larger, or cannot be read.
[[nodiscard]] Result<std::vector<Measurement>> load_results(const std::filesystem::path& file);

/// Adds a line and hands it to the kernel. Errors: disk.
[[nodiscard]] Result<void> append_result(const std::filesystem::path& file, const Measurement& measurement);

}  // namespace darm::accuracy

// TOML files -> Config, with every fault of every file found in one go.
#pragma once

#include <expected>
#include <filesystem>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "daemon/config/config.hpp"

namespace darm::config {

/// One thing that is wrong. `line` 0: the file as a whole.
struct Fault {
  std::string file;
  int line = 0;
  std::string key;   ///< full key, e.g. "stream.crf", "cameras[1].fovy"; may be empty
  std::string text;  ///< value, what is wrong with it, and the allowed range or the nearest known key

  /// "file:line: key: text"
  [[nodiscard]] std::string to_string() const;
};

using Loaded = std::expected<Config, std::vector<Fault>>;

/// Reads the files in order into one Config: a later file overrides single keys of an earlier one, and whole lists
/// ([[cameras]] ...). Unknown keys are faults. Files over 1 MiB are refused unread. Checks across keys (ports in use
/// twice, names used twice) are made once, on the sum.
[[nodiscard]] Loaded load(std::span<const std::filesystem::path> files);

/// The same for one text. `file` is what faults name and what relative paths are relative to.
[[nodiscard]] Loaded parse(std::string_view toml, const std::filesystem::path& file);

/// Checks across keys; call it again after command-line overrides.
[[nodiscard]] std::vector<Fault> check(const Config& config);

/// All faults, one a line.
[[nodiscard]] std::string to_string(std::span<const Fault> faults);

/// Every key there is, in order: "walkthrough", "scene.file", ..., "cameras[].name". For tests and documentation.
[[nodiscard]] std::vector<std::string> known_keys();

}  // namespace darm::config

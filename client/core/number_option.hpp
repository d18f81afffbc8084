// For command lines of clients: a number within bounds.
#pragma once

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <charconv>
#include <string>

namespace darm::client {

/// A finite number from `low` to `high`. CLI::Range lets NaN through.
[[nodiscard]] inline CLI::Validator number_option(double low, double high) {
  const auto range = fmt::format("{} to {}", low, high);
  return {[low, high, range](std::string& text) {
            double value = 0;
            const char* last = text.data() + text.size();
            const auto [end, error] = std::from_chars(text.data(), last, value);
            const bool in_range = value >= low && value <= high;  // false for NaN
            return error == std::errc() && end == last && in_range ? std::string()
                                                                   : "'" + text + "' is not a number, " + range;
          },
          range};
}

}  // namespace darm::client

// Sets up spdlog for the process: everybody logs by spdlog::info(...) and the like.
#pragma once

#include <string>
#include <string_view>

namespace darm::observe {

/// Log lines go to standard error: "2026-01-31T12:00:00.123Z info text", or with `json` one object a line:
/// {"time": ..., "level": ..., "thread": n, "message": ...}. `level`: trace, debug, info, warn, error; anything else is
/// taken as info. Call it before threads start; it may be called again.
void set_up_log(std::string_view level, bool json);

/// `text` as the inside of a JSON string: quotes, backslashes, control characters and bytes that are not UTF-8 escaped.
[[nodiscard]] std::string json_escaped(std::string_view text);

}  // namespace darm::observe

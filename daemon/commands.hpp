// The subcommands. Each prints its report, or one line on standard error, and returns the exit code.
#pragma once

#include "daemon/command_line.hpp"

namespace darm {

[[nodiscard]] int run(const ServeCommand& command);
[[nodiscard]] int run(const InspectCommand& command);
[[nodiscard]] int run(const RenderCommand& command);
[[nodiscard]] int run(const AccuracyCommand& command);
[[nodiscard]] inline int run(const Exit& command) { return command.code; }

}  // namespace darm

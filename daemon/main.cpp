// darmd: loads a glTF scene, path-traces light into its texture atlas, and streams what clients see.
#include <cstdio>
#include <exception>
#include <variant>

#include "daemon/commands.hpp"
#include "daemon/freed_memory.hpp"
#include "daemon/lifecycle/stop_signals.hpp"

int main(int argc, char** argv) try {
  darm::lifecycle::hold_stop_signals();
  darm::keep_freed_memory();
  const auto command = darm::parse_command_line(argc, argv);
  return std::visit([](const auto& what) { return darm::run(what); }, command);
} catch (const std::exception& error) {
  std::fprintf(stderr, "darmd: %s\n", error.what());
  return 1;
}

// darmd: loads a glTF scene, path-traces light into its texture atlas, and streams what clients see.
#include <malloc.h>

#include <cstdio>
#include <exception>
#include <variant>

#include "daemon/commands.hpp"

namespace {

// A look, a batch of light and a picture each allocate some hundred kilobytes and free them a millisecond later. Given
// back to the kernel each time, they cost more in page faults than in use (a sixth of the daemon's time with 100
// clients). Larger blocks, as a coder has, still go back.
void keep_freed_memory() {
  mallopt(M_MMAP_THRESHOLD, 4 << 20);
  mallopt(M_TRIM_THRESHOLD, 32 << 20);
}

}  // namespace

int main(int argc, char** argv) try {
  keep_freed_memory();
  const auto command = darm::parse_command_line(argc, argv);
  return std::visit([](const auto& what) { return darm::run(what); }, command);
} catch (const std::exception& error) {
  std::fprintf(stderr, "darmd: %s\n", error.what());
  return 1;
}

#include "daemon/lifecycle/interruption.hpp"

#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <utility>

namespace darm::lifecycle {

Interruption::Interruption(std::string name) : name_(std::move(name)), signals_([this](int) { on_signal(); }) {}

void Interruption::on_signal() {
  const char* line = isatty(STDERR_FILENO) == 1 ? "\n" : "";  // leaves the one that shows progress
  switch (count_.signal(std::chrono::steady_clock::now())) {
    case StopCount::Wish::kStop:
      asked_ = true;
      std::fprintf(stderr, "%s%s: stopping; once more leaves at once\n", line, name_.c_str());
      return;
    case StopCount::Wish::kNothingNew:
      return;
    case StopCount::Wish::kLeave:
      std::fprintf(stderr, "%s%s: left at once; what was kept before is still there\n", line, name_.c_str());
      std::_Exit(kInterrupted);
  }
}

}  // namespace darm::lifecycle

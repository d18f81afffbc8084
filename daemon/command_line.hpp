// argv -> what to do. CLI11 is seen in command_line.cpp only.
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <variant>
#include <vector>

#include "daemon/config/config.hpp"

namespace darm {

/// darmd serve
struct ServeCommand {
  config::Config config;
  std::uint64_t seed = 0;  ///< of the light's sample sequences
};

/// darmd inspect
struct InspectCommand {
  config::Config config;
  std::vector<std::string> cameras;  ///< SPECs; each adds a working-set report
  std::uint32_t width = 1280;
  std::uint32_t height = 720;
  bool measure = false;  ///< what the effect plan saves and each effect costs, on the first camera's paths
  bool json = false;
};

/// darmd render
struct RenderCommand {
  config::Config config;
  std::string camera;
  std::uint32_t width = 1280;
  std::uint32_t height = 720;
  std::uint32_t spp = 0;  ///< both halves together; 0: until `until_psnr`
  double until_psnr = 0;  ///< the reference's own PSNR, dB; 0: until `spp`
  bool view_independent = false;
  bool all_effects = false;  ///< the integrator with everything on, whatever the scene's plan is
  std::uint64_t seed = 1;
  std::filesystem::path out;
  bool json = false;
};

/// darmd accuracy
struct AccuracyCommand {
  config::Config config;
  std::vector<std::string> cameras;  ///< SPECs; none: the first of the set-up
  std::vector<std::string> only;     ///< groups or variants; none: all
  std::filesystem::path out;         ///< folder
  double seconds = 16;               ///< of an atlas run
  double reference_psnr = 40;        ///< dB
  std::uint32_t width = 1280;
  std::uint32_t height = 720;
  bool json = false;
};

/// Nothing to run: help, version or a fault has been printed; the process ends with `code`.
struct Exit {
  int code = 0;
};

using Command = std::variant<ServeCommand, InspectCommand, RenderCommand, AccuracyCommand, Exit>;

/// Parses the command line and loads the configuration it names; overrides are applied and checked. All faults of the
/// configuration are printed at once, to standard error.
[[nodiscard]] Command parse_command_line(int argc, char** argv);

}  // namespace darm

#include "daemon/accuracy/report/measurement.hpp"

#include <array>

namespace darm::accuracy {
namespace {
constexpr std::array<const char*, kGroups> kNames{"presets", "q",      "samples", "indirect", "filter",
                                                  "layers",  "frames", "codec",   "effects"};
}  // namespace

std::string name_of(Group group) { return kNames[static_cast<std::size_t>(group)]; }

std::optional<Group> group_of(const std::string& name) {
  for (std::size_t i = 0; i < kNames.size(); ++i)
    if (name == kNames[i]) return static_cast<Group>(i);
  return std::nullopt;
}

const Measurement* Report::find(const std::string& camera, Group group, const std::string& variant) const {
  for (const auto& m : measurements)
    if (m.camera == camera && m.group == group && m.variant == variant) return &m;
  return nullptr;
}

}  // namespace darm::accuracy

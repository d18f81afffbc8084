#include "actors/scene/gltf_ranges.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstddef>
#include <nlohmann/json.hpp>
#include <numbers>
#include <span>
#include <string_view>

#include "actors/scene/gltf_document.hpp"

namespace darm::scene::gltf {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kMostNamed = 8;  // of one kind of thing
constexpr double kQuarterTurn = std::numbers::pi / 2;

struct Range {
  std::array<std::string_view, 3> path;  // of objects; empty names are skipped. The last is the number's own.
  std::size_t numbers;                   // 1: a plain number, otherwise a list of so many
  double low;
  double high;
  bool zero_too = false;  // 0 has a meaning of its own outside the range
};

// As the readers of materials and lights take them (gltf_material.cpp, gltf_nodes.cpp).
constexpr std::array kOfMaterials{
    Range{{"pbrMetallicRoughness", "", "baseColorFactor"}, 4, 0, 1},
    Range{{"pbrMetallicRoughness", "", "metallicFactor"}, 1, 0, 1},
    Range{{"pbrMetallicRoughness", "", "roughnessFactor"}, 1, 0, 1},
    Range{{"", "", "emissiveFactor"}, 3, 0, 1},
    Range{{"", "", "alphaCutoff"}, 1, 0, 1e6},
    Range{{"normalTexture", "", "scale"}, 1, -1e3, 1e3},
    Range{{"extensions", "KHR_materials_emissive_strength", "emissiveStrength"}, 1, 0, 1e12},
    Range{{"extensions", "KHR_materials_ior", "ior"}, 1, 1, 100, true},
    Range{{"extensions", "KHR_materials_transmission", "transmissionFactor"}, 1, 0, 1},
    Range{{"extensions", "KHR_materials_volume", "thicknessFactor"}, 1, 0, 1e6},
    Range{{"extensions", "KHR_materials_volume", "attenuationDistance"}, 1, 0, 1e12},
    Range{{"extensions", "KHR_materials_volume", "attenuationColor"}, 3, 0, 1}};

// Colour and intensity count together: warn_of_lights.
constexpr std::array kOfLights{Range{{"", "", "color"}, 3, -1e300, 1e300}, Range{{"", "", "range"}, 1, 0, 1e12},
                               Range{{"spot", "", "innerConeAngle"}, 1, 0, kQuarterTurn},
                               Range{{"spot", "", "outerConeAngle"}, 1, 1e-3, kQuarterTurn}};

/// Null: the file does not give it.
const Json* value_at(const Json& thing, const Range& range) {
  const Json* at = &thing;
  for (const std::string_view name : range.path) {
    if (name.empty()) continue;
    if (!at->is_object() || !at->contains(name)) return nullptr;
    at = &at->at(name);
  }
  return at;
}

std::string shape_words(const Range& range) {
  return range.numbers == 1 ? "a number" : fmt::format("a list of {} numbers", range.numbers);
}

/// Empty: the value is taken as it is written.
std::string fault_of(const Json& value, const Range& range) {
  const auto outside = [&](double x) { return !(x >= range.low && x <= range.high) && !(range.zero_too && x == 0); };
  const std::string_view name = range.path.back();
  const bool list = range.numbers > 1;
  const bool shaped = list ? value.is_array() && value.size() == range.numbers &&
                                 std::ranges::all_of(value, [](const Json& x) { return x.is_number(); })
                           : value.is_number();
  if (!shaped) return fmt::format("{} is not {}; the default stands for what it lacks", name, shape_words(range));
  const auto* const begin = list ? &value.front() : &value;
  for (const Json& x : std::span(begin, range.numbers))
    if (const auto number = x.get<double>(); outside(number))
      return fmt::format("{} {:g} is outside {:g} to {:g}; the nearer of these is taken", name, number, range.low,
                         range.high);
  return {};
}

/// Empty: it is one of glTF's three, or not given.
std::string fault_of_alpha_mode(const Json& material) {
  const Json* mode = value_at(material, {{"", "", "alphaMode"}, 1, 0, 0});
  const bool known = mode == nullptr || *mode == "OPAQUE" || *mode == "MASK" || *mode == "BLEND";
  return known ? std::string() : "alphaMode is not OPAQUE, MASK or BLEND; OPAQUE is taken";
}

/// `more`: a fault of another kind, empty where there is none.
void warn_of(const Json& things, const char* kind, std::span<const Range> ranges, std::string (*more)(const Json&),
             std::vector<std::string>& warnings) {
  if (!things.is_array()) return;
  std::size_t found = 0;
  for (std::size_t i = 0; i < things.size(); ++i) {
    const auto note = [&](const std::string& fault) {
      if (fault.empty() || ++found > kMostNamed) return;
      const Json* name = value_at(things[i], {{"", "", "name"}, 1, 0, 0});
      warnings.push_back(
          named(kind, i, name != nullptr && name->is_string() ? name->get<std::string>() : std::string()) + ": " +
          fault);
    };
    for (const Range& range : ranges)
      if (const Json* value = value_at(things[i], range)) note(fault_of(*value, range));
    if (more != nullptr) note(more(things[i]));
  }
  if (found > kMostNamed)
    warnings.push_back(fmt::format("{} more values of {}s are taken otherwise than written", found - kMostNamed, kind));
}

}  // namespace

void warn_of_ranges(const Json& root, std::vector<std::string>& warnings) {
  if (const auto materials = root.find("materials"); materials != root.end())
    warn_of(*materials, "material", kOfMaterials, fault_of_alpha_mode, warnings);
  if (const Json* lights = value_at(root, {{"extensions", "KHR_lights_punctual", "lights"}, 1, 0, 0}))
    warn_of(*lights, "light", kOfLights, nullptr, warnings);
}

}  // namespace darm::scene::gltf

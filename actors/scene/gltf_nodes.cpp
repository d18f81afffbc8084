#include "actors/scene/gltf_nodes.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/gtc/matrix_transform.hpp>
#include <glm/gtc/quaternion.hpp>
#include <numbers>

#include "actors/scene/gltf_accessor.hpp"

namespace darm::scene::gltf {
namespace {

/// translation * rotation * scale; a zero rotation is none.
glm::dmat4 compose(const glm::dvec3& translation, glm::dquat rotation, const glm::dvec3& scale) {
  const double length = glm::length(rotation);
  rotation = length > 0.0 ? rotation / length : glm::dquat(1, 0, 0, 0);
  glm::dmat4 m = glm::mat4_cast(rotation);
  for (int c = 0; c < 3; ++c) m[c] *= scale[c];
  m[3] = glm::dvec4(translation, 1.0);
  return m;
}

glm::dmat4 local_transform(const tinygltf::Node& node) {
  if (node.matrix.size() == 16) {
    glm::dmat4 m;
    for (int c = 0; c < 4; ++c)
      for (int r = 0; r < 4; ++r) m[c][r] = node.matrix[static_cast<std::size_t>(c * 4 + r)];
    for (int c = 0; c < 4; ++c) m[c][3] = c == 3 ? 1.0 : 0.0;
    return m;
  }
  glm::dvec3 translation(0.0);
  glm::dvec3 scale(1.0);
  glm::dquat rotation(1, 0, 0, 0);
  if (node.translation.size() == 3) translation = {node.translation[0], node.translation[1], node.translation[2]};
  if (node.scale.size() == 3) scale = {node.scale[0], node.scale[1], node.scale[2]};
  if (node.rotation.size() == 4)
    rotation = glm::dquat(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
  return compose(translation, rotation, scale);
}

/// Roots of the scene to show: `scene`, else the first; a file without scenes but with nodes shows all its roots.
Result<std::vector<int>> root_nodes(const tinygltf::Model& model) {
  const int wanted = model.defaultScene;
  if (!model.scenes.empty()) {
    const std::size_t index = wanted >= 0 ? static_cast<std::size_t>(wanted) : 0;
    if (index >= model.scenes.size()) return fail("names scene " + std::to_string(index) + ", which does not exist");
    return model.scenes[index].nodes;
  }
  if (wanted >= 0) return fail("names scene " + std::to_string(wanted) + ", but has no scenes");
  std::vector<bool> is_child(model.nodes.size(), false);
  for (const auto& node : model.nodes)
    for (const int child : node.children)
      if (child >= 0 && static_cast<std::size_t>(child) < is_child.size())
        is_child[static_cast<std::size_t>(child)] = true;
  std::vector<int> roots;
  for (std::size_t i = 0; i < is_child.size(); ++i)
    if (!is_child[i]) roots.push_back(static_cast<int>(i));
  if (roots.empty()) return fail("has no scene and no root nodes");
  return roots;
}

glm::dvec3 forward(const glm::dmat4& m) {
  const glm::dvec3 d = -glm::dvec3(m[2]);
  const double length = glm::length(d);
  return std::isfinite(length) && length > 0.0 ? d / length : glm::dvec3(0, 0, -1);
}

bool is_finite(const glm::dvec3& v) { return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z); }

}  // namespace

Result<std::vector<PlacedNode>> place_nodes(const Document& document) {
  struct Pending {
    int node;
    std::uint32_t depth;
    glm::dmat4 parent;
  };
  const auto& nodes = document.model.nodes;
  const auto roots = root_nodes(document.model);
  if (!roots) return std::unexpected(roots.error());
  std::vector<Pending> pending;
  for (auto it = roots->rbegin(); it != roots->rend(); ++it) pending.push_back({*it, 1, glm::dmat4(1.0)});
  std::vector<bool> seen(nodes.size(), false);
  std::vector<PlacedNode> placed;
  while (!pending.empty()) {
    const Pending next = pending.back();
    pending.pop_back();
    if (next.node < 0 || static_cast<std::size_t>(next.node) >= nodes.size())
      return fail("names node " + std::to_string(next.node) + ", which does not exist");
    const auto index = static_cast<std::size_t>(next.node);
    const auto& node = nodes[index];
    if (seen[index])
      return fail(named("node", index, node.name) +
                  " is reached twice: the hierarchy has a cycle, or the node two parents");
    if (next.depth > document.limits.max_depth)
      return fail(named("node", index, node.name) + " lies deeper than the limit of " +
                  std::to_string(document.limits.max_depth) + " levels");
    seen[index] = true;
    placed.push_back({index, next.parent * local_transform(node)});
    for (auto it = node.children.rbegin(); it != node.children.rend(); ++it)
      pending.push_back({*it, next.depth + 1, placed.back().to_world});
    if (pending.size() > 2 * document.limits.max_nodes)
      return fail("has more than " + std::to_string(document.limits.max_nodes) + " nodes");
  }
  return placed;
}

Result<std::vector<glm::dmat4>> read_instancing(Document& document, const tinygltf::Node& node) {
  const auto* extension = find_extension(node.extensions, "EXT_mesh_gpu_instancing");
  if (!extension) return std::vector<glm::dmat4>{glm::dmat4(1.0)};
  if (!extension->Has("attributes") || !extension->Get("attributes").IsObject())
    return fail("EXT_mesh_gpu_instancing has no attributes");
  const tinygltf::Value& attributes = extension->Get("attributes");
  std::array<FloatArray, 3> arrays;
  const std::array<std::pair<const char*, int>, 3> wanted = {{{"TRANSLATION", 3}, {"ROTATION", 4}, {"SCALE", 3}}};
  std::size_t count = 0;
  for (std::size_t i = 0; i < wanted.size(); ++i) {
    if (!attributes.Has(wanted[i].first)) continue;
    auto read = read_floats(document, integer_or(attributes, wanted[i].first, -1), wanted[i].second, wanted[i].second);
    if (!read) return std::unexpected(read.error().within("EXT_mesh_gpu_instancing"));
    arrays[i] = std::move(*read);
    if (count != 0 && arrays[i].count != count)
      return fail("EXT_mesh_gpu_instancing has attributes of different lengths");
    count = arrays[i].count;
  }
  if (count == 0) return fail("EXT_mesh_gpu_instancing has no instances");
  if (count > document.limits.max_nodes)
    return fail("EXT_mesh_gpu_instancing has " + std::to_string(count) + " instances, over the limit of " +
                std::to_string(document.limits.max_nodes));
  std::vector<glm::dmat4> out;
  out.reserve(count);
  for (std::size_t i = 0; i < count; ++i) {
    const auto vector = [&](const FloatArray& a, double missing) {
      return a.count ? glm::dvec3(a.at(i)[0], a.at(i)[1], a.at(i)[2]) : glm::dvec3(missing);
    };
    glm::dquat rotation(1, 0, 0, 0);
    if (arrays[1].count)
      rotation = glm::dquat(arrays[1].at(i)[3], arrays[1].at(i)[0], arrays[1].at(i)[1], arrays[1].at(i)[2]);
    out.push_back(compose(vector(arrays[0], 0.0), rotation, vector(arrays[2], 1.0)));
  }
  return out;
}

namespace {

constexpr double kMaxIntensity = 1e12;       // lux, candela: sums and squares of such light stay finite
constexpr std::size_t kMostLightsNamed = 8;  // in warnings
constexpr std::size_t kChannels = 3;

double intensity_of(const tinygltf::Light& light, std::size_t channel) {
  return (channel < light.color.size() ? light.color[channel] : 1.0) * light.intensity;
}

// Null: it can be taken as it is.
const char* fault_of_intensity(const tinygltf::Light& light) {
  const char* fault = nullptr;
  for (std::size_t c = 0; c < kChannels; ++c) {
    const double value = intensity_of(light, c);
    if (!std::isfinite(value)) return "has an intensity that is not finite; it is taken as 0, no light";
    if (value < 0.0) fault = "has a negative intensity; it is taken as 0, no light";
    if (value > kMaxIntensity && fault == nullptr) fault = "has an intensity over 1e12; it is taken as 1e12";
  }
  return fault;
}

}  // namespace

void warn_of_lights(Document& document) {
  std::size_t found = 0;
  for (std::size_t i = 0; i < document.model.lights.size(); ++i) {
    const tinygltf::Light& light = document.model.lights[i];
    const char* fault = fault_of_intensity(light);
    if (fault == nullptr || ++found > kMostLightsNamed) continue;
    document.warnings.push_back(named("light", i, light.name) + " " + fault);
  }
  if (found > kMostLightsNamed)
    document.warnings.push_back(std::to_string(found - kMostLightsNamed) + " more lights have such intensities");
}

Result<std::optional<PlacedLight>> read_light(const Document& document, const PlacedNode& placed) {
  const tinygltf::Node& node = document.model.nodes[placed.node];
  const auto* extension = find_extension(node.extensions, "KHR_lights_punctual");
  if (!extension) return std::nullopt;
  const int index = integer_or(*extension, "light", -1);
  if (index < 0 || static_cast<std::size_t>(index) >= document.model.lights.size())
    return fail("names light " + std::to_string(index) + ", which does not exist");
  const tinygltf::Light& in = document.model.lights[static_cast<std::size_t>(index)];
  PlacedLight out;
  if (in.type == "point") {
    out.light.kind = LightKind::kPoint;
  } else if (in.type == "spot") {
    out.light.kind = LightKind::kSpot;
  } else if (in.type == "directional") {
    out.light.kind = LightKind::kDirectional;
  } else {
    return fail("names light " + std::to_string(index) + " of an unknown type");
  }
  out.position = glm::dvec3(placed.to_world[3]);
  out.light.direction = glm::vec3(forward(placed.to_world));
  for (std::size_t c = 0; c < kChannels; ++c) {
    const double value = intensity_of(in, c);
    out.light.intensity[static_cast<int>(c)] =
        static_cast<float>(std::isfinite(value) ? std::clamp(value, 0.0, kMaxIntensity) : 0.0);
  }
  out.light.range = std::isfinite(in.range) && in.range > 0.0 ? static_cast<float>(std::min(in.range, 1e12)) : 0.0f;
  const double outer = std::isfinite(in.spot.outerConeAngle)
                           ? std::clamp(in.spot.outerConeAngle, 1e-3, std::numbers::pi / 2)
                           : std::numbers::pi / 4;
  const double inner = std::isfinite(in.spot.innerConeAngle) ? std::clamp(in.spot.innerConeAngle, 0.0, outer) : 0.0;
  out.light.cos_inner = static_cast<float>(std::cos(inner));
  out.light.cos_outer = static_cast<float>(std::cos(outer));
  if (!is_finite(out.position)) return std::nullopt;
  return out;
}

std::optional<NamedCamera> read_camera(Document& document, const PlacedNode& placed) {
  const tinygltf::Node& node = document.model.nodes[placed.node];
  if (node.camera < 0 || static_cast<std::size_t>(node.camera) >= document.model.cameras.size()) return std::nullopt;
  const tinygltf::Camera& in = document.model.cameras[static_cast<std::size_t>(node.camera)];
  const double fovy = in.perspective.yfov;
  const glm::dvec3 position(placed.to_world[3]);
  const char* fault = in.type != "perspective"                   ? "is not a perspective camera"
                      : !(fovy > 0.0 && fovy < std::numbers::pi) ? "has a yfov outside 0 to pi radians"
                      : !is_finite(position)                     ? "has no finite place"
                                                                 : nullptr;
  if (fault != nullptr) {
    document.warnings.push_back(named("camera", static_cast<std::size_t>(node.camera), in.name) + " " + fault +
                                " and is left out");
    return std::nullopt;
  }
  NamedCamera out;
  out.name = !in.name.empty() ? in.name : !node.name.empty() ? node.name : "camera " + std::to_string(node.camera);
  const glm::dvec3 look = forward(placed.to_world);
  out.camera = look_at(position, position + look, fovy * 180.0 / std::numbers::pi, glm::dvec3(placed.to_world[1]));
  return out;
}

bool is_dynamic(const tinygltf::Node& node) {
  if (!node.extras.IsObject() || !node.extras.Has("darm_dynamic")) return false;
  const tinygltf::Value& mark = node.extras.Get("darm_dynamic");
  return mark.IsBool() ? mark.Get<bool>() : mark.IsNumber() && mark.GetNumberAsDouble() != 0.0;
}

}  // namespace darm::scene::gltf

#include "actors/scene/gltf_loader.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/matrix.hpp>
#include <limits>
#include <string>
#include <unordered_set>

#include "actors/scene/gltf_document.hpp"
#include "actors/scene/gltf_image.hpp"
#include "actors/scene/gltf_material.hpp"
#include "actors/scene/gltf_mesh.hpp"
#include "actors/scene/gltf_nodes.hpp"
#include "actors/scene/scene_lights.hpp"

namespace darm::scene {
namespace {

using gltf::Document;

// Changes whenever the same file gives another Scene, so that cached results are not taken for the new ones.
constexpr std::uint64_t kLoaderVersion = 1;

constexpr double kFar = 1e4;           // metres from 0 at which float starts to cost visible precision
constexpr double kFarInExtents = 1e3;  // or this many times the scene's own size
constexpr double kMaxWorldCoordinate = 1e15;
constexpr double kMinRelativeVolume = 1e-12;  // of a transform, against the product of its column lengths

struct Bounds {
  glm::dvec3 low{std::numeric_limits<double>::infinity()};
  glm::dvec3 high{-std::numeric_limits<double>::infinity()};
  void add(const glm::dvec3& p) {
    low = glm::min(low, p);
    high = glm::max(high, p);
  }
  [[nodiscard]] bool valid() const { return low.x <= high.x; }
  [[nodiscard]] glm::dvec3 centre() const { return (low + high) * 0.5; }
  [[nodiscard]] double extent() const { return std::max({high.x - low.x, high.y - low.y, high.z - low.z}); }
};

/// True if coordinates around `b` lose precision that coordinates around 0 would keep.
bool is_far(const Bounds& b) {
  const glm::dvec3 c = glm::abs(b.centre());
  const double distance = std::max({c.x, c.y, c.z});
  return distance > kFar || distance > kFarInExtents * b.extent();
}

/// A mesh of the scene in the making: vertices are moved to their own middle when they lie far out, `shift` moves them
/// back.
struct BuiltMesh {
  std::uint32_t mesh = 0;
  glm::dvec3 shift{0.0};
};

/// Gathers the parts of one scene from a document.
class SceneBuilder {
 public:
  explicit SceneBuilder(Document& document) : document_(document) {}

  Result<std::shared_ptr<const Scene>> build(const LightSetup& setup);

 private:
  struct PendingInstance {
    std::uint32_t mesh;
    std::uint32_t object;
    glm::dmat4 to_world;
  };

  Result<void> add_node(const gltf::PlacedNode& placed);
  void add_camera(std::size_t node, NamedCamera camera);
  Result<void> add_mesh(const gltf::PlacedNode& placed, std::uint32_t object);
  Result<const std::vector<BuiltMesh>*> primitives_of(std::size_t mesh);
  void place(const BuiltMesh& built, const glm::dmat4& to_world, std::uint32_t object);
  void recentre();
  Result<void> take_images();
  void drop_unused_materials();
  [[nodiscard]] std::string dropped_list() const;

  Document& document_;
  std::shared_ptr<Scene> scene_ = std::make_shared<Scene>();
  std::vector<std::optional<std::vector<BuiltMesh>>> built_;  ///< by mesh of the file, made when first placed
  std::vector<PendingInstance> pending_;
  std::vector<gltf::PlacedLight> lights_;
  std::unordered_set<std::string> camera_names_;
  Bounds bounds_;
  std::uint64_t triangles_ = 0;
  std::uint64_t points_and_lines_ = 0;
};

Result<const std::vector<BuiltMesh>*> SceneBuilder::primitives_of(std::size_t index) {
  auto& built = built_[index];
  if (built) return &*built;
  built.emplace();
  const tinygltf::Mesh& in = document_.model.meshes[index];
  if (std::ranges::any_of(in.weights, [](double w) { return w != 0.0; }))
    document_.warnings.push_back(gltf::named("mesh", index, in.name) +
                                 " has morph targets, which are not supported: shown without them");
  for (std::size_t p = 0; p < in.primitives.size(); ++p) {
    const tinygltf::Primitive& primitive = in.primitives[p];
    const std::string name = gltf::named("mesh", index, in.name) + " primitive " + std::to_string(p);
    auto data = gltf::read_primitive(document_, primitive);
    if (!data) return std::unexpected(data.error().within(name));
    if (data->positions.empty()) {
      ++points_and_lines_;
      continue;
    }
    const std::size_t fallback = scene_->materials.size() - 1;
    if (primitive.material >= static_cast<int>(fallback))
      return fail(name + " names material " + std::to_string(primitive.material) + ", which does not exist");
    const std::size_t material = primitive.material >= 0 ? static_cast<std::size_t>(primitive.material) : fallback;
    const TextureRef& normal_map = scene_->materials[material].normal_texture;
    Mesh mesh = make_mesh(std::move(*data), normal_map.present() ? normal_map.uv_set : -1, document_.dropped);
    if (mesh.triangles.empty()) continue;
    mesh.name = in.name;
    mesh.material = static_cast<std::uint32_t>(material);
    BuiltMesh out{static_cast<std::uint32_t>(scene_->meshes.size()), glm::dvec3(0.0)};
    Bounds local;
    for (const glm::vec3& v : mesh.positions) local.add(glm::dvec3(v));
    if (is_far(local)) {
      out.shift = local.centre();
      for (glm::vec3& v : mesh.positions) v = glm::vec3(glm::dvec3(v) - out.shift);
    }
    scene_->meshes.push_back(std::move(mesh));
    built->push_back(out);
  }
  return &*built;
}

void SceneBuilder::place(const BuiltMesh& built, const glm::dmat4& node_to_world, std::uint32_t object) {
  const Mesh& mesh = scene_->meshes[built.mesh];
  glm::dmat4 to_world = node_to_world;
  to_world[3] = node_to_world * glm::dvec4(built.shift, 1.0);
  const glm::dmat3 linear(to_world);
  const double volume = std::abs(glm::determinant(linear));
  const double lengths = glm::length(linear[0]) * glm::length(linear[1]) * glm::length(linear[2]);
  if (!std::isfinite(lengths) || !(volume > kMinRelativeVolume * lengths)) {
    document_.dropped["singular or non-finite node transform"] += mesh.triangles.size();
    return;
  }
  Bounds here;
  for (const glm::vec3& v : mesh.positions) here.add(glm::dvec3(to_world * glm::dvec4(v, 1.0)));
  const glm::dvec3 reach = glm::max(glm::abs(here.low), glm::abs(here.high));
  if (!(reach.x < kMaxWorldCoordinate && reach.y < kMaxWorldCoordinate && reach.z < kMaxWorldCoordinate)) {
    document_.dropped["placed too far out"] += mesh.triangles.size();
    return;
  }
  bounds_.add(here.low);
  bounds_.add(here.high);
  triangles_ += mesh.triangles.size();
  pending_.push_back({built.mesh, object, to_world});
}

Result<void> SceneBuilder::add_mesh(const gltf::PlacedNode& placed, std::uint32_t object) {
  const tinygltf::Node& node = document_.model.nodes[placed.node];
  const auto mesh = static_cast<std::size_t>(node.mesh);
  if (mesh >= document_.model.meshes.size())
    return fail("names mesh " + std::to_string(node.mesh) + ", which does not exist");
  const auto primitives = primitives_of(mesh);
  if (!primitives) return std::unexpected(primitives.error());
  const auto copies = gltf::read_instancing(document_, node);
  if (!copies) return std::unexpected(copies.error());
  for (const glm::dmat4& copy : *copies) {
    for (const BuiltMesh& built : **primitives) place(built, placed.to_world * copy, object);
    if (triangles_ > document_.limits.max_triangles)
      return fail("takes the scene over the limit of " + std::to_string(document_.limits.max_triangles) + " triangles");
    if (pending_.size() > document_.limits.max_nodes)
      return fail("takes the scene over the limit of " + std::to_string(document_.limits.max_nodes) + " instances");
  }
  return {};
}

// Cameras are found by name, so a name that is taken hides every later camera of it.
void SceneBuilder::add_camera(std::size_t node, NamedCamera camera) {
  if (!camera_names_.insert(camera.name).second)
    document_.warnings.push_back(gltf::named("node", node, camera.name) +
                                 " has a camera of a name that another has; the name means the first");
  scene_->cameras.push_back(std::move(camera));
}

Result<void> SceneBuilder::add_node(const gltf::PlacedNode& placed) {
  const tinygltf::Node& node = document_.model.nodes[placed.node];
  if (auto camera = gltf::read_camera(document_, placed)) add_camera(placed.node, std::move(*camera));
  auto light = gltf::read_light(document_, placed);
  if (!light) return std::unexpected(light.error());
  if (node.mesh < 0 && !*light) return {};
  const auto object = static_cast<std::uint32_t>(scene_->objects.size());
  scene_->objects.push_back(
      {node.name.empty() ? "node " + std::to_string(placed.node) : node.name, gltf::is_dynamic(node)});
  if (*light) {
    (*light)->light.object = object;
    lights_.push_back(**light);
  }
  return node.mesh >= 0 ? add_mesh(placed, object) : Result<void>{};
}

void SceneBuilder::recentre() {
  if (is_far(bounds_)) scene_->origin = bounds_.centre();
  scene_->bounds_min = glm::vec3(bounds_.low - scene_->origin);
  scene_->bounds_max = glm::vec3(bounds_.high - scene_->origin);
  for (const PendingInstance& p : pending_) {
    glm::dmat4 m = p.to_world;
    m[3] -= glm::dvec4(scene_->origin, 0.0);
    scene_->instances.push_back({p.mesh, glm::mat4(m), glm::determinant(glm::dmat3(m)) < 0.0, p.object});
  }
  for (gltf::PlacedLight& l : lights_) {
    l.light.position = glm::vec3(l.position - scene_->origin);
    scene_->lights.push_back(l.light);
  }
}

/// Keeps the materials that a mesh uses, so that what is unused costs no decoding; order stays.
void SceneBuilder::drop_unused_materials() {
  std::vector<bool> used(scene_->materials.size(), false);
  for (const Mesh& m : scene_->meshes) used[m.material] = true;
  std::vector<std::uint32_t> to(used.size(), 0);
  std::vector<Material> kept;
  for (std::size_t i = 0; i < used.size(); ++i) {
    if (!used[i]) continue;
    to[i] = static_cast<std::uint32_t>(kept.size());
    kept.push_back(std::move(scene_->materials[i]));
  }
  scene_->materials = std::move(kept);
  for (Mesh& m : scene_->meshes) m.material = to[m.material];
}

Result<void> SceneBuilder::take_images() {
  std::vector<std::size_t> wanted;
  std::vector<std::int32_t> to(document_.images.size(), -1);
  for (Material& m : scene_->materials) {
    for (TextureRef* ref : {&m.base_color_texture, &m.metallic_roughness_texture, &m.normal_texture,
                            &m.emissive_texture, &m.transmission_texture}) {
      if (!ref->present()) continue;
      std::int32_t& index = to[static_cast<std::size_t>(ref->image)];
      if (index < 0) {
        index = static_cast<std::int32_t>(wanted.size());
        wanted.push_back(static_cast<std::size_t>(ref->image));
      }
      ref->image = index;
    }
  }
  auto images = gltf::decode_images(document_, wanted);
  if (!images) return std::unexpected(images.error());
  scene_->images = std::move(*images);
  return {};
}

/// " (12 dropped: zero area)" or nothing.
std::string SceneBuilder::dropped_list() const {
  std::string list;
  for (const auto& [reason, count] : document_.dropped)
    list += (list.empty() ? " (" : "; ") + std::to_string(count) + " dropped: " + reason;
  return list.empty() ? list : list + ")";
}

Result<std::shared_ptr<const Scene>> SceneBuilder::build(const LightSetup& setup) {
  if (auto ok = gltf::check_images(document_); !ok) return std::unexpected(ok.error());
  auto materials = gltf::read_materials(document_);
  if (!materials) return std::unexpected(materials.error());
  scene_->materials = std::move(*materials);
  built_.resize(document_.model.meshes.size());
  gltf::warn_of_lights(document_);
  const auto nodes = gltf::place_nodes(document_);
  if (!nodes) return std::unexpected(nodes.error());
  for (const gltf::PlacedNode& placed : *nodes)
    if (auto ok = add_node(placed); !ok)
      return std::unexpected(
          ok.error().within(gltf::named("node", placed.node, document_.model.nodes[placed.node].name)));
  for (const auto& [reason, count] : document_.dropped) scene_->dropped.push_back({reason, count});
  if (points_and_lines_ > 0) {
    scene_->dropped.push_back({"points or lines (" + std::to_string(points_and_lines_) + " primitives)", 0});
    document_.warnings.push_back(std::to_string(points_and_lines_) +
                                 " primitives of points or lines have no surface and are left out");
  }
  if (pending_.empty()) return fail("has no triangles to show" + dropped_list());
  recentre();
  drop_unused_materials();
  if (auto ok = take_images(); !ok) return std::unexpected(ok.error());
  apply_setup(*scene_, setup);
  scene_->warnings = document_.warnings;
  scene_->hash = hash_setup(setup, document_.file.hash() ^ kLoaderVersion);
  return std::shared_ptr<const Scene>(std::move(scene_));
}

Result<std::shared_ptr<const Scene>> load(Result<gltf::GltfFile> file, const std::string& name, const LightSetup& setup,
                                          const LoadLimits& limits) {
  if (!file) return std::unexpected(file.error().within(name));
  if (auto ok = check_setup(setup); !ok) return std::unexpected(ok.error().within("light set-up of " + name));
  auto document = gltf::parse_document(std::move(*file), limits);
  if (!document) return std::unexpected(document.error().within(name));
  auto scene = SceneBuilder(*document).build(setup);
  if (!scene) return std::unexpected(scene.error().within(name));
  return scene;
}

}  // namespace

Result<std::shared_ptr<const Scene>> load_scene(const std::filesystem::path& path, const LightSetup& setup,
                                                const LoadLimits& limits) {
  auto scene = load(gltf::GltfFile::open(path, limits), path.string(), setup, limits);
  if (scene) std::const_pointer_cast<Scene>(*scene)->path = path.string();
  return scene;
}

Result<std::shared_ptr<const Scene>> load_scene_from_memory(std::span<const std::uint8_t> bytes,
                                                            const std::string& name, const LightSetup& setup,
                                                            const LoadLimits& limits) {
  auto scene = load(gltf::GltfFile::view(bytes, limits), name, setup, limits);
  if (scene) std::const_pointer_cast<Scene>(*scene)->path = name;
  return scene;
}

}  // namespace darm::scene

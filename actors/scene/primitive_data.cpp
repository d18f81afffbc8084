#include "actors/scene/primitive_data.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>

namespace darm::scene {
namespace {

// Coordinates beyond this lose all sense in float (a squared length must stay finite).
constexpr float kMaxCoordinate = 1e15f;
// A triangle flatter than this fraction of its longest edge is below what float coordinates can express.
constexpr double kMinFlatness = 1e-9;

bool usable(const glm::vec3& p) {
  return std::abs(p.x) < kMaxCoordinate && std::abs(p.y) < kMaxCoordinate && std::abs(p.z) < kMaxCoordinate;
}

glm::dvec3 face_normal(const PrimitiveData& d, const glm::uvec3& t) {
  const glm::dvec3 a(d.positions[t.x]);
  return glm::cross(glm::dvec3(d.positions[t.y]) - a, glm::dvec3(d.positions[t.z]) - a);
}

bool has_area(const PrimitiveData& d, const glm::uvec3& t) {
  const glm::dvec3 a(d.positions[t.x]);
  const glm::dvec3 b(d.positions[t.y]);
  const glm::dvec3 c(d.positions[t.z]);
  const double longest = std::max({glm::dot(b - a, b - a), glm::dot(c - b, c - b), glm::dot(a - c, a - c)});
  return glm::length(face_normal(d, t)) > kMinFlatness * longest;
}

void drop_unusable(PrimitiveData& d, std::map<std::string, std::uint64_t>& dropped) {
  std::size_t kept = 0;
  for (const glm::uvec3& t : d.triangles) {
    if (!usable(d.positions[t.x]) || !usable(d.positions[t.y]) || !usable(d.positions[t.z])) {
      ++dropped["non-finite or huge vertex"];
    } else if (!has_area(d, t)) {
      ++dropped["zero area"];
    } else {
      d.triangles[kept++] = t;
    }
  }
  d.triangles.resize(kept);
}

template <class T>
void gather(std::vector<T>& values, const std::vector<std::uint32_t>& from) {
  if (values.empty()) return;
  std::vector<T> out;
  out.reserve(from.size());
  for (const std::uint32_t i : from) out.push_back(values[i]);
  values = std::move(out);
}

void gather_all(PrimitiveData& d, const std::vector<std::uint32_t>& from) {
  gather(d.positions, from);
  gather(d.normals, from);
  gather(d.tangents, from);
  gather(d.uvs[0], from);
  gather(d.uvs[1], from);
  gather(d.colors, from);
}

/// Removes vertices that no triangle uses; non-finite ones are among them.
void drop_unused_vertices(PrimitiveData& d) {
  constexpr std::uint32_t kUnused = 0xffffffffu;
  std::vector<std::uint32_t> to(d.positions.size(), kUnused);
  for (const glm::uvec3& t : d.triangles)
    for (int k = 0; k < 3; ++k) to[t[k]] = 0;
  std::vector<std::uint32_t> from;
  for (std::uint32_t i = 0; i < to.size(); ++i) {
    if (to[i] == kUnused) continue;
    to[i] = static_cast<std::uint32_t>(from.size());
    from.push_back(i);
  }
  if (from.size() == to.size()) return;
  gather_all(d, from);
  for (glm::uvec3& t : d.triangles) t = {to[t.x], to[t.y], to[t.z]};
}

/// glTF: without normals a primitive is shaded flat, so no two triangles may share a vertex.
void make_flat_normals(PrimitiveData& d) {
  std::vector<std::uint32_t> from;
  from.reserve(d.triangles.size() * 3);
  std::vector<glm::vec3> normals;
  normals.reserve(d.triangles.size() * 3);
  for (glm::uvec3& t : d.triangles) {
    const glm::vec3 n(glm::normalize(face_normal(d, t)));
    const auto first = static_cast<std::uint32_t>(from.size());
    from.insert(from.end(), {t.x, t.y, t.z});
    normals.insert(normals.end(), 3, n);
    t = {first, first + 1, first + 2};
  }
  gather_all(d, from);
  d.normals = std::move(normals);
}

/// Normals of the file to unit length; a missing one (zero or NaN) becomes the mean of its faces.
void repair_normals(PrimitiveData& d) {
  std::vector<std::uint32_t> broken;
  for (std::uint32_t i = 0; i < d.normals.size(); ++i) {
    const float length = glm::length(d.normals[i]);
    if (std::isfinite(length) && length > 1e-12f) {
      d.normals[i] /= length;
    } else {
      d.normals[i] = glm::vec3(0.0f);
      broken.push_back(i);
    }
  }
  if (broken.empty()) return;
  std::vector<glm::dvec3> sums(d.normals.size(), glm::dvec3(0.0));
  for (const glm::uvec3& t : d.triangles)
    for (int k = 0; k < 3; ++k) sums[t[k]] += face_normal(d, t);
  for (const std::uint32_t i : broken) {
    const double length = glm::length(sums[i]);
    d.normals[i] = length > 0.0 ? glm::vec3(sums[i] / length) : glm::vec3(0, 1, 0);
  }
}

glm::vec3 any_perpendicular(const glm::vec3& n) {
  const glm::vec3 axis = std::abs(n.x) < 0.6f ? glm::vec3(1, 0, 0) : glm::vec3(0, 1, 0);
  return glm::normalize(glm::cross(n, axis));
}

glm::vec3 orthonormal_tangent(const glm::vec3& normal, const glm::vec3& wish) {
  const glm::vec3 t = wish - normal * glm::dot(normal, wish);
  const float length = glm::length(t);
  return std::isfinite(length) && length > 1e-6f ? t / length : any_perpendicular(normal);
}

void repair_tangents(PrimitiveData& d) {
  for (std::size_t i = 0; i < d.tangents.size(); ++i) {
    const glm::vec4 t = d.tangents[i];
    d.tangents[i] = glm::vec4(orthonormal_tangent(d.normals[i], glm::vec3(t)), t.w < 0.0f ? -1.0f : 1.0f);
  }
}

/// Direction of growing u on a triangle, and whether its image is mirrored. v grows downwards in glTF's images, so an
/// image that reads right has a negative area in (u, v). Degenerate UVs: zero tangent.
struct FaceTangent {
  glm::vec3 tangent{0.0f};
  bool mirrored = false;
};

FaceTangent face_tangent(const PrimitiveData& d, const std::vector<glm::vec2>& uv, const glm::uvec3& t) {
  const glm::dvec3 e1 = glm::dvec3(d.positions[t.y]) - glm::dvec3(d.positions[t.x]);
  const glm::dvec3 e2 = glm::dvec3(d.positions[t.z]) - glm::dvec3(d.positions[t.x]);
  const glm::dvec2 s1 = glm::dvec2(uv[t.y]) - glm::dvec2(uv[t.x]);
  const glm::dvec2 s2 = glm::dvec2(uv[t.z]) - glm::dvec2(uv[t.x]);
  const double area = s1.x * s2.y - s2.x * s1.y;
  FaceTangent out;
  out.mirrored = area > 0.0;
  if (area == 0.0 || !std::isfinite(area)) return out;
  const glm::dvec3 direction = (e1 * s2.y - e2 * s1.y) * (area < 0.0 ? -1.0 : 1.0);
  const double length = glm::length(direction);
  if (std::isfinite(length) && length > 0.0) out.tangent = glm::vec3(direction / length);
  return out;
}

float angle_at(const PrimitiveData& d, const glm::uvec3& t, int corner) {
  const glm::vec3 p = d.positions[t[corner]];
  const glm::vec3 a = d.positions[t[(corner + 1) % 3]] - p;
  const glm::vec3 b = d.positions[t[(corner + 2) % 3]] - p;
  return std::atan2(glm::length(glm::cross(a, b)), glm::dot(a, b));
}

/// Per-vertex tangents: angle-weighted mean of the faces' u directions, in the manner of Mikkelsen's "Simulation of
/// Wrinkled Surfaces Revisited" (2008), section 5. A vertex between mirrored and unmirrored faces is split, for its
/// sign cannot be both.
void make_tangents(PrimitiveData& d, int uv_set) {
  if (d.uvs[static_cast<std::size_t>(uv_set)].empty()) {
    d.tangents.assign(d.positions.size(), glm::vec4(0, 0, 0, 1));
    repair_tangents(d);
    return;
  }
  std::vector<FaceTangent> faces;
  faces.reserve(d.triangles.size());
  for (const glm::uvec3& t : d.triangles) faces.push_back(face_tangent(d, d.uvs[static_cast<std::size_t>(uv_set)], t));

  constexpr std::uint8_t kPlain = 1;
  constexpr std::uint8_t kMirrored = 2;
  std::vector<std::uint8_t> sides(d.positions.size(), 0);
  for (std::size_t f = 0; f < faces.size(); ++f)
    for (int k = 0; k < 3; ++k) sides[d.triangles[f][k]] |= faces[f].mirrored ? kMirrored : kPlain;
  std::vector<std::uint32_t> from(d.positions.size());
  std::vector<std::uint32_t> mirrored_twin(d.positions.size());
  for (std::uint32_t i = 0; i < from.size(); ++i) from[i] = i;
  for (std::uint32_t i = 0; i < mirrored_twin.size(); ++i) {
    mirrored_twin[i] = i;
    if (sides[i] != (kPlain | kMirrored)) continue;
    mirrored_twin[i] = static_cast<std::uint32_t>(from.size());
    from.push_back(i);
  }
  gather_all(d, from);
  for (std::size_t f = 0; f < faces.size(); ++f)
    if (faces[f].mirrored)
      for (int k = 0; k < 3; ++k) d.triangles[f][k] = mirrored_twin[d.triangles[f][k]];

  d.tangents.assign(d.positions.size(), glm::vec4(0, 0, 0, 1));
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (int k = 0; k < 3; ++k) {
      const std::uint32_t v = d.triangles[f][k];
      const glm::vec3 n = d.normals[v];
      const glm::vec3 on_plane = faces[f].tangent - n * glm::dot(n, faces[f].tangent);
      d.tangents[v] += glm::vec4(on_plane * angle_at(d, d.triangles[f], k), 0.0f);
      // glTF: bitangent = cross(normal, tangent) * w points up in the image, against v.
      d.tangents[v].w = faces[f].mirrored ? -1.0f : 1.0f;
    }
  }
  repair_tangents(d);
}

void repair_uvs(std::vector<glm::vec2>& uvs) {
  for (glm::vec2& uv : uvs)
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) uv = glm::vec2(0.0f);
}

}  // namespace

Mesh make_mesh(PrimitiveData data, int tangent_uv_set, std::map<std::string, std::uint64_t>& dropped) {
  drop_unusable(data, dropped);
  drop_unused_vertices(data);
  repair_uvs(data.uvs[0]);
  repair_uvs(data.uvs[1]);
  for (glm::vec4& c : data.colors)
    for (int k = 0; k < 4; ++k) c[k] = c[k] >= 0.0f ? std::min(c[k], 1.0f) : (c[k] < 0.0f ? 0.0f : 1.0f);
  if (data.normals.empty()) {
    make_flat_normals(data);
    data.tangents.clear();  // glTF: tangents without normals are to be ignored
  } else {
    repair_normals(data);
  }
  if (tangent_uv_set < 0) {
    data.tangents.clear();
  } else if (data.tangents.empty()) {
    make_tangents(data, tangent_uv_set);
  } else {
    repair_tangents(data);
  }
  Mesh mesh;
  mesh.positions = std::move(data.positions);
  mesh.normals = std::move(data.normals);
  mesh.tangents = std::move(data.tangents);
  mesh.uvs = std::move(data.uvs);
  mesh.colors = std::move(data.colors);
  mesh.triangles = std::move(data.triangles);
  return mesh;
}

}  // namespace darm::scene

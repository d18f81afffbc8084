#include "actors/atlas/mesh_patches.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <glm/geometric.hpp>
#include <numeric>
#include <utility>

namespace darm::atlas {
namespace {

constexpr std::uint8_t kNoBin = 255;
constexpr std::uint32_t kUnset = 0xffffffffu;

/// Maps every vertex to the first vertex with the same position (open addressing over the bits).
std::vector<std::uint32_t> weld(const std::vector<glm::vec3>& positions) {
  const std::size_t slots = std::bit_ceil(positions.size() * 2 + 2);
  std::vector<std::uint32_t> table(slots, kUnset);
  std::vector<std::uint32_t> first(positions.size());
  for (std::uint32_t v = 0; v < positions.size(); ++v) {
    const glm::vec3 p = positions[v] + 0.0f;  // -0 becomes 0
    std::uint64_t h = std::bit_cast<std::uint32_t>(p.x) * 0x9e3779b97f4a7c15ull;
    h = (h ^ (h >> 29) ^ std::bit_cast<std::uint32_t>(p.y)) * 0xbf58476d1ce4e5b9ull;
    h = (h ^ (h >> 32) ^ std::bit_cast<std::uint32_t>(p.z)) * 0x94d049bb133111ebull;
    std::size_t slot = (h ^ (h >> 31)) & (slots - 1);
    while (table[slot] != kUnset && positions[table[slot]] != p) slot = (slot + 1) & (slots - 1);
    if (table[slot] == kUnset) table[slot] = v;
    first[v] = table[slot];
  }
  return first;
}

/// Between two bins the first takes a normal that is theirs within what corners of 32 bits can tell: rounded either
/// way, triangle by triangle, a roof at 45 degrees would fall into crumbs.
std::uint8_t bin_of(const glm::dvec3& n) {
  constexpr double kAlike = 1.0 - 1e-4;
  const glm::dvec3 a = glm::abs(n);
  const double least = std::max({a.x, a.y, a.z}) * kAlike;
  const int axis = a.x >= least ? 0 : a.y >= least ? 1 : 2;
  return static_cast<std::uint8_t>(axis * 2 + (n[axis] < 0 ? 1 : 0));
}

/// Bin of a triangle; kNoBin if it cannot be mapped, counted in `out`.
std::uint8_t classify(const scene::Mesh& mesh, const glm::dmat3& stretch, const glm::uvec3& t, MeshPatches& out) {
  const std::size_t n = mesh.positions.size();
  if (t.x >= n || t.y >= n || t.z >= n) return ++out.not_finite, kNoBin;
  const glm::dvec3 a = stretch * glm::dvec3(mesh.positions[t.x]);
  const glm::dvec3 e1 = stretch * glm::dvec3(mesh.positions[t.y]) - a;
  const glm::dvec3 e2 = stretch * glm::dvec3(mesh.positions[t.z]) - a;
  const glm::dvec3 normal = glm::cross(e1, e2);
  const double twice_area = glm::length(normal);
  if (!std::isfinite(twice_area)) return ++out.not_finite, kNoBin;
  const glm::dvec3 e3 = e2 - e1;
  const double longest = std::max({glm::dot(e1, e1), glm::dot(e2, e2), glm::dot(e3, e3)});
  // Below a millionth of its longest side a triangle's height is rounding noise of 32-bit positions.
  if (!(twice_area > 1e-6 * longest) || !(twice_area > 1e-24)) return ++out.zero_area, kNoBin;
  return bin_of(normal);
}

struct EdgeUse {
  std::uint64_t key;  // lower vertex, higher vertex
  std::uint32_t triangle;
  std::uint8_t bin;
  bool reversed;
  bool operator<(const EdgeUse& o) const {
    return key != o.key ? key < o.key : bin != o.bin ? bin < o.bin : triangle < o.triangle;
  }
};

class DisjointSets {
 public:
  explicit DisjointSets(std::size_t n) : parent_(n) { std::iota(parent_.begin(), parent_.end(), 0u); }
  std::uint32_t root(std::uint32_t i) {
    while (parent_[i] != i) i = parent_[i] = parent_[parent_[i]];
    return i;
  }
  void join(std::uint32_t a, std::uint32_t b) {
    a = root(a), b = root(b);
    parent_[std::max(a, b)] = std::min(a, b);  // the root is the first triangle: order does not depend on joins
  }

 private:
  std::vector<std::uint32_t> parent_;
};

void join_over_edges(const scene::Mesh& mesh, const std::vector<std::uint32_t>& welded,
                     const std::vector<std::uint8_t>& bins, DisjointSets& sets) {
  std::vector<EdgeUse> uses;
  uses.reserve(mesh.triangles.size() * 3);
  for (std::uint32_t t = 0; t < mesh.triangles.size(); ++t) {
    if (bins[t] == kNoBin) continue;
    for (int c = 0; c < 3; ++c) {
      const std::uint64_t a = welded[mesh.triangles[t][c]];
      const std::uint64_t b = welded[mesh.triangles[t][(c + 1) % 3]];
      uses.push_back({std::min(a, b) << 32 | std::max(a, b), t, bins[t], a > b});
    }
  }
  std::sort(uses.begin(), uses.end());
  for (std::size_t i = 0; i < uses.size();) {
    std::size_t end = i + 1;
    while (end < uses.size() && uses[end].key == uses[i].key && uses[end].bin == uses[i].bin) ++end;
    if (end - i == 2 && uses[i].reversed != uses[i + 1].reversed) sets.join(uses[i].triangle, uses[i + 1].triangle);
    i = end;
  }
}

}  // namespace

MeshPatches find_patches(const scene::Mesh& mesh, const glm::mat3& stretch) {
  MeshPatches out;
  const glm::dmat3 s(stretch);
  const auto count = static_cast<std::uint32_t>(mesh.triangles.size());
  std::vector<std::uint8_t> bins(count);
  for (std::uint32_t t = 0; t < count; ++t) bins[t] = classify(mesh, s, mesh.triangles[t], out);

  const auto welded = weld(mesh.positions);
  DisjointSets sets(count);
  join_over_edges(mesh, welded, bins, sets);

  std::vector<std::uint32_t> patch_of_root(count, kUnset);
  for (std::uint32_t t = 0; t < count; ++t) {
    if (bins[t] == kNoBin) continue;
    auto& id = patch_of_root[sets.root(t)];
    if (id == kUnset) {
      id = static_cast<std::uint32_t>(out.patches.size());
      out.patches.emplace_back();
      out.patches.back().bin_axis[bins[t] / 2] = bins[t] % 2 ? -1.0f : 1.0f;
    }
    out.patches[id].triangles.push_back(t);
  }
  std::vector<std::uint32_t> local(mesh.positions.size(), kUnset);
  std::vector<std::uint32_t> touched;
  for (auto& patch : out.patches) {
    glm::dvec3 origin{0.0};
    for (const auto t : patch.triangles) {
      auto& corners = patch.corners.emplace_back();
      for (int c = 0; c < 3; ++c) {
        const auto v = welded[mesh.triangles[t][c]];
        if (local[v] == kUnset) {
          const glm::dvec3 p = s * glm::dvec3(mesh.positions[v]);
          if (touched.empty()) origin = p;
          local[v] = static_cast<std::uint32_t>(touched.size());
          touched.push_back(v);
          patch.positions.push_back(p - origin);
        }
        corners[static_cast<std::size_t>(c)] = local[v];
      }
    }
    for (const auto v : touched) local[v] = kUnset;
    touched.clear();
  }
  return out;
}

}  // namespace darm::atlas

// Shapes that break parameterisations, and scenes at the ends of the scale, against areas and positions in double.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/gtc/quaternion.hpp>
#include <sstream>
#include <string>

#include "actors/atlas/flatten.hpp"
#include "actors/atlas/lscm.hpp"
#include "tests/numerical/closed_forms.hpp"
#include "tests/numerical/surface_checks.hpp"
#include "tests/unit/scene/small_glb.hpp"

namespace darm::numerical {
namespace {

using namespace atlas::testing;  // NOLINT(google-build-using-namespace): shapes
using atlas::build_layout;

/// A triangle as long as 1 and 1 / ratio high, anyhow in space.
void add_needle(scene::Mesh& mesh, double ratio, std::uint32_t number) {
  renderer::Sampler random(17, number, 0);
  const glm::vec2 xi = random.next_2d();
  const double z = 2 * static_cast<double>(xi.x) - 1, phi = 2 * M_PI * static_cast<double>(xi.y);
  const glm::dvec3 along(std::sqrt(1 - z * z) * std::cos(phi), std::sqrt(1 - z * z) * std::sin(phi), z);
  const glm::dvec3 across =
      glm::normalize(glm::cross(along, std::abs(z) < 0.9 ? glm::dvec3(0, 0, 1) : glm::dvec3(1, 0, 0)));
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  mesh.positions.insert(mesh.positions.end(),
                        {glm::vec3(0), glm::vec3(along), glm::vec3(along * 0.3 + across / ratio)});
  mesh.triangles.emplace_back(first, first + 1, first + 2);
}

TEST(Geometry, needles_are_placed_with_their_area_or_counted) {
  SurfaceChecks checks;
  for (const double ratio : {1.0, 1e2, 1e4, 1e5, 5e5, 1e6, 1e7}) {
    scene::Mesh mesh = box(glm::vec3(3), glm::vec3(4));
    for (std::uint32_t i = 0; i < 60; ++i) add_needle(mesh, ratio, i);
    checks.look("needles " + std::to_string(ratio), scene_of({mesh}), 64);
  }
}

TEST(Geometry, degenerate_duplicate_and_non_manifold_triangles_lose_nothing) {
  SurfaceChecks checks;
  scene::Mesh mesh = box(glm::vec3(3), glm::vec3(4));
  const auto first = static_cast<std::uint32_t>(mesh.positions.size());
  for (int i = 0; i < 9; ++i)  // nine leaves on one edge, all in one bin
    mesh.positions.push_back({0.3f, 1.0f, 0.1f * static_cast<float>(i) - 0.4f});
  mesh.positions.insert(mesh.positions.end(), {{0, 0, 0}, {0, 0, 1}, {0, 0, 0.5f}, {-0.0f, 0, 0}});
  for (std::uint32_t i = 0; i < 9; ++i) mesh.triangles.emplace_back(first + 9, first + 10, first + i);
  mesh.triangles.emplace_back(first + 9, first + 10, first);       // a duplicate
  mesh.triangles.emplace_back(first + 10, first + 9, first);       // its back
  mesh.triangles.emplace_back(first + 9, first + 10, first + 11);  // no area: in line
  mesh.triangles.emplace_back(first + 9, first + 12, first + 1);   // no area: 0 and -0
  mesh.triangles.emplace_back(first + 9, first + 9, first + 1);    // no area: a corner twice
  checks.look("leaves", scene_of({mesh}), 40);
  checks.look("soup", scene_of({triangle_soup(1, scaled(400))}), 40);
}

/// A strip round an axis whose winding number is not its number of turns: half a turn makes a Moebius strip.
scene::Mesh moebius(int n) {
  auto m = sheet(n, 2, [&](float u, float v) {
    const float a = 6.2831853f * u, w = 0.3f * (v - 0.5f);
    const float r = 1 + w * std::cos(a / 2);
    return glm::vec3(r * std::cos(a), w * std::sin(a / 2), r * std::sin(a));
  });
  for (auto& t : m.triangles)  // close it: the last column is the first, upside down
    for (int c = 0; c < 3; ++c) {
      const auto columns = static_cast<std::uint32_t>(n + 1);
      if (t[c] % columns == static_cast<std::uint32_t>(n)) t[c] = (2 - t[c] / columns) * columns;
    }
  return m;
}

TEST(Geometry, closed_ringed_coiled_and_overlapping_shapes_are_mapped_one_to_one) {
  SurfaceChecks checks;
  const int fine = kSanitized ? 8 : 24;
  checks.look("ball", scene_of({ball(2, fine, false, 0)}), 20);
  checks.look("annulus", scene_of({annulus(1, 1.2f, 3 * fine)}), 40);
  checks.look("thin annulus", scene_of({annulus(1, 1.001f, 8 * fine)}), 40);
  checks.look("helix", scene_of({helix(4, 0.02f)}), 20);
  checks.look("steep helix", scene_of({helix(4, 0.5f)}), 20);
  checks.look("scroll",
              scene_of({sheet(6 * fine, 3,
                              [](float u, float v) {
                                const float a = 40 * u, r = 0.2f + 0.02f * a;
                                return glm::vec3(r * std::cos(a), v, r * std::sin(a));
                              })}),
              40);
  checks.look("flat spiral over itself",
              scene_of({sheet(8 * fine, 2,
                              [](float u, float v) {
                                const float a = 15 * u, r = 1 + 0.3f * v + 0.01f * a;
                                return glm::vec3(r * std::cos(a), 0, -r * std::sin(a));
                              })}),
              40);
  checks.look("moebius strip", scene_of({moebius(3 * fine)}), 40);
  checks.look("torus",
              scene_of({sheet(2 * fine, fine,
                              [](float u, float v) {
                                const float a = 6.2831853f * (u < 1 ? u : 0), b = 6.2831853f * (v < 1 ? v : 0);
                                const float r = 2 + 0.7f * std::cos(b);
                                return glm::vec3(r * std::cos(a), 0.7f * std::sin(b), r * std::sin(a));
                              })}),
              20);
}

TEST(Geometry, one_triangle_and_a_hundred_thousand_in_one_patch) {
  SurfaceChecks checks;
  scene::Mesh one;
  one.positions = {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}};
  one.triangles = {{0, 1, 2}};
  checks.look("one", scene_of({one}), 64);
  const int side = kSanitized ? 50 : 224;
  const auto waves = scene_of({sheet(side, side, [](float u, float v) {
    return glm::vec3(10 * u, 0.3f * std::sin(9 * u) * std::cos(7 * v), -10 * v);
  })});
  EXPECT_EQ(build_layout(waves, {.q = 8}).value()->patch_count, 1u);
  checks.look("waves", waves, 32);
}

/// Ground so rough that its least-squares conformal map flips; its projection along y cannot. Steeper than any patch
/// that find_patches makes: those never flipped in thousands of trials.
atlas::RawPatch rough_ground(std::uint32_t seed, int n) {
  const auto m = sheet(n, n, [](float u, float v) { return glm::vec3(u, 0, -v); });
  atlas::RawPatch patch;
  patch.bin_axis = {0, 1, 0};
  for (std::uint32_t i = 0; i < m.positions.size(); ++i) {
    glm::dvec3 p(m.positions[i]);
    p.y = 8.0 / n * (static_cast<double>(independent_point(seed, i).x) - 0.5);
    patch.positions.push_back(p);
  }
  for (std::uint32_t t = 0; t < m.triangles.size(); ++t) {
    patch.triangles.push_back(t);
    patch.corners.push_back({m.triangles[t].x, m.triangles[t].y, m.triangles[t].z});
  }
  return patch;
}

/// Number of triangles strictly over a point.
int covers(const atlas::FlatPatch& piece, const glm::dvec2& p) {
  int n = 0;
  for (const auto& t : piece.uv) {
    bool inside = true;
    for (std::size_t i = 0; i < 3; ++i) {
      const glm::dvec2 e = t[(i + 1) % 3] - t[i], d = p - t[i];
      inside = inside && e.x * d.y - e.y * d.x > 1e-5 * glm::length(e) * piece.size.y;
    }
    n += inside ? 1 : 0;
  }
  return n;
}

TEST(Geometry, where_conformal_maps_flip_the_patch_is_flat_all_the_same) {
  Worst flipped("flips: triangles flipped after the way out", 0);
  Worst over("flips: points under more than one triangle of a piece", 0);
  Worst area("flips: flat area against area in space, relative", 1e-9);
  int flips = 0;
  for (std::uint32_t seed = 1; seed <= 40; ++seed) {
    const auto patch = rough_ground(seed, 8);
    const auto map = atlas::least_squares_conformal_map(patch.positions, patch.corners);
    ASSERT_TRUE(map);
    const auto twice_area = [](const glm::dvec2& a, const glm::dvec2& b, const glm::dvec2& c) {
      return (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    };
    flips += std::ranges::any_of(
        patch.corners, [&](const auto& c) { return twice_area((*map)[c[0]], (*map)[c[1]], (*map)[c[2]]) <= 0; });
    double space = 0, flat_area = 0;
    for (const auto& c : patch.corners)
      space += glm::length(
          glm::cross(patch.positions[c[1]] - patch.positions[c[0]], patch.positions[c[2]] - patch.positions[c[0]]));
    std::size_t placed = 0;
    for (const auto& piece : atlas::flatten(patch)) {
      placed += piece.triangles.size();
      for (const auto& t : piece.uv) {
        flat_area += twice_area(t[0], t[1], t[2]);
        flipped.see(twice_area(t[0], t[1], t[2]) > 0 ? 0 : 1, "seed", seed);
      }
      for (std::uint32_t i = 0; i < 200; ++i)
        over.see(std::max(0, covers(piece, glm::dvec2(independent_point(5, i)) * piece.size) - 1), "seed", seed);
    }
    EXPECT_EQ(placed, patch.triangles.size());
    area.see(std::abs(flat_area / space - 1), "seed", seed);
  }
  EXPECT_GT(flips, 20) << "no map flipped: the test looks at nothing";
}

// A plane whose normal lies between two or three bins stays one patch, however its corners are rounded.
TEST(Geometry, a_plane_on_a_bin_boundary_is_one_patch) {
  Worst patches("bin boundary: patches of one plane beyond the first", 0);
  SurfaceChecks checks;
  for (const glm::dvec3 n : {glm::dvec3(1, 1, 0), glm::dvec3(0, 1, 1), glm::dvec3(-1, 0, 1), glm::dvec3(1, 1, 1),
                             glm::dvec3(-1, 1, -1), glm::dvec3(-1, -1, -1)})
    for (const bool dyadic : {true, false}) {
      // Exact: the edges are whole numbers of 1/64. Rounded: unit vectors with a square root, and far from the origin.
      const glm::dvec3 x = n.x == 0 ? glm::dvec3(1, 0, 0) : n.y == 0 ? glm::dvec3(0, 1, 0) : glm::dvec3(n.y, -n.x, 0);
      const glm::dvec3 y = glm::cross(n, x);
      const double a = dyadic ? 1 / 64.0 : 0.1 / glm::length(x), b = dyadic ? 1 / 64.0 : 0.1 / glm::length(y);
      const glm::dvec3 at = dyadic ? glm::dvec3(0) : glm::dvec3(3.3, -7.1, 9.7);
      const int side = 30;
      auto mesh = sheet(side, side, [&](float u, float v) {
        return glm::vec3(at + x * (std::round(double{u} * side) * a) + y * (std::round(double{v} * side) * b));
      });
      const auto s = scene_of({mesh});
      patches.see(build_layout(s, {.q = 64}).value()->patch_count - 1.0, dyadic ? "exact" : "rounded", n.x, n.y, n.z);
      checks.look("boundary", s, 64);
    }
}

scene::Scene mixed_scene(float scale) {
  std::vector<scene::Mesh> meshes = {ball(1, 12, false, 0, {3, 0, 0}), helix(2, 0.1f), annulus(0.5f, 1, 24),
                                     triangle_soup(5, scaled(200)), box({-4, -1, -2}, {-3, 0.5f, 1})};
  for (auto& m : meshes)
    for (auto& p : m.positions) p *= scale;
  return scene_of(std::move(meshes));
}

// Powers of two change no rounding: the atlas must be the same to the last bit. Other scales: to rounding.
TEST(Geometry, a_scaled_scene_with_q_scaled_inversely_has_the_same_atlas) {
  Worst bits("scale 2^-13, 2^13: placements and corners that differ", 0);
  Worst off("scale 1e-4, 1e4: occupancy, area and number of patches, relative", 0.01);
  SurfaceChecks checks;
  const auto base = build_layout(mixed_scene(1), {.q = 32}).value();
  for (const int power : {-13, 13}) {
    const float scale = std::ldexp(1.0f, power);
    const auto made = build_layout(mixed_scene(scale), {.q = 32 / scale}).value();
    ASSERT_EQ(made->patch_count, base->patch_count);
    ASSERT_EQ(made->levels.size(), base->levels.size());
    for (std::size_t l = 0; l < base->levels.size(); ++l)
      for (std::size_t p = 0; p < base->patch_count; ++p) {
        const auto &a = base->levels[l].placements[p], &b = made->levels[l].placements[p];
        bits.see(a.x == b.x && a.y == b.y && a.scale == b.scale ? 0 : 1, "level", l, "patch", p);
      }
    for (std::size_t c = 0; c < base->charts.size(); ++c)
      for (std::size_t t = 0; t < base->charts[c].uv.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
          bits.see(base->charts[c].uv[t][k] * scale == made->charts[c].uv[t][k] ? 0 : 1, "chart", c, "triangle", t);
  }
  for (const float scale : {1e-4f, 1e4f}) {
    const auto s = mixed_scene(scale);
    const auto made = build_layout(s, {.q = 32 / scale}).value();
    const double area = double{scale} * scale;
    off.see(std::abs(made->surface_area / area / base->surface_area - 1), "area at", scale);
    off.see(std::abs(static_cast<double>(made->patch_count) / base->patch_count - 1), "patches at", scale);
    off.see(std::abs(made->levels[0].occupancy / base->levels[0].occupancy - 1), "occupancy at", scale);
    checks.look("scaled", s, 32 / scale);
  }
}

std::string node(const glm::dvec3& at, const glm::dquat& turn, double scale) {
  std::ostringstream text;
  text.precision(17);
  text << R"([{"children":[1],"translation":[)" << at.x << ',' << at.y << ',' << at.z << R"(],"rotation":[)" << turn.x
       << ',' << turn.y << ',' << turn.z << ',' << turn.w << R"(]},{"mesh":0,"translation":[0.25,0.5,0.125],"scale":[)"
       << scale << ',' << scale << ',' << scale << "]}]";
  return text.str();
}

// A scene that a node moves a million metres away: corners are as exact as at home, and the atlas is the same.
TEST(Geometry, a_scene_a_million_away_is_as_exact_as_at_home) {
  Worst off("moved to 1e6: corners against double, share of the scene's size", 3e-7);
  Worst bits("moved to 1e6: corners of the atlas that differ", 0);
  const auto shape = flat(ball(1, 8, false, 0));
  scene::test::SmallScene small;
  small.positions.clear();
  for (const auto& p : shape.positions) small.positions.insert(small.positions.end(), {p.x, p.y, p.z});
  const glm::dquat turn = glm::normalize(glm::dquat(0.8, 0.1, -0.5, 0.3));
  for (const double scale : {1e-4, 1.0, 1e4}) {
    const auto load = [&](const glm::dvec3& at) {
      small.nodes = node(at, turn, scale);
      return scene::test::load(small).value();
    };
    const auto home = load(glm::dvec3(0));
    const double q = 40 / scale;
    const auto atlas = build_layout(*home, {.q = static_cast<float>(q)}).value();
    for (const glm::dvec3 at : {glm::dvec3(1e6, 0, 0), glm::dvec3(-1e6, 1e6, 1e6 + 1.0 / 3)}) {
      const auto far = load(at);
      const auto& instance = far->instances.at(0);
      for (std::size_t i = 0; i < shape.positions.size(); ++i) {
        const auto& p = far->meshes[instance.mesh].positions[i];
        const glm::dvec3 got = glm::dvec3(glm::vec3(instance.to_world * glm::vec4(p, 1))) + far->origin;
        const glm::dvec3 local = glm::dvec3(shape.positions[i]) * scale + glm::dvec3(0.25, 0.5, 0.125);
        off.see(glm::length(got - (at + turn * local)) / std::max(scale, 1e-3), "scale", scale, "corner", i);
      }
      const auto moved = build_layout(*far, {.q = static_cast<float>(q)}).value();
      ASSERT_EQ(moved->charts.size(), atlas->charts.size());
      for (std::size_t t = 0; t < atlas->charts[0].uv.size(); ++t)
        for (std::size_t k = 0; k < 3; ++k)
          bits.see(atlas->charts[0].uv[t][k] == moved->charts[0].uv[t][k] ? 0 : 1, "scale", scale, "triangle", t);
    }
  }
}

}  // namespace
}  // namespace darm::numerical

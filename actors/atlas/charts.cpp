#include "actors/atlas/charts.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <mutex>

#include "actors/atlas/flatten.hpp"
#include "actors/atlas/mesh_patches.hpp"
#include "actors/atlas/parallel.hpp"

namespace darm::atlas {
namespace {

/// The symmetric factor S of M = R S: what the transform does to lengths. Rotations give the unit matrix exactly.
glm::mat3 stretch_of(const glm::mat4& to_world) {
  Eigen::Matrix3d m;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) m(r, c) = to_world[c][r];
  if (!m.allFinite()) return glm::mat3(0.0f);
  const Eigen::Matrix3d squared = m.transpose() * m;
  const double uniform = squared.trace() / 3;
  glm::mat3 out(0.0f);
  if ((squared - uniform * Eigen::Matrix3d::Identity()).norm() <= 1e-5 * uniform) {
    out = glm::mat3(static_cast<float>(std::sqrt(uniform)));
    return out;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(squared);
  const Eigen::Vector3d roots = eigen.eigenvalues().cwiseMax(0).cwiseSqrt();
  const Eigen::Matrix3d s = eigen.eigenvectors() * roots.asDiagonal() * eigen.eigenvectors().transpose();
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) out[c][r] = static_cast<float>(s(r, c));
  return out;
}

using StretchKey = std::array<std::int64_t, 8>;

StretchKey key_of(std::uint32_t mesh, const glm::mat3& s) {
  double norm = 0;
  for (int c = 0; c < 3; ++c)
    for (int r = 0; r < 3; ++r) norm = std::max(norm, std::abs(static_cast<double>(s[c][r])));
  const auto part = [&](int c, int r) {
    return norm > 0 ? static_cast<std::int64_t>(std::llround(s[c][r] / norm * 10000)) : 0;
  };
  const auto size = norm > 0 ? static_cast<std::int64_t>(std::llround(std::log2(norm) * 10000)) : -1;
  return {mesh, size, part(0, 0), part(1, 1), part(2, 2), part(1, 0), part(2, 0), part(2, 1)};
}

struct Job {
  std::size_t chart;
  std::size_t patch;
  std::size_t triangles;
};

/// Appends a flat patch to a chart.
void append(Chart& chart, const FlatPatch& flat) {
  for (std::size_t i = 0; i < flat.triangles.size(); ++i) {
    const auto t = flat.triangles[i];
    chart.local_patch[t] = chart.patch_count;
    for (std::size_t c = 0; c < 3; ++c) chart.uv[t][c] = glm::vec2(flat.uv[i][c]);
  }
  chart.patch_size.emplace_back(flat.size);
  chart.patch_area.push_back(static_cast<float>(flat.area));
  ++chart.patch_count;
}

/// One chart per distinct (mesh, stretch), in order of first use.
std::vector<glm::mat3> assign_charts(const scene::Scene& scene, Charts& out) {
  std::map<StretchKey, std::uint32_t> known;
  std::vector<glm::mat3> stretches;
  for (const auto& instance : scene.instances) {
    const auto s = stretch_of(instance.to_world);
    const auto [it, fresh] = known.emplace(key_of(instance.mesh, s), static_cast<std::uint32_t>(stretches.size()));
    if (fresh) {
      stretches.push_back(s);
      out.charts.emplace_back().mesh = instance.mesh;
    }
    out.instances.push_back({.chart = it->second, .front_base = 0});
  }
  return stretches;
}

Result<void> number_patches(const scene::Scene& scene, const std::vector<MeshPatches>& raw, Charts& out) {
  std::uint64_t next = 0, zero_area = 0, not_finite = 0;
  for (std::size_t i = 0; i < out.instances.size(); ++i) {
    auto& use = out.instances[i];
    const auto& chart = out.charts[use.chart];
    double area = 0;
    for (const auto a : chart.patch_area) area += a;
    use.front_base = static_cast<std::uint32_t>(next);
    next += chart.patch_count;
    if (scene.materials[scene.meshes[chart.mesh].material].double_sided) {
      use.back_base = static_cast<std::uint32_t>(next);
      next += chart.patch_count;
      area *= 2;
    }
    out.surface_area += area;
    zero_area += raw[use.chart].zero_area;
    not_finite += raw[use.chart].not_finite;
    if (next >= index_of(kNoPatch)) return fail(scene.path + ": too many patches; join meshes or use fewer instances");
  }
  out.patch_count = static_cast<std::uint32_t>(next);
  if (zero_area > 0) out.dropped.push_back({"zero area", zero_area});
  if (not_finite > 0) out.dropped.push_back({"not finite", not_finite});
  return {};
}

}  // namespace

Result<Charts> build_charts(const scene::Scene& scene, unsigned threads, const Progress& progress) {
  for (const auto& i : scene.instances)
    if (i.mesh >= scene.meshes.size() || scene.meshes[i.mesh].material >= scene.materials.size())
      return fail(scene.path + ": an instance names a mesh or material that is not there");
  Charts out;
  const auto stretches = assign_charts(scene, out);
  std::vector<MeshPatches> raw(out.charts.size());
  parallel_for(raw.size(), threads,
               [&](std::size_t c) { raw[c] = find_patches(scene.meshes[out.charts[c].mesh], stretches[c]); });

  std::vector<Job> jobs;
  for (std::size_t c = 0; c < raw.size(); ++c)
    for (std::size_t p = 0; p < raw[c].patches.size(); ++p) jobs.push_back({c, p, raw[c].patches[p].triangles.size()});
  std::vector<std::vector<std::vector<FlatPatch>>> flat(raw.size());
  for (std::size_t c = 0; c < raw.size(); ++c) flat[c].resize(raw[c].patches.size());
  // The longest jobs first, so that no thread is left alone with one at the end.
  std::stable_sort(jobs.begin(), jobs.end(), [](const Job& a, const Job& b) { return a.triangles > b.triangles; });
  std::mutex reporting;
  std::size_t done = 0;
  constexpr std::size_t kBatch = 64;
  const std::size_t big = std::min<std::size_t>(jobs.size(), 256);  // one at a time, the rest in batches
  const std::size_t steps = big + (jobs.size() - big + kBatch - 1) / kBatch;
  parallel_for(steps, threads, [&](std::size_t s) {
    const std::size_t begin = s < big ? s : big + (s - big) * kBatch;
    const std::size_t end = s < big ? s + 1 : std::min(jobs.size(), begin + kBatch);
    for (std::size_t j = begin; j < end; ++j)
      flat[jobs[j].chart][jobs[j].patch] = flatten(raw[jobs[j].chart].patches[jobs[j].patch]);
    if (!progress) return;
    const std::lock_guard lock(reporting);
    done += end - begin;
    progress("parameterise", static_cast<float>(done) / static_cast<float>(jobs.size()));
  });

  for (std::size_t c = 0; c < out.charts.size(); ++c) {
    auto& chart = out.charts[c];
    const auto triangles = scene.meshes[chart.mesh].triangles.size();
    chart.local_patch.assign(triangles, kDroppedTriangle);
    chart.uv.assign(triangles, {});
    for (const auto& pieces : flat[c])
      for (const auto& piece : pieces) append(chart, piece);
  }
  if (auto numbered = number_patches(scene, raw, out); !numbered) return std::unexpected(numbered.error());
  return out;
}

}  // namespace darm::atlas

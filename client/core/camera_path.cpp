#include "client/core/camera_path.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <system_error>

// toml++ 3.3 takes some malformed keys as failed assertions, and in release builds as undefined behaviour (found by
// fuzzing). Here they are errors like any other.
#undef NDEBUG
namespace {
[[noreturn]] void malformed_toml() { throw std::runtime_error("malformed"); }
}  // namespace
#define TOML_ASSERT(condition) (static_cast<bool>(condition) ? static_cast<void>(0) : malformed_toml())
#include <toml++/toml.h>

namespace darm::client {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 16u << 20;
constexpr std::size_t kMaxKeys = 100000;

constexpr double kFarthest = 1e7;  // metres, as darmd has it
constexpr const char* kBounds =
    "position and target must be finite, within 1e7 and apart, the field of view 0.1 to 179";

bool near(const glm::dvec3& v) {  // false for NaN
  return std::abs(v.x) <= kFarthest && std::abs(v.y) <= kFarthest && std::abs(v.z) <= kFarthest;
}

bool valid(const CameraKey& k) {
  return std::isfinite(k.t) && near(k.position) && near(k.target) && k.position != k.target && k.fovy >= 0.1 &&
         k.fovy <= 179;
}

// A number as it is written, be it of use or not: nan, inf, and infinity for what no double holds.
bool take_number(std::string_view& text, double& out) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), out);
  if (error == std::errc::invalid_argument) return false;
  if (error == std::errc::result_out_of_range) out = INFINITY;
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return true;
}

bool take(std::string_view& text, char c) {
  if (text.empty() || text.front() != c) return false;
  text.remove_prefix(1);
  return true;
}

std::optional<glm::dvec3> parse_vec(std::string_view text) {
  glm::dvec3 v;
  const bool ok = take_number(text, v.x) && take(text, ',') && take_number(text, v.y) && take(text, ',') &&
                  take_number(text, v.z) && text.empty();
  return ok ? std::optional(v) : std::nullopt;
}

// The camera that numbers give, valid or not; nothing if `spec` is no such list of numbers.
std::optional<CameraKey> parse_spec(const std::string& spec) {
  std::istringstream in(spec);
  std::string position, target, fovy, rest;
  if (!(in >> position >> target >> fovy) || (in >> rest)) return std::nullopt;
  CameraKey key;
  std::string_view angle = fovy;
  const auto p = parse_vec(position), t = parse_vec(target);
  if (!p || !t || !take_number(angle, key.fovy) || !angle.empty()) return std::nullopt;
  key.position = *p;
  key.target = *t;
  return key;
}

std::optional<glm::dvec3> toml_vec(const toml::table& table, const char* name) {
  const auto* array = table[name].as_array();
  if (array == nullptr || array->size() != 3) return std::nullopt;
  std::array<double, 3> v{};
  for (std::size_t i = 0; i < 3; ++i) {
    const auto n = (*array)[i].value<double>();
    if (!n) return std::nullopt;
    v[i] = *n;
  }
  return glm::dvec3(v[0], v[1], v[2]);
}

struct NamedCamera {
  std::string name;
  CameraKey key;
};

Result<toml::table> read_toml(const std::filesystem::path& setup) {
  std::error_code code;
  if (const auto size = std::filesystem::file_size(setup, code); !code && size > kMaxFileBytes)
    return fail(setup.string() + ": is too large for a set-up");
  try {  // toml++ reports faults of the file by exception
    return toml::parse_file(setup.string());
  } catch (const toml::parse_error& e) {
    return fail(setup.string() + ": " + std::string(e.description()));
  } catch (const std::runtime_error& e) {
    return fail(setup.string() + ": " + e.what());
  }
}

Result<NamedCamera> camera_of(const toml::table& entry, const std::string& where) {
  NamedCamera camera;
  camera.name = entry["name"].value_or(std::string());
  const auto position = toml_vec(entry, "position"), target = toml_vec(entry, "target");
  if (!position || !target) return fail(where + ": camera " + camera.name + " needs position and target");
  camera.key = {0, *position, *target, entry["fovy"].value_or(60.0)};
  if (!valid(camera.key)) return fail(where + ": camera " + camera.name + ": " + kBounds);
  return camera;
}

Result<std::vector<CameraKey>> read_list(const std::filesystem::path& setup, const char* list) {
  const auto table = read_toml(setup);
  if (!table) return std::unexpected(table.error());
  std::vector<CameraKey> keys;
  if (const auto* entries = (*table)[list].as_array()) {
    for (const auto& node : *entries) {
      if (node.as_table() == nullptr) continue;
      const auto camera = camera_of(*node.as_table(), setup.string());
      if (!camera) return std::unexpected(camera.error());
      keys.push_back(camera->key);
    }
  }
  if (keys.empty()) return fail(setup.string() + ": has no [[" + list + "]]");
  return keys;
}

}  // namespace

Result<CameraKey> read_camera(const std::string& spec, const std::filesystem::path& setup) {
  if (const auto key = parse_spec(spec)) {
    if (!valid(*key)) return fail("--camera " + spec + ": " + kBounds);
    return *key;
  }
  if (setup.empty())
    return fail("--camera " + spec + ": expected \"px,py,pz tx,ty,tz fovy\", or a name together with --setup FILE");
  const auto table = read_toml(setup);
  if (!table) return std::unexpected(table.error());
  std::string known;
  for (const char* list : {"cameras", "load_cameras"}) {
    const auto* cameras = (*table)[list].as_array();
    if (cameras == nullptr) continue;
    for (const auto& node : *cameras) {
      const auto* entry = node.as_table();
      if (entry == nullptr) continue;
      const std::string name = (*entry)["name"].value_or(std::string());
      known += (known.empty() ? "" : ", ") + name;
      if (name != spec) continue;
      const auto camera = camera_of(*entry, setup.string());
      if (!camera) return std::unexpected(camera.error());
      return camera->key;
    }
  }
  return fail(setup.string() + ": no camera " + spec + " (there are: " + known + ")");
}

Result<std::vector<CameraKey>> read_load_groups(const std::filesystem::path& setup) {
  return read_list(setup, "load_groups");
}

Result<std::vector<CameraKey>> read_load_cameras(const std::filesystem::path& setup) {
  return read_list(setup, "load_cameras");
}

Result<std::vector<CameraKey>> read_walkthrough(const std::filesystem::path& file) {
  std::error_code code;
  const auto size = std::filesystem::file_size(file, code);
  if (code) return fail(file.string() + ": " + code.message());
  if (size > kMaxFileBytes) return fail(file.string() + ": is too large for a walkthrough");
  std::ifstream in(file);
  const auto json = nlohmann::json::parse(in, nullptr, false);
  if (!json.is_array() || json.size() < 2 || json.size() > kMaxKeys)
    return fail(file.string() + ": expected a JSON list of at least two cameras");
  std::vector<CameraKey> path;
  for (const auto& entry : json) {
    const auto vec = [&](const char* name) -> std::optional<glm::dvec3> {
      if (!entry.is_object() || !entry.contains(name)) return std::nullopt;
      const auto& a = entry[name];
      if (!a.is_array() || a.size() != 3 ||
          !std::all_of(a.begin(), a.end(), [](const auto& n) { return n.is_number(); }))
        return std::nullopt;
      return glm::dvec3(a[0].template get<double>(), a[1].template get<double>(), a[2].template get<double>());
    };
    const auto number = [&](const char* name) {
      return entry.is_object() && entry.contains(name) && entry[name].is_number() ? entry[name].template get<double>()
                                                                                  : NAN;
    };
    const auto position = vec("position"), target = vec("target");
    const CameraKey key{number("t"), position.value_or(glm::dvec3(NAN)), target.value_or(glm::dvec3(NAN)),
                        number("fovy")};
    if (!valid(key) || (!path.empty() && key.t <= path.back().t)) {
      return fail(fmt::format("{}: entry {} needs a rising t, position, target and fovy", file.string(), path.size()));
    }
    path.push_back(key);
  }
  return path;
}

CameraKey camera_at(const std::vector<CameraKey>& path, double t) {
  if (t <= path.front().t) return path.front();
  if (t >= path.back().t) return path.back();
  const auto upper =
      std::upper_bound(path.begin(), path.end(), t, [](double value, const CameraKey& k) { return value < k.t; });
  const auto i = static_cast<std::size_t>(upper - path.begin()) - 1;
  const CameraKey &a = path[i], &b = path[i + 1];
  const CameraKey &before = path[i > 0 ? i - 1 : 0], &after = path[std::min(i + 2, path.size() - 1)];
  const double span = b.t - a.t, s = (t - a.t) / span;
  const double h00 = (1 + 2 * s) * (1 - s) * (1 - s), h10 = s * (1 - s) * (1 - s), h01 = s * s * (3 - 2 * s),
               h11 = s * s * (s - 1);
  const double scale_a = span / std::max(b.t - before.t, 1e-9), scale_b = span / std::max(after.t - a.t, 1e-9);
  const auto curve = [&](const auto& pa, const auto& pb, const auto& p0, const auto& p3) {
    return pa * h00 + (pb - p0) * (scale_a * h10) + pb * h01 + (p3 - pa) * (scale_b * h11);
  };
  return {t, curve(a.position, b.position, before.position, after.position),
          curve(a.target, b.target, before.target, after.target),
          std::clamp(curve(a.fovy, b.fovy, before.fovy, after.fovy), 0.1, 179.0)};
}

View to_view(const CameraKey& key, std::uint32_t width, std::uint32_t height) {
  return look_at(key.position, key.target, key.fovy, width, height);
}

}  // namespace darm::client

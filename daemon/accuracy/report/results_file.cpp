#include "daemon/accuracy/report/results_file.hpp"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <system_error>

namespace darm::accuracy {
namespace {

using nlohmann::json;

constexpr std::size_t kMostLineBytes = 1u << 20;
constexpr std::uintmax_t kMostFileBytes = 64u << 20;
constexpr std::size_t kMostNameBytes = 256;
constexpr std::size_t kMostPoints = 10'000;
constexpr std::size_t kMostFigures = 64;
constexpr double kMostNumber = 1e15;

std::optional<double> number(const json& value) {
  if (!value.is_number()) return std::nullopt;
  const double x = value.get<double>();
  if (!std::isfinite(x) || std::abs(x) > kMostNumber) return std::nullopt;
  return x;
}

std::optional<std::string> name(const json& object, const char* key) {
  const auto it = object.find(key);
  if (it == object.end() || !it->is_string()) return std::nullopt;
  const auto& text = it->get_ref<const std::string&>();
  if (text.empty() || text.size() > kMostNameBytes) return std::nullopt;
  return text;
}

Result<std::vector<Point>> read_curve(const json& list) {
  if (!list.is_array() || list.size() > kMostPoints) return fail("result: its curve is not a list of points");
  std::vector<Point> curve;
  curve.reserve(list.size());
  for (const auto& entry : list) {
    if (!entry.is_array() || entry.size() != 3) return fail("result: a point is not three numbers");
    const auto seconds = number(entry[0]), db = number(entry[1]), samples = number(entry[2]);
    if (!seconds || !db || !samples || *seconds < 0) return fail("result: a point is not three numbers");
    if (!curve.empty() && *seconds <= curve.back().seconds) return fail("result: its times do not increase");
    curve.push_back({*seconds, *db, *samples});
  }
  return curve;
}

bool is_key(const std::string& text) {
  return text.size() == 16 &&
         std::all_of(text.begin(), text.end(), [](char c) { return (c >= '0' && c <= '9') || (c >= 'a' && c <= 'f'); });
}

}  // namespace

std::string to_line(const Measurement& m) {
  json curve = json::array();
  for (const auto& p : m.curve) curve.push_back({p.seconds, p.db, p.samples});
  const json line = {{"key", m.key},         {"camera", m.camera}, {"group", name_of(m.group)},
                     {"variant", m.variant}, {"curve", curve},     {"figures", m.figures}};
  return line.dump(-1, ' ', false, json::error_handler_t::replace);
}

Result<Measurement> parse_line(std::string_view line) {
  if (line.size() > kMostLineBytes) return fail("result: the line is over 1 MiB");
  // Depth is judged before a tree is built: what we write is three deep.
  const auto shallow = [](int depth, json::parse_event_t, json&) { return depth <= 8; };
  const json object = json::parse(line, shallow, /*allow_exceptions=*/false);
  if (object.is_discarded() || !object.is_object()) return fail("result: is not a JSON object");
  Measurement m;
  const auto key = name(object, "key"), camera = name(object, "camera"), group = name(object, "group"),
             variant = name(object, "variant");
  if (!key || !is_key(*key) || !camera || !group || !variant) return fail("result: key, camera, group or variant");
  const auto known = group_of(*group);
  if (!known) return fail("result: an unknown group");
  m.key = *key;
  m.camera = *camera;
  m.group = *known;
  m.variant = *variant;
  const auto curve = object.find("curve");
  if (curve == object.end()) return fail("result: its curve is missing");
  auto points = read_curve(*curve);
  if (!points) return std::unexpected(points.error());
  m.curve = std::move(*points);
  const auto figures = object.find("figures");
  if (figures == object.end() || !(figures->is_object() || figures->is_null()) || figures->size() > kMostFigures)
    return fail("result: its figures are not an object");
  for (const auto& [what, value] : figures->items()) {
    const auto x = number(value);
    if (!x || what.size() > kMostNameBytes) return fail("result: a figure is not a number");
    m.figures[what] = *x;
  }
  return m;
}

std::vector<Measurement> parse_results(std::string_view text) {
  std::vector<Measurement> out;
  std::map<std::string, std::size_t> place;
  while (!text.empty()) {
    const auto end = text.find('\n');
    const auto line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    auto made = parse_line(line);
    if (!made) continue;
    const auto [it, fresh] = place.try_emplace(made->key, out.size());
    if (fresh)
      out.push_back(std::move(*made));
    else
      out[it->second] = std::move(*made);
  }
  return out;
}

Result<std::vector<Measurement>> load_results(const std::filesystem::path& file) {
  std::error_code error;
  if (!std::filesystem::exists(file, error)) return std::vector<Measurement>();
  if (!std::filesystem::is_regular_file(file, error)) return fail(file.string() + ": is not a file");
  const auto size = std::filesystem::file_size(file, error);
  if (error || size > kMostFileBytes) return fail(file.string() + ": is over 64 MiB; it is no file of results");
  std::ifstream in(file, std::ios::binary);
  std::string text(static_cast<std::size_t>(size), '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in && size > 0) return fail(file.string() + ": cannot be read: is it ours to read?");
  return parse_results(text);
}

Result<void> append_result(const std::filesystem::path& file, const Measurement& measurement) {
  // A line that was cut off must not swallow this one.
  bool whole = true;
  if (std::ifstream in(file, std::ios::binary | std::ios::ate); in && in.tellg() > 0) {
    in.seekg(-1, std::ios::end);
    whole = in.get() == '\n';
  }
  std::ofstream out(file, std::ios::binary | std::ios::app);
  if (!whole) out << '\n';
  out << to_line(measurement) << '\n';
  out.close();
  if (!out) return fail(file.string() + ": cannot be written; check the folder and the free space");
  return {};
}

}  // namespace darm::accuracy

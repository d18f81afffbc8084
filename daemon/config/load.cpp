#include "daemon/config/load.hpp"

#include <arpa/inet.h>
#include <fmt/format.h>

#include <fstream>
#include <iterator>
#include <map>
#include <set>

#include "daemon/config/table_reader.hpp"
#include "daemon/config/toml_value.hpp"

namespace darm::config {
namespace {

constexpr std::uintmax_t kMaxFileBytes = 1u << 20;
constexpr const char* kSum = "config";    // faults of the files taken together
constexpr std::size_t kMaxListed = 4096;  // lights, cameras
constexpr double kMaxCoordinate = 1e7;    // metres
constexpr double kMaxLight = 1e12;        // lux, nits, candela
constexpr std::int64_t kMaxBytes = std::int64_t{1} << 50;

// A path that is relative to the file it is written in.
void read_path(TableReader& reader, std::string_view key, std::filesystem::path& out,
               const std::filesystem::path& file) {
  std::string text;
  if (!reader.text(key, text, 4096)) return;
  if (text.empty()) return reader.fault(key, "is empty; leave the key out where there is no file");
  const std::filesystem::path path(text);
  out = path.is_absolute() ? path : (file.parent_path() / path).lexically_normal();
}

void read_light(TableReader& reader, LightConfig& light) {
  std::string kind = "point";
  reader.choice("kind", kind, {"point", "spot"});
  light.kind = kind == "spot" ? LightKind::kSpot : LightKind::kPoint;
  reader.vector3("position", light.position, -kMaxCoordinate, kMaxCoordinate);
  reader.rgb("intensity", light.intensity, 0, kMaxLight);
  reader.direction("direction", light.direction);
  reader.number("cone", light.cone_degrees, 0.01, 90);
  reader.number("inner_cone", light.inner_cone_degrees, 0, 90);
  reader.require({"kind", "position", "intensity"});
  if (light.kind == LightKind::kSpot) {
    reader.require({"direction"});
    if (light.inner_cone_degrees >= light.cone_degrees)
      reader.fault("inner_cone",
                   fmt::format("{} is not below cone = {}", light.inner_cone_degrees, light.cone_degrees));
  }
}

void read_pose(TableReader& reader, Pose& pose, bool named) {
  reader.text("name", pose.name, 100);
  reader.vector3("position", pose.position, -kMaxCoordinate, kMaxCoordinate);
  reader.vector3("target", pose.target, -kMaxCoordinate, kMaxCoordinate);
  reader.number("fovy", pose.fovy_degrees, 1, 179);
  reader.require({"position", "target"});
  if (pose.position == pose.target) reader.fault("target", "is the position: the camera looks at where it stands");
  if (named) reader.require({"name"});
}

void read_poses(TableReader& root, std::string_view key, std::vector<Pose>& out, bool named) {
  root.tables(
      key, kMaxListed, [&out] { out.clear(); },
      [&out, named](TableReader& reader) { read_pose(reader, out.emplace_back(), named); });
}

void read_picture(TableReader& root, Config& config, const std::filesystem::path& file) {
  read_path(root, "walkthrough", config.walkthrough, file);
  root.table("scene", [&](TableReader& reader) {
    read_path(reader, "file", config.scene.file, file);
    reader.number_or_auto("q", config.scene.q, 0.001, 65536);
    reader.number_or_auto("exposure", config.scene.exposure, 1e-12, 1e12);
  });
  root.table("sun", [&](TableReader& reader) {
    if (!config.sun) config.sun.emplace();
    reader.direction("direction", config.sun->direction);
    reader.rgb("irradiance", config.sun->irradiance, 0, kMaxLight);
    reader.number("angular_diameter", config.sun->angular_diameter_degrees, 0, 90);
  });
  root.table("sky", [&](TableReader& reader) {
    if (!config.sky) config.sky.emplace();
    reader.rgb("zenith", config.sky->zenith, 0, kMaxLight);
    reader.rgb("horizon", config.sky->horizon, 0, kMaxLight);
    reader.rgb("ground", config.sky->ground, 0, kMaxLight);
  });
  root.tables(
      "lights", kMaxListed, [&] { config.lights.clear(); },
      [&](TableReader& reader) { read_light(reader, config.lights.emplace_back()); });
  read_poses(root, "cameras", config.cameras, true);
  read_poses(root, "load_cameras", config.load_cameras, false);
  read_poses(root, "load_groups", config.load_groups, true);
}

void read_work(TableReader& root, Config& config) {
  root.table("atlas", [&](TableReader& reader) {
    reader.integer("max_texels", config.atlas.max_texels, 1 << 16, std::int64_t{1} << 38);
  });
  root.table("render", [&](TableReader& reader) {
    reader.integer("threads", config.render.threads, 0, 1024);
    reader.integer("max_samples", config.render.max_samples, 1, 1 << 22);
    reader.number("slice_ms", config.render.slice_ms, 0.1, 100);
  });
  root.table("accuracy", [&](TableReader& reader) {
    auto& accuracy = config.accuracy;
    std::string preset = accuracy.preset;
    reader.choice("preset", preset, {"preview", "balanced", "reference"});
    if (preset != accuracy.preset) accuracy = preset_of(preset);
    reader.number("target", accuracy.target, 0.0001, 1);
    reader.choice("indirect", accuracy.indirect, {"stored", "traced"});
    reader.number("client_target_min", accuracy.client_target_min, 0.0001, 1);
    reader.integer("filter_samples", accuracy.filter_samples, 0, 4096);
  });
  root.table("stream", [&](TableReader& reader) {
    reader.number("updates_per_second", config.stream.updates_per_second, 0.1, 120);
    reader.one_of("phystex", config.stream.phystex, {1024, 2048, 4096});
    reader.one_of("view_phystex", config.stream.view_phystex, {0, 512, 1024});
    reader.integer("max_writes", config.stream.max_writes, 1, 16384);
    reader.integer("crf", config.stream.crf, 0, 51);
    reader.integer("crf_finest", config.stream.crf_finest, 0, 51);
    reader.choice("preset", config.stream.preset,
                  {"ultrafast", "superfast", "veryfast", "faster", "fast", "medium", "slow", "slower", "veryslow"});
    reader.boolean("share", config.stream.share);
    reader.boolean("chroma_444", config.stream.chroma_444);
    reader.boolean("allow_lossless", config.stream.allow_lossless);
  });
}

void read_web(TableReader& root, Config& config, const std::filesystem::path& file) {
  root.table("web", [&](TableReader& reader) { reader.texts("origins", config.web.origins, kMaxListed, 300); });
  root.table("tls", [&](TableReader& reader) {
    reader.boolean("enabled", config.tls.enabled);
    read_path(reader, "certificate", config.tls.certificate, file);
    read_path(reader, "key", config.tls.key, file);
    reader.texts("names", config.tls.names, 100, 253);
  });
}

void read_service(TableReader& root, Config& config) {
  root.table("session", [&](TableReader& reader) {
    reader.integer("max_sessions", config.session.max_sessions, 1, 100000);
    reader.integer("max_sessions_per_address", config.session.max_sessions_per_address, 1, 100000);
    reader.integer("max_memory_bytes", config.session.max_memory_bytes, 16 << 20, kMaxBytes);
    reader.number("handshake_timeout_s", config.session.handshake_timeout_s, 0.1, 3600);
    reader.number("idle_timeout_s", config.session.idle_timeout_s, 1, 86400);
    reader.integer("send_queue_bytes", config.session.send_queue_bytes, 1 << 20, kMaxBytes);
    reader.number("send_queue_seconds", config.session.send_queue_seconds, 0.5, 3600);
  });
  root.table("listen", [&](TableReader& reader) {
    reader.text("address", config.listen.address, 255);
    reader.integer("tcp_port", config.listen.tcp_port, 0, 65535);
    reader.integer("udp_port", config.listen.udp_port, 0, 65535);
    reader.integer("http_port", config.listen.http_port, -1, 65535);
    reader.integer("metrics_port", config.listen.metrics_port, -1, 65535);
  });
  root.table("state", [&](TableReader& reader) {
    std::string dir = config.state.dir.string();
    reader.text("dir", dir, 4096);
    config.state.dir = dir;
    reader.integer("max_store_bytes", config.state.max_store_bytes, 1 << 20, kMaxBytes);
  });
  root.table("log", [&](TableReader& reader) {
    reader.choice("level", config.log.level, {"trace", "debug", "info", "warn", "error"});
    reader.boolean("json", config.log.json);
  });
}

void read_root(ReadReport& report, const TomlTable* table, const std::filesystem::path& file, Config& config) {
  TableReader root(report, table, 0, "");
  read_picture(root, config, file);
  read_work(root, config);
  read_service(root, config);
  read_web(root, config, file);
  root.finish();
}

void apply(std::string_view toml, const std::filesystem::path& file, Config& config, std::vector<Fault>& faults) {
  const auto parsed = parse_toml(toml);
  if (!parsed) {
    faults.push_back({file.string(), parsed.error().line, "", "not TOML: " + parsed.error().text});
    return;
  }
  ReadReport report{file.string(), &faults, nullptr};
  read_root(report, parsed->table(), file, config);
}

std::expected<std::string, std::string> read_file(const std::filesystem::path& file) {
  std::error_code error;
  const auto status = std::filesystem::status(file, error);
  if (std::filesystem::is_directory(status)) return std::unexpected("is a directory; name the TOML file in it");
  if (error || !std::filesystem::is_regular_file(status)) return std::unexpected("cannot be read: no such file");
  const auto size = std::filesystem::file_size(file, error);
  if (error) return std::unexpected("cannot be read: " + error.message());
  if (size > kMaxFileBytes) return std::unexpected("is over 1 MiB; a config file is not that long");
  std::ifstream in(file, std::ios::binary);
  std::string text(static_cast<std::size_t>(size), '\0');
  in.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (!in && size > 0) return std::unexpected("cannot be read: is it ours to read?");
  return text;
}

Loaded checked(Config config, std::vector<Fault> faults) {
  if (faults.empty()) faults = check(config);
  if (!faults.empty()) return std::unexpected(std::move(faults));
  return config;
}

// As the listeners read it: numbers alone, since a name may stand for several addresses, or for none tomorrow.
bool is_address(const std::string& text) {
  in6_addr any{};
  const auto scope = text.find('%');  // fe80::1%eth0
  return inet_pton(AF_INET, text.c_str(), &any) == 1 || inet_pton(AF_INET6, text.substr(0, scope).c_str(), &any) == 1;
}

void check_address(const std::string& address, std::vector<Fault>& faults) {
  if (address.empty())
    faults.push_back({kSum, 0, "listen.address", "must not be empty; 0.0.0.0 is every address of this machine"});
  else if (!is_address(address))
    faults.push_back(
        {kSum, 0, "listen.address",
         fmt::format("\"{}\" is not an IP address; 0.0.0.0 is every address of this machine", printable(address))});
}

void check_names(const std::vector<Pose>& poses, const std::string& list, std::vector<Fault>& faults) {
  std::set<std::string> seen;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const std::string key = fmt::format("{}[{}].name", list, i);
    if (poses[i].name.empty()) faults.push_back({kSum, 0, key, "must not be empty"});
    if (!seen.insert(poses[i].name).second)
      faults.push_back({kSum, 0, key, fmt::format("\"{}\" is used twice; names must differ", poses[i].name)});
  }
}

}  // namespace

std::string Fault::to_string() const {
  std::string where = line > 0 ? fmt::format("{}:{}", file, line) : file;
  return key.empty() ? fmt::format("{}: {}", where, text) : fmt::format("{}: {}: {}", where, key, text);
}

std::string to_string(std::span<const Fault> faults) {
  std::string all;
  for (const auto& fault : faults) {
    if (!all.empty()) all += '\n';
    all += fault.to_string();
  }
  return all;
}

std::vector<Fault> check(const Config& config) {
  std::vector<Fault> faults;
  check_names(config.cameras, "cameras", faults);
  const auto differ = [&faults](const char* key, int port, const char* other_key, int other) {
    if (port > 0 && port == other)
      faults.push_back({kSum, 0, key, fmt::format("{} is {} too; ports must differ", port, other_key)});
  };
  differ("listen.metrics_port", config.listen.metrics_port, "listen.tcp_port", config.listen.tcp_port);
  differ("listen.http_port", config.listen.http_port, "listen.tcp_port", config.listen.tcp_port);
  differ("listen.http_port", config.listen.http_port, "listen.metrics_port", config.listen.metrics_port);
  if (config.tls.certificate.empty() != config.tls.key.empty())
    faults.push_back({kSum, 0, config.tls.key.empty() ? "tls.key" : "tls.certificate",
                      "is missing: name both files, or neither for a certificate of our own"});
  check_address(config.listen.address, faults);
  if (config.state.dir.empty()) faults.push_back({kSum, 0, "state.dir", "must not be empty"});
  return faults;
}

Loaded load(std::span<const std::filesystem::path> files) {
  Config config;
  std::vector<Fault> faults;
  for (const auto& file : files) {
    const auto text = read_file(file);
    if (text)
      apply(*text, file, config, faults);
    else
      faults.push_back({file.string(), 0, "", text.error()});
  }
  return checked(std::move(config), std::move(faults));
}

Loaded parse(std::string_view toml, const std::filesystem::path& file) {
  Config config;
  std::vector<Fault> faults;
  apply(toml, file, config, faults);
  return checked(std::move(config), std::move(faults));
}

std::vector<std::string> known_keys() {
  std::vector<Fault> faults;
  std::vector<std::string> known;
  ReadReport report{"", &faults, &known};
  Config config;
  read_root(report, nullptr, "", config);
  return known;
}

}  // namespace darm::config

// What can be configured, with its defaults in place. config/darmd.toml documents every key; load.hpp reads them.
#pragma once

#include <cstdint>
#include <filesystem>
#include <glm/vec3.hpp>
#include <optional>
#include <string>
#include <vector>

namespace darm::config {

/// [scene]
struct SceneConfig {
  std::filesystem::path file;  ///< glTF or GLB; relative paths are relative to the config file. Empty: none
  double q = 0;                ///< texels per metre of level 0; 0: "auto"
  double exposure = 0;         ///< display = sRGB(clamp(exposure * nits)); 0: "auto"
};

/// [sun]; present as soon as a file has the section.
struct SunConfig {
  glm::dvec3 direction{0.3, -1.0, 0.15};   ///< the way light travels; any length but zero
  glm::dvec3 irradiance{100000.0};         ///< lux, linear RGB, on a surface that faces the sun
  double angular_diameter_degrees = 0.53;  ///< 0: a delta light
};

/// [sky]; present as soon as a file has the section. Nits, linear RGB.
struct SkyConfig {
  glm::dvec3 zenith{8000.0};
  glm::dvec3 horizon{8000.0};
  glm::dvec3 ground{2000.0};
};

enum class LightKind : std::uint8_t { kPoint, kSpot };

/// [[lights]], file coordinates (metres).
struct LightConfig {
  LightKind kind = LightKind::kPoint;
  glm::dvec3 position{0.0};
  glm::dvec3 intensity{0.0};       ///< candela, linear RGB
  glm::dvec3 direction{0, -1, 0};  ///< spot: the way light travels; any length but zero
  double cone_degrees = 45;        ///< spot: half angle at which light ends, (0, 90]
  double inner_cone_degrees = 0;   ///< spot: half angle up to which light is full, below cone_degrees
};

/// [[cameras]], [[load_cameras]], [[load_groups]]: a named pose in file coordinates. `name` of a load group is the
/// group.
struct Pose {
  std::string name;
  glm::dvec3 position{0.0};
  glm::dvec3 target{0.0, 0.0, -1.0};
  double fovy_degrees = 60;
};

/// [atlas]
struct AtlasConfig {
  std::uint64_t max_texels = std::uint64_t{1} << 30;  ///< of level 0; an explicit q that needs more is refused
};

/// [render]
struct RenderConfig {
  unsigned threads = 0;               ///< pool threads; 0: one per core
  std::uint32_t max_samples = 65536;  ///< per texel; shading of a texel ends there whatever its error
  double slice_ms = 4;                ///< length of one slice of pool work
};

/// [accuracy]: a preset, and the knobs it stands for. A knob that is given as well has the last word.
struct AccuracyConfig {
  std::string preset = "balanced";     ///< preview, balanced or reference: see preset_of()
  double target = 0.002;               ///< RMS display error (0..1) of a tile under which it costs no more time
  std::string indirect = "stored";     ///< where paths end: "stored" in light that is known, or "traced" to their end
  std::uint32_t filter_samples = 384;  ///< samples that soft light is averaged over while it has fewer; 0: not at all
  double client_target_min = 0.0005;   ///< least target that a client may ask for (or `target`, where that is less)
};

/// The knobs of a preset by its name; `balanced` for a name that is none.
///   preview    target 0.01,   indirect stored, filter 384: noise of two and a half steps of an 8-bit display is left
///   balanced   target 0.002,  indirect stored, filter 384: half a step of an 8-bit display
///   reference  target 0.0005, indirect traced, no filter: unbiased, for measuring
[[nodiscard]] inline AccuracyConfig preset_of(const std::string& name) {
  if (name == "preview") return {name, 0.01, "stored", 384};
  if (name == "reference") return {name, 0.0005, "traced", 0};
  return {};
}

/// [stream]
struct StreamConfig {
  double updates_per_second = 10;  ///< at most this many frames per stream
  std::uint32_t phystex = 2048;    ///< largest PhysTex offered, pixels square: 1024, 2048 or 4096
  std::uint32_t view_phystex =
      1024;  ///< largest private PhysTex offered where a scene calls for one: 0 (none), 512, 1024
  std::uint32_t max_writes = 1024;   ///< slots rewritten per frame at most
  std::uint32_t crf = 18;            ///< x264 constant rate factor: 0 best .. 51 worst; while light is rough
  std::uint32_t crf_finest = 8;      ///< the same, reached as the estimated error of light falls; 51 turns that off
  std::string preset = "superfast";  ///< x264 preset
  bool share = true;                 ///< clients that see much the same share a stream
  bool chroma_444 = false;           ///< offer 4:4:4 to clients that can decode it
  bool allow_lossless = false;       ///< let clients ask for uncompressed tiles (evaluation only)
};

/// [session]
struct SessionConfig {
  std::uint32_t max_sessions = 64;
  std::uint32_t max_sessions_per_address = 64;  ///< of an IPv4 address, or of the /64 of an IPv6 one
  std::uint64_t max_memory_bytes = 4ull << 30;  ///< send queues and private layers of all together
  double handshake_timeout_s = 10;
  double idle_timeout_s = 30;
  std::uint64_t send_queue_bytes = 64u << 20;  ///< a slower client is cut off
  double send_queue_seconds = 10;              ///< age of the oldest unsent byte at which it is cut off
};

/// [listen]. Port 0: any free one.
struct ListenConfig {
  std::string address = "0.0.0.0";
  int tcp_port = 9010;
  int udp_port = 9010;
  int http_port = 9080;     ///< the web client, over HTTP and HTTPS; -1: off
  int metrics_port = 9090;  ///< Prometheus; -1: off
};

/// [web]
struct WebConfig {
  std::vector<std::string> origins;  ///< besides this server's own pages: whose may open a stream; "*": everybody's
};

/// [tls]: of http_port and tcp_port, which speak both with and without.
struct TlsConfig {
  bool enabled = true;
  std::filesystem::path certificate;  ///< PEM; relative to the config file. Empty: one of our own, in state.dir/tls
  std::filesystem::path key;          ///< PEM, as above
  std::vector<std::string> names;     ///< of the certificate of our own, besides this machine's
};

/// [state]
struct StateConfig {
  std::filesystem::path dir = "state";  ///< caches and radiance store; relative to the working directory
  std::uint64_t max_store_bytes = std::uint64_t{32} << 30;
};

/// [log]
struct LogConfig {
  std::string level = "info";  ///< trace, debug, info, warn, error
  bool json = false;           ///< one JSON object a line
};

struct Config {
  SceneConfig scene;
  std::optional<SunConfig> sun;
  std::optional<SkyConfig> sky;
  std::vector<LightConfig> lights;
  std::vector<Pose> cameras;
  std::vector<Pose> load_cameras;
  std::vector<Pose> load_groups;
  std::filesystem::path walkthrough;  ///< JSON; relative paths are relative to the config file. Empty: none
  AtlasConfig atlas;
  RenderConfig render;
  AccuracyConfig accuracy;
  StreamConfig stream;
  SessionConfig session;
  ListenConfig listen;
  WebConfig web;
  TlsConfig tls;
  StateConfig state;
  LogConfig log;
};

}  // namespace darm::config

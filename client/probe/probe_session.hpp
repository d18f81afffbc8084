// One session with a server: cameras out, scene and frames in, pictures drawn at set times, everything measured.
#pragma once

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "client/core/byte_stream.hpp"
#include "client/core/camera_path.hpp"
#include "client/core/connection.hpp"
#include "client/core/image_metrics.hpp"
#include "client/core/renderer_gles.hpp"
#include "client/probe/codec_check.hpp"
#include "client/probe/lag_log.hpp"

namespace darm::client::probe {

struct SessionPlan {
  std::string host;
  std::uint16_t port = 0;
  Tls tls = Tls::kNone;
  std::filesystem::path authority;  ///< as ConnectOptions has them
  std::vector<CameraKey> path;      ///< one entry: a still camera; more: a walkthrough, begun at the first image
  std::uint32_t width = 1280, height = 720;
  double updates_per_second = 10;
  double seconds = 60;                ///< longest time, from the connection (still) or the first image (walkthrough)
  std::optional<double> until_error;  ///< stop once the server's estimate is at or under this
  std::vector<double> draw_times;     ///< seconds from the connection, rising; a point of the series each
  std::uint32_t max_phystex = 2048;
  std::uint32_t max_view_phystex = 1024;  ///< of the private layer; 0: none
  double target_error = 0;                ///< asked of the server; 0: its own
  bool lossless = false;
  bool chroma_444 = true;
  bool keep_tiles = false;   ///< report what each resident tile shows at the end
  bool udp = true;           ///< cameras by UDP where the server offers it
  bool lag = false;          ///< draw every picture that comes, and report how long each camera took to it
  bool check_first = false;  ///< count the pixels of the first picture that show no surface
};

/// Bytes received, by what they are for.
struct ByteCounts {
  std::uint64_t manifest = 0, geometry = 0, coarse = 0, video = 0, page_table = 0;
  std::uint64_t total = 0;  ///< the protocol's own included
};

struct Milestone {
  double seconds = 0;  ///< since the connection was begun
  ByteCounts bytes;
  std::size_t chunks = 0;  ///< of geometry
};

struct SeriesPoint {
  double t = 0;
  std::optional<double> psnr;
  std::optional<double> error;  ///< the server's estimate at that time, if it has sent one
  double resolution_error = 0;  ///< beside it, as in the report
  double omitted_error = 0;
};

struct SessionReport {
  Image8 picture;             ///< the last drawn
  ResidencyCounts residency;  ///< of that picture
  double seconds = 0;
  Milestone first_picture;                 ///< drawn: every surface in view is there and lit, if only by CoarseTex
  Milestone first_image;                   ///< drawn: the same with the first streamed frame
  std::size_t chunks = 0;                  ///< of geometry, in all
  std::optional<double> first_background;  ///< share of the first picture's samples without surface, with check_first
  std::uint64_t bytes = 0, stream_bytes = 0, sent_bytes = 0;
  double stream_seconds = 0;  ///< from the first image on
  std::uint64_t stream_bytes_after_first_image = 0;
  std::uint64_t frames = 0, key_frames = 0, no_changes = 0, answers = 0, cameras = 0, frames_lost = 0;
  std::optional<double> error;  ///< the server's newest estimate, of light
  double resolution_error = 0;  ///< beside it: for want of finer texels than the atlas has
  double omitted_error = 0;     ///< beside both: of light that depends on the eye and is not streamed
  std::vector<SeriesPoint> series;
  std::map<std::string, std::vector<double>> latency_ms;
  std::vector<LagSample> lag;        ///< with `lag`
  std::vector<double> draw_seconds;  ///< drawing and resolving, without reading back
  std::uint64_t triangles = 0;
  std::string device;  ///< the GL that drew
  std::string server;
  bool udp = false;
  std::uint32_t phystex_size = 0;
  double target_error = 0;              ///< of this session, as the server says
  std::uint32_t view_phystex_size = 0;  ///< 0: no private layer
  std::uint32_t view_slots_used = 0;
  std::uint64_t view_frames = 0, view_frames_lost = 0, view_bytes = 0;
  TilePlanes tiles;  ///< with keep_tiles
};

/// Runs the plan in the current GL context. `reference` (may be null) gives the series its PSNR.
/// `bench_draws` more pictures are drawn at the end for `draw_seconds`. Error: no full image came in time, the server
/// left, or what it sent is not valid.
[[nodiscard]] Result<SessionReport> run_session(const SessionPlan& plan, const Reference* reference,
                                                unsigned bench_draws);

}  // namespace darm::client::probe

// One run of the daemon's own actors from an empty store, without sockets: what goes out to a session, with its times.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <vector>

#include "actors/session/session_messages.hpp"
#include "actors/types/camera.hpp"
#include "actors/types/error.hpp"
#include "daemon/config/config.hpp"
#include "daemon/world.hpp"

namespace darm::accuracy {

struct RecordedFrame {
  double seconds = 0;  ///< when it would have gone to the socket, from the first camera
  double samples = 0;  ///< texel samples taken by then
  std::shared_ptr<const session::EncodedFrame> encoded;
  std::vector<encoder::SlotWrite> writes;  ///< its tiles as they were before the codec
};

struct RecordedCoarse {
  double seconds = 0;
  double samples = 0;
  std::shared_ptr<const session::CoarseTexture> texture;
};

struct Recording {
  std::vector<RecordedFrame> frames;
  std::vector<RecordedCoarse> coarse;
  double seconds = 0;      ///< how long it was watched
  bool finished = false;   ///< ended early: nothing changed any more
  bool stopped = false;    ///< `stopped` said so: worth nothing
  bool disturbed = false;  ///< the process stood still for over a second (suspended, say): its times are worth nothing
};

struct RunOptions {
  config::Config config;
  Camera camera;
  Viewport viewport;
  double seconds = 16;
  bool private_layer = false;            ///< the session takes one too, where the scene calls for it
  std::filesystem::path folder;          ///< for the radiance store, which is made and removed
  std::function<bool()> stopped;         ///< asked ten times a second
  std::function<void(double)> progress;  ///< told the seconds passed as often; may be empty
};

/// Tiles count as the last if for three seconds, and for a third of the run so far, no others came. `last_tiles` 0:
/// none yet.
[[nodiscard]] bool has_settled(double now, double last_tiles);

/// Runs tile scheduler, renderer, encoders and, where asked for, the view renderer of `world` (its store is not used)
/// for one session that sends its resting camera ten times a second. Errors: the store, an actor that failed.
[[nodiscard]] Result<Recording> record_run(const World& world, const RunOptions& options);

}  // namespace darm::accuracy

// Encoded pictures and answers as messages on the wire. What is alike for all sessions is serialized once.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <mutex>
#include <optional>

#include "actors/session/bytes.hpp"
#include "actors/session/session_messages.hpp"
#include "actors/types/camera.hpp"
#include "proto/darm.pb.h"

namespace darm::session {

/// The shared part of StreamFrame messages: picture and page table. Remembers the newest few, so that the sessions
/// of a stream serialize (and compress coverage) once between them. Thread-safe; one per daemon.
class FrameBodies {
 public:
  [[nodiscard]] SharedBytes body_of(const std::shared_ptr<const EncodedFrame>& frame);

 private:
  struct Entry {
    std::weak_ptr<const EncodedFrame> frame;
    SharedBytes body;
  };
  std::mutex mutex_;
  std::array<Entry, 8> entries_;
  std::size_t next_ = 0;
};

/// One StreamFrame for one session: shared body, then its own answer and stamps (protobuf fields may be concatenated).
[[nodiscard]] Packet frame_packet(FrameBodies& bodies, const std::shared_ptr<const EncodedFrame>& frame,
                                  const ViewAnswer& answer);

[[nodiscard]] wire::Envelope no_change_message(const NoChange& event);
[[nodiscard]] SharedBytes coarse_message(const CoarseTexture& texture);

/// A pose from the network: normalised orientation; nothing if it is not valid.
struct ParsedPose {
  Camera camera;
  Viewport viewport;
};
[[nodiscard]] std::optional<ParsedPose> parse_pose(const wire::Pose& pose);
void put_pose(const Camera& camera, const Viewport& viewport, wire::Pose& out);

}  // namespace darm::session

// When the steps of one frame happened, so that shading lag can be taken apart by stage.
#pragma once

#include <cstdint>

#include "actors/types/ids.hpp"

namespace darm {

/// Microseconds on the daemon's steady clock (not comparable between machines); 0: did not happen.
using Microseconds = std::int64_t;

/// Stamps of one frame as seen from one session (DESIGN "The way of one frame"). Each is the time at which the step
/// was finished; they do not decrease. `client_sent` is the client's own clock, echoed back untouched.
struct FrameStamps {
  Microseconds client_sent = 0;       ///< step 1, client clock
  Microseconds camera_received = 0;   ///< step 1, datagram read by the session
  Microseconds view_started = 0;      ///< step 2, visibility begun by the tile scheduler
  Microseconds view_ready = 0;        ///< working set known
  Microseconds composed = 0;          ///< step 5, frame handed to the encoder (ComposeFrame sent)
  Microseconds encode_started = 0;    ///< YUV composition begun
  Microseconds picture_composed = 0;  ///< tiles copied into the picture
  Microseconds encoded = 0;           ///< step 6, packet ready
  Microseconds sent = 0;              ///< step 7, handed to the socket
};

/// Which camera of which session a frame answers.
struct ViewAnswer {
  SessionId session{};
  CameraSequence sequence = 0;
  FrameStamps stamps;
  float error = 0;             ///< estimated RMS display error of the light of that session's view, 0..1
  float resolution_error = 0;  ///< beside it: of an atlas whose finest texels are larger than the view's pixels
  float omitted_error = 0;     ///< beside both: of light that depends on the eye, where the session has no layer for it
};

}  // namespace darm

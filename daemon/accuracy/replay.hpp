// A recorded run, looked at afterwards: the error of its pictures over time, and the same light through other codecs.
#pragma once

#include <vector>

#include "daemon/accuracy/picture_error.hpp"
#include "daemon/accuracy/recording.hpp"
#include "daemon/accuracy/report/measurement.hpp"
#include "daemon/accuracy/software_view.hpp"

namespace darm::accuracy {

struct ReplayOptions {
  std::uint32_t phystex_size = 2048;
  unsigned threads = 1;
  double step = 1.4142;  ///< a picture is looked at when this many times the last one's time has passed, and the last
};

struct Replayed {
  std::vector<Point> curve;  ///< through the codec; from the first full picture on
  double light_db = 0;       ///< the last one without the codec
  double bytes = 0;
};

/// Is there a frame with tiles, and CoarseTex?
[[nodiscard]] bool has_picture(const Recording& recording);

/// `layout`: that of the run's world. Without any full picture the curve is empty. Errors: a packet that does not
/// decode.
[[nodiscard]] Result<Replayed> replay(const Recording& recording, const atlas::Layout& layout, const SoftwareView& view,
                                      const ShownHalves& reference, const ReplayOptions& options);

struct Recoded {
  std::vector<Point> curve;  ///< first and last picture
  double bytes = 0;
  double first_bytes = 0;
  double first_codec_db = 0;  ///< the drawn view after the codec against before
  double last_codec_db = 0;
  double encode_seconds = 0;  ///< mean of one frame
};

/// The recording's frames coded again at `crf`, with the stream's other settings. Errors as replay(), and the
/// encoder's.
[[nodiscard]] Result<Recoded> recode(const Recording& recording, const atlas::Layout& layout, const SoftwareView& view,
                                     const ShownHalves& reference, const config::StreamConfig& stream, float crf,
                                     unsigned threads);

}  // namespace darm::accuracy

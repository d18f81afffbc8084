// A recorded run, looked at afterwards: the error of its pictures over time, and the same light through other codecs.
#pragma once

#include <optional>
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

/// What the codec makes of a view is looked at first when this share of it is tiles. Before that it shows CoarseTex,
/// which no codec of tiles can harm: what the very first tiles lose of it says nothing. Never is it all tiles: what
/// covers a few pixels stays coarse.
inline constexpr double kMostlyTiles = 0.5;

struct Recoded {
  /// The view after the codec, and what had been sent by then.
  struct First {
    double bytes = 0;
    double codec_db = 0;  ///< against before the codec
  };
  std::vector<Point> curve;    ///< that first picture, if there is one, and the last
  std::optional<First> first;  ///< nothing: there were never tiles enough
  double bytes = 0;
  double last_codec_db = 0;
  double encode_seconds = 0;  ///< mean of one frame
};

/// The recording's frames coded again at `crf`, with the stream's other settings. Errors as replay(), and the
/// encoder's.
[[nodiscard]] Result<Recoded> recode(const Recording& recording, const atlas::Layout& layout, const SoftwareView& view,
                                     const ShownHalves& reference, const config::StreamConfig& stream, float crf,
                                     unsigned threads);

}  // namespace darm::accuracy

// DARM beside pixel streaming: time, bytes and updates until every client's picture is good.
#pragma once

#include "tests/bench/darm_bench/time_to_quality.hpp"

namespace darm::bench {

/// Runs both for the first 1, 4 and 8 of the cameras (as many as there are), one client each, in one process. Keys of
/// each entry of `runs`: clients; for `darm` and `pixels` seconds (until all are at the target; null: not reached),
/// bytes (all clients together until each is there), updates_per_second (mean of the clients, over the run); for pixels
/// also first_db, what a client that moves sees (a picture of one sample a pixel). `ratio` are those of pixels over
/// DARM's.
[[nodiscard]] Result<nlohmann::json> frame_streaming(const TimeToQualityOptions& options);

}  // namespace darm::bench

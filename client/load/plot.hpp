// A run as a picture: SVG without scripts, in the colours of the reader's scheme. Pure.
#pragma once

#include <string>

#include "client/load/load_report.hpp"

namespace darm::client::load {

/// Three panels over the seconds of a run: how long answers took, what each client was sent, processor time. A file of
/// its own, well-formed for any report; without seconds it says so.
[[nodiscard]] std::string plot(const LoadReport& report);

}  // namespace darm::client::load

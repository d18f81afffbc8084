// What each metric says: the HELP line at /metrics, and the list of names that dashboards and alerts may use.
#pragma once

#include <string_view>

namespace darm::observe {

/// One sentence on the metric `name`; empty for a name that is not in the list (tests/check_metrics.py holds that every
/// one the daemon measures is).
[[nodiscard]] std::string_view metric_help(std::string_view name);

}  // namespace darm::observe

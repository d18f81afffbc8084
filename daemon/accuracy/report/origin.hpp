// Which results may be compared: runs can be resumed, so a table may hold some of another day, or of a busier machine.
// Pure.
#pragma once

#include <string>
#include <vector>

#include "daemon/accuracy/report/measurement.hpp"

namespace darm::accuracy {

/// What the results of a report were measured under, by the run that began last.
class Origins {
 public:
  explicit Origins(const Report& report);

  /// Of another run than the last, or traced under quite another load: its seconds are not the others'.
  [[nodiscard]] bool is_apart(const Measurement& m) const;
  /// The variant's name, with a star where it is apart.
  [[nodiscard]] std::string name_of(const Measurement& m) const;
  /// "last run", "2026-01-31 12:03 UTC, rays at 0.61 times the last run's usual speed", "earlier, it is not known
  /// when".
  [[nodiscard]] std::string words_of(const Measurement& m) const;
  /// "Measured 2026-01-31 12:03 UTC"; empty where it is not known.
  [[nodiscard]] std::string when() const;

 private:
  [[nodiscard]] bool is_of_last_run(const Measurement& m) const;
  [[nodiscard]] double speed_ratio(const Measurement& m) const;
  double last_ = 0;   // when the last run began, seconds since 1970; 0: no result says
  double speed_ = 0;  // rays per second in it: the median of its results; 0: no result says
};

/// What a star means.
inline constexpr const char* kApartWords =
    "* Measured in another run than the last one, or while other work slowed the machine down or no longer did: its "
    "seconds are not to be compared with those of rows without a star. To have all rows of one run, name an empty "
    "folder with --out.";

}  // namespace darm::accuracy

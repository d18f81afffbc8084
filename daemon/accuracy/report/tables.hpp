// The measurements as tables of words, before they are HTML or Markdown. Pure.
#pragma once

#include <string>
#include <vector>

#include "daemon/accuracy/report/measurement.hpp"
#include "daemon/accuracy/report/svg_chart.hpp"

namespace darm::accuracy {

struct Table {
  std::string caption;
  std::vector<std::string> columns;  ///< the first one names the rows
  std::vector<std::vector<std::string>> rows;
};

/// A group of variants of one camera: its curves beside those of balanced and of camera frames.
struct Section {
  std::string heading;
  std::string words;  ///< what is compared
  Chart chart;        ///< without series: none
  std::vector<Table> tables;
};

/// What one camera's measurements say, a section a group; groups that were not measured are left out.
[[nodiscard]] std::vector<Section> sections_of(const Report& report, const std::string& camera);

/// The effects of the plan with their reasons and, where leaving one out was measured, its price.
[[nodiscard]] Table plan_table(const Report& report);

/// What the error is, what the clock counts and what is not measured: paragraphs.
[[nodiscard]] std::vector<std::string> method_words(const Report& report);

}  // namespace darm::accuracy

// The report as files: one HTML page, Markdown with its pictures, JSON, CSV. Pure: results in, text out.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "daemon/accuracy/report/measurement.hpp"

namespace darm::accuracy {

/// A self-contained page: no scripts, nothing loaded, readable in both colour schemes. Well-formed XML.
[[nodiscard]] std::string html_page(const Report& report);

/// The same as Markdown. Pictures are named `prefix` + chart id + ".svg": see svg_files().
[[nodiscard]] std::string markdown_page(const Report& report, const std::string& prefix);

/// Name and content of each picture of markdown_page().
[[nodiscard]] std::vector<std::pair<std::string, std::string>> svg_files(const Report& report,
                                                                         const std::string& prefix);

/// One object: set-up, plan, measurements with curves, prices and ratios.
[[nodiscard]] std::string json_text(const Report& report);

/// Every point of every curve: camera,group,variant,seconds,db,samples.
[[nodiscard]] std::string curves_csv(const Report& report);

/// Every figure: camera,group,variant,figure,value.
[[nodiscard]] std::string figures_csv(const Report& report);

}  // namespace darm::accuracy

// links: darm_accuracy_report
// Results of darmd accuracy: any bytes give measurements that every page can be made of, or none.
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string_view>

#include "daemon/accuracy/report/report_page.hpp"
#include "daemon/accuracy/report/results_file.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace darm::accuracy;
  if (size > 1u << 16) return 0;
  Report report;
  report.measurements = parse_results({reinterpret_cast<const char*>(data), size});
  for (const auto& m : report.measurements) {
    const auto again = parse_line(to_line(m));
    if (!again || again->key != m.key || again->curve.size() != m.curve.size()) std::abort();
    for (const auto& p : m.curve)
      if (!std::isfinite(p.seconds) || !std::isfinite(p.db)) std::abort();
    report.cameras.push_back({m.camera, 1, 40});
    if (report.cameras.size() > 3) break;
  }
  if (html_page(report).empty() || markdown_page(report, "").empty() || json_text(report).empty()) std::abort();
  return 0;
}

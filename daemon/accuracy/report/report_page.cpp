#include "daemon/accuracy/report/report_page.hpp"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "daemon/accuracy/report/curve.hpp"
#include "daemon/accuracy/report/origin.hpp"
#include "daemon/accuracy/report/svg_chart.hpp"
#include "daemon/accuracy/report/tables.hpp"
#include "daemon/accuracy/report/text.hpp"

namespace darm::accuracy {
namespace {

constexpr const char* kPageStyle = R"(
:root{color-scheme:light dark;--paper:#fff;--ink:#1c1e21;--soft:#5a6068;--line:#d8dce1}
@media (prefers-color-scheme:dark){:root{--paper:#14171a;--ink:#eceef0;--soft:#a8b0b9;--line:#343b42}}
body{background:var(--paper);color:var(--ink);font:16px/1.5 system-ui,sans-serif;max-width:60rem;margin:2rem auto;padding:0 1rem}
h1{font-size:1.7rem}h2{margin-top:2.5rem}h3{margin-bottom:.3rem}p.soft{color:var(--soft)}
figure{margin:1rem 0}svg{width:100%;height:auto}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-size:.875rem;font-variant-numeric:tabular-nums;margin:.8rem 0}
caption{text-align:left;color:var(--soft);padding:.2rem 0}
th,td{padding:.25rem .7rem .25rem 0;text-align:left;border-bottom:1px solid var(--line);vertical-align:top}
)";

std::string html_table(const Table& table) {
  std::string out = "<div class=\"scroll\"><table>\n<caption>" + xml_text(table.caption) + "</caption>\n<thead><tr>";
  for (const auto& c : table.columns) out += "<th scope=\"col\">" + xml_text(c) + "</th>";
  out += "</tr></thead>\n<tbody>\n";
  for (const auto& row : table.rows) {
    out += "<tr>";
    for (std::size_t i = 0; i < row.size(); ++i)
      out += i == 0 ? "<th scope=\"row\">" + xml_text(row[i]) + "</th>" : "<td>" + xml_text(row[i]) + "</td>";
    out += "</tr>\n";
  }
  return out + "</tbody>\n</table></div>\n";
}

std::string markdown_table(const Table& table) {
  std::string out = "| ";
  for (const auto& c : table.columns) out += markdown_text(c) + " | ";
  out.back() = '\n';
  out += "|";
  for (std::size_t i = 0; i < table.columns.size(); ++i) out += "---|";
  out += "\n";
  for (const auto& row : table.rows) {
    out += "| ";
    for (const auto& cell : row) out += markdown_text(cell) + " | ";
    out.back() = '\n';
  }
  return out;
}

std::string facts_words(const Report& r) {
  const auto when = Origins(r).when();
  return std::to_string(r.width) + " x " + std::to_string(r.height) + " pixels, q = " + exact_text(r.q) + ", " +
         count_text(static_cast<double>(r.triangles)) + " triangles, " + std::to_string(r.threads) +
         (r.threads == 1 ? " thread, " : " threads, ") + seconds_text(r.seconds) + " s a run." +
         (when.empty() ? "" : " " + when + ".");
}

// What the star of some rows means; empty where no row of this camera has one.
std::string apart_words(const Report& report, const std::string& camera) {
  const Origins origins(report);
  const bool some = std::ranges::any_of(
      report.measurements, [&](const Measurement& m) { return m.camera == camera && origins.is_apart(m); });
  return some ? kApartWords : "";
}

std::string camera_words(const Report& report, const CameraFacts& camera) {
  const auto apart = apart_words(report, camera.name);
  return ratio_text(100 * camera.counted) + " % of the pixels counted; the reference's own accuracy is " +
         db_text(camera.reference_psnr) + " dB." + (apart.empty() ? "" : " " + apart);
}

// The sentence that somebody in a hurry reads.
std::string verdict(const Report& report, const std::string& camera) {
  const auto* ours = report.find(camera, Group::kPresets, kBalanced);
  const auto* plain = report.find(camera, Group::kFrames, kCameraFrames);
  if (ours == nullptr || ours->curve.empty()) return {};
  const Origins origins(report);
  std::string out = "From nothing, the first picture is there after " + seconds_text(ours->curve.front().seconds) +
                    " s at " + db_text(ours->curve.front().db) + " dB, and after " +
                    seconds_text(ours->curve.back().seconds) + " s it is at " + db_text(ours->curve.back().db) + " dB.";
  const auto prices = decibel_prices(ours->curve);
  if (!prices.empty())
    out += " Its last whole decibel, from " + std::to_string(prices.back().db) + " to " +
           std::to_string(prices.back().db + 1) + ", cost " + seconds_text(prices.back().seconds) + " s.";
  if (plain == nullptr || plain->curve.empty()) return out;
  const double db = std::floor(std::min(ours->curve.back().db, plain->curve.back().db));
  if (const auto ratio = time_ratio(plain->curve, ours->curve, db))
    out += " Tracing camera frames takes " + ratio_text(*ratio) + " times as long to " + db_text(db) + " dB" +
           (origins.is_apart(*ours) || origins.is_apart(*plain) ? " *." : ".");
  return out;
}

std::vector<std::pair<std::string, Chart>> charts_of(const Report& report, const std::string& prefix) {
  std::vector<std::pair<std::string, Chart>> out;
  for (const auto& camera : report.cameras)
    for (auto& section : sections_of(report, camera.name))
      if (!section.chart.series.empty()) out.emplace_back(prefix + section.chart.id + ".svg", std::move(section.chart));
  return out;
}

nlohmann::json to_json(const Measurement& m, const Measurement* plain) {
  nlohmann::json curve = nlohmann::json::array();
  for (const auto& p : m.curve) curve.push_back({{"seconds", p.seconds}, {"db", p.db}, {"samples", p.samples}});
  nlohmann::json prices = nlohmann::json::array();
  for (const auto& p : decibel_prices(m.curve)) {
    nlohmann::json price = {{"from_db", p.db}, {"to_db", p.db + 1}, {"seconds", p.seconds}, {"reached", p.reached}};
    if (plain != nullptr && plain != &m)
      if (const auto ratio = time_ratio(plain->curve, m.curve, p.db + 1)) price["camera_frames_ratio"] = *ratio;
    prices.push_back(std::move(price));
  }
  return {{"camera", m.camera}, {"group", name_of(m.group)}, {"variant", m.variant},
          {"curve", curve},     {"decibels", prices},        {"figures", m.figures}};
}

}  // namespace

std::string html_page(const Report& report) {
  std::string out =
      "<!DOCTYPE html>\n<html xmlns=\"http://www.w3.org/1999/xhtml\" lang=\"en\">\n<head>\n<meta charset=\"utf-8\"/>\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\"/>\n<title>What accuracy costs: " +
      xml_text(report.scene) + "</title>\n<style>" + kPageStyle + chart_style() + "</style>\n</head>\n<body>\n<main>\n";
  out += "<h1>What accuracy costs in time: " + xml_text(report.scene) + "</h1>\n";
  out += "<p class=\"soft\">" + xml_text(facts_words(report)) + "</p>\n";
  for (const auto& camera : report.cameras) {
    out += "<h2>Camera " + xml_text(camera.name) + "</h2>\n<p>" + xml_text(verdict(report, camera.name)) + "</p>\n";
    out += "<p class=\"soft\">" + xml_text(camera_words(report, camera)) + "</p>\n";
    for (const auto& section : sections_of(report, camera.name)) {
      out += "<h3>" + xml_text(section.heading) + "</h3>\n<p>" + xml_text(section.words) + "</p>\n";
      if (!section.chart.series.empty()) out += "<figure>" + svg_chart(section.chart, false) + "</figure>\n";
      for (const auto& table : section.tables) out += html_table(table);
    }
  }
  out += "<h2>The effect plan</h2>\n" + html_table(plan_table(report));
  out += "<h2>What is measured</h2>\n";
  for (const auto& words : method_words(report)) out += "<p>" + xml_text(words) + "</p>\n";
  return out + "</main>\n</body>\n</html>\n";
}

std::string markdown_page(const Report& report, const std::string& prefix) {
  std::string out = "## " + markdown_text(report.scene) + "\n\n" + markdown_text(facts_words(report)) + "\n";
  for (const auto& camera : report.cameras) {
    out += "\n### Camera " + markdown_text(camera.name) + "\n\n" + markdown_text(verdict(report, camera.name)) + " " +
           markdown_text(camera_words(report, camera)) + "\n";
    for (const auto& section : sections_of(report, camera.name)) {
      out += "\n#### " + markdown_text(section.heading) + "\n\n" + markdown_text(section.words) + "\n";
      if (!section.chart.series.empty())
        out += "\n![" + markdown_text(section.chart.title) + "](" + prefix + section.chart.id + ".svg)\n";
      for (const auto& table : section.tables)
        out += "\n" + markdown_text(table.caption) + ":\n\n" + markdown_table(table);
    }
  }
  out += "\n### The effect plan\n\n" + markdown_table(plan_table(report));
  return out;
}

std::vector<std::pair<std::string, std::string>> svg_files(const Report& report, const std::string& prefix) {
  std::vector<std::pair<std::string, std::string>> out;
  for (const auto& [name, chart] : charts_of(report, prefix)) out.emplace_back(name, svg_chart(chart, true));
  return out;
}

std::string json_text(const Report& r) {
  nlohmann::json cameras = nlohmann::json::array(), plan = nlohmann::json::array(), list = nlohmann::json::array();
  for (const auto& c : r.cameras)
    cameras.push_back({{"name", c.name}, {"counted", c.counted}, {"reference_psnr", c.reference_psnr}});
  for (const auto& e : r.plan) plan.push_back({{"effect", e.name}, {"needed", e.needed}, {"reason", e.reason}});
  for (const auto& m : r.measurements) list.push_back(to_json(m, r.find(m.camera, Group::kFrames, kCameraFrames)));
  const nlohmann::json all = {{"scene", r.scene},     {"triangles", r.triangles}, {"q", r.q},
                              {"threads", r.threads}, {"width", r.width},         {"height", r.height},
                              {"seconds", r.seconds}, {"cameras", cameras},       {"plan", plan},
                              {"measurements", list}};
  return all.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n";
}

std::string curves_csv(const Report& report) {
  std::string out = "camera,group,variant,seconds,db,samples\r\n";
  for (const auto& m : report.measurements)
    for (const auto& p : m.curve)
      out += csv_field(m.camera) + "," + name_of(m.group) + "," + csv_field(m.variant) + "," + exact_text(p.seconds) +
             "," + exact_text(p.db) + "," + exact_text(p.samples) + "\r\n";
  return out;
}

std::string figures_csv(const Report& report) {
  std::string out = "camera,group,variant,figure,value\r\n";
  for (const auto& m : report.measurements)
    for (const auto& [name, value] : m.figures)
      out += csv_field(m.camera) + "," + name_of(m.group) + "," + csv_field(m.variant) + "," + csv_field(name) + "," +
             exact_text(value) + "\r\n";
  return out;
}

}  // namespace darm::accuracy

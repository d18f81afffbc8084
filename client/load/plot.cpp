#include "client/load/plot.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <string_view>
#include <utility>
#include <vector>

namespace darm::client::load {
namespace {

constexpr double kWidth = 760, kPanel = 190, kLeft = 52, kRight = 590, kTop = 30, kGraph = 120;
constexpr double kNameStep = 16;  // between the names of two curves
constexpr std::size_t kMostPoints = 600;

struct Curve {
  std::string_view name;
  std::vector<std::pair<double, double>> points;  // seconds, value
};

struct Panel {
  std::string_view title;
  std::vector<Curve> curves;
};

// Hues after Okabe and Ito (Color Universal Design, 2008), darker on white, lighter on black; dashes tell curves apart
// without colour.
constexpr std::string_view kStyle = R"(
.chart{--paper:#fff;--ink:#1c1e21;--soft:#5a6068;--grid:#e3e6ea;
--s0:#0063a0;--s1:#b84300;--s2:#00785a}
@media (prefers-color-scheme:dark){
.chart{--paper:#14171a;--ink:#eceef0;--soft:#a8b0b9;--grid:#2b3137;
--s0:#5ab4f0;--s1:#ff8f4a;--s2:#35c99c}
}
.chart{font:13px system-ui,sans-serif}
.chart .paper{fill:var(--paper)}.chart .grid{stroke:var(--grid);stroke-width:1}
.chart .axis{stroke:var(--soft);stroke-width:1}
.chart text{fill:var(--ink)}.chart .mark{fill:var(--soft);font-size:12px}
.chart .middle{text-anchor:middle}.chart .end{text-anchor:end}
.chart .curve{fill:none;stroke-width:2;stroke-linejoin:round}
.chart .s0{stroke:var(--s0)}.chart .s1{stroke:var(--s1);stroke-dasharray:7 3}
.chart .s2{stroke:var(--s2);stroke-dasharray:2 3}
)";

bool finite(double v) { return std::isfinite(v) && std::abs(v) < 1e12; }

// 1, 2 or 5 times a power of ten, so that at most five lines lie under `highest`.
double step_for(double highest) {
  double step = std::pow(10.0, std::floor(std::log10(highest / 5)));
  for (const double factor : {2.0, 2.5, 2.0}) {
    if (highest / step <= 5) break;
    step *= factor;
  }
  return step;
}

std::string text(double x, double y, std::string_view kind, std::string_view words) {
  return fmt::format("<text class=\"{}\" x=\"{:.1f}\" y=\"{:.1f}\">{}</text>\n", kind, x, y, words);
}

std::string line(double x0, double y0, double x1, double y1, std::string_view kind) {
  return fmt::format("<line class=\"{}\" x1=\"{:.1f}\" y1=\"{:.1f}\" x2=\"{:.1f}\" y2=\"{:.1f}\"/>\n", kind, x0, y0, x1,
                     y1);
}

// Where the axes end and how values lie on them.
struct Frame {
  double top = 0, last = 1, highest = 1;
  [[nodiscard]] double x(double t) const { return kLeft + (kRight - kLeft) * t / last; }
  [[nodiscard]] double y(double v) const { return top + kGraph * (1 - v / highest); }
};

std::string draw_axes(const Frame& frame, std::string_view title) {
  std::string out = text(kLeft, frame.top - 10, "name", title);
  const double step = step_for(frame.highest);
  for (double v = 0; v <= frame.highest * 1.0001; v += step) {
    out += line(kLeft, frame.y(v), kRight, frame.y(v), v > 0 ? "grid" : "axis");
    out += text(kLeft - 6, frame.y(v) + 4, "mark end", fmt::format("{:g}", v));
  }
  const double every = std::max(1.0, step_for(frame.last));
  for (double t = 0; t <= frame.last; t += every)
    out += text(frame.x(t), frame.top + kGraph + 16, "mark middle", fmt::format("{:g}", t));
  return out;
}

std::string draw_curve(const Frame& frame, const Curve& curve, std::size_t look) {
  std::string path;
  const std::size_t every = curve.points.size() / kMostPoints + 1;
  for (std::size_t i = 0; i < curve.points.size(); i += every) {
    const auto& [t, v] = curve.points[i];
    path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", frame.x(t), frame.y(v));
  }
  return fmt::format("<path class=\"curve s{}\" d=\"{}\"/>\n", look, path);
}

// Beside the last points, moved apart where they would cover each other.
std::string draw_names(const Frame& frame, const std::vector<Curve>& curves) {
  std::vector<std::pair<double, std::size_t>> places;
  for (std::size_t i = 0; i < curves.size(); ++i)
    if (!curves[i].points.empty()) places.emplace_back(frame.y(curves[i].points.back().second), i);
  std::sort(places.begin(), places.end());
  for (std::size_t i = 1; i < places.size(); ++i)
    places[i].first = std::max(places[i].first, places[i - 1].first + kNameStep);
  double floor = frame.top + kGraph;
  for (std::size_t i = places.size(); i-- > 0; floor = places[i].first - kNameStep)
    places[i].first = std::min(places[i].first, floor);
  std::string out;
  for (const auto& [y, i] : places) {
    out += line(kRight + 6, y, kRight + 28, y, fmt::format("curve s{}", i));
    out += text(kRight + 34, y + 4, "name", curves[i].name);
  }
  return out;
}

std::string draw(const Panel& panel, double top) {
  Frame frame;
  frame.top = top;
  for (const auto& curve : panel.curves)
    for (const auto& [t, v] : curve.points) {
      frame.last = std::max(frame.last, t);
      frame.highest = std::max(frame.highest, v * 1.05);
    }
  std::string out = draw_axes(frame, panel.title);
  for (std::size_t i = 0; i < panel.curves.size(); ++i) out += draw_curve(frame, panel.curves[i], i);
  return out + draw_names(frame, panel.curves);
}

template <class Value>
Curve curve_of(std::string_view name, const std::vector<Moment>& moments, Value value) {
  Curve curve{name, {}};
  for (const auto& m : moments)
    if (const double v = value(m); finite(v) && v >= 0 && finite(m.t) && m.t >= 0) curve.points.emplace_back(m.t, v);
  return curve;
}

}  // namespace

std::string plot(const LoadReport& report) {
  const auto& m = report.moments;
  const std::vector<Panel> panels = {
      {"from a camera to its answer, ms",
       {curve_of("p99", m, [](const Moment& at) { return at.answer_ms.p99; }),
        curve_of("p95", m, [](const Moment& at) { return at.answer_ms.p95; }),
        curve_of("p50", m, [](const Moment& at) { return at.answer_ms.p50; })}},
      {"messages a second to each client",
       {curve_of("frames", m, [](const Moment& at) { return at.stream_frames; }),
        curve_of("no change", m, [](const Moment& at) { return at.no_changes; })}},
      {"processor seconds a second",
       {curve_of("server", m, [](const Moment& at) { return at.server_cpu.value_or(-1); }),
        curve_of("harness", m, [](const Moment& at) { return at.harness_cpu; })}}};
  const double height = kTop + kPanel * static_cast<double>(panels.size());
  std::string out = fmt::format(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart\" viewBox=\"0 0 {:.0f} {:.0f}\" role=\"img\" "
      "aria-labelledby=\"load-t load-d\">\n<title id=\"load-t\">Load test: {} clients</title>\n"
      "<desc id=\"load-d\">Answer times, messages and processor time over the seconds of the run, of the healthy "
      "clients</desc>\n<style>{}</style>\n<rect class=\"paper\" width=\"{:.0f}\" height=\"{:.0f}\"/>\n",
      kWidth, height, report.all.clients, kStyle, kWidth, height);
  if (m.empty()) return out + text(kWidth / 2, height / 2, "mark middle", "no seconds were counted") + "</svg>\n";
  for (std::size_t i = 0; i < panels.size(); ++i) out += draw(panels[i], kTop + kPanel * static_cast<double>(i));
  return out + text((kLeft + kRight) / 2, height - 8, "mark middle", "seconds") + "</svg>\n";
}

}  // namespace darm::client::load

#include "daemon/accuracy/report/svg_chart.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "daemon/accuracy/report/text.hpp"

namespace darm::accuracy {
namespace {

constexpr double kWidth = 760, kHeight = 380;
constexpr double kLeft = 46, kRight = 590, kTop = 28, kBottom = 336;
constexpr double kLabelStep = 17;  // between the names of two curves

std::string coordinate(double x) {
  char out[32];
  std::snprintf(out, sizeof out, "%.1f", x);
  return out;
}

struct Range {
  double low = 0, high = 1;
};

struct Axes {
  Range seconds, db;
  [[nodiscard]] double x(double t) const {
    return kLeft + (kRight - kLeft) * std::log(t / seconds.low) / std::log(seconds.high / seconds.low);
  }
  [[nodiscard]] double y(double value) const {
    return kBottom - (kBottom - kTop) * (value - db.low) / (db.high - db.low);
  }
};

std::vector<Point> drawable(const std::vector<Point>& points) {
  std::vector<Point> out;
  for (const auto& p : points)
    if (std::isfinite(p.seconds) && std::isfinite(p.db) && p.seconds > 1e-6 && p.seconds < 1e9 && std::abs(p.db) < 1e3)
      out.push_back(p);
  return out;
}

Axes axes_of(const std::vector<Series>& series) {
  Axes axes{{1e300, 0}, {1e300, -1e300}};
  for (const auto& s : series)
    for (const auto& p : s.points) {
      axes.seconds.low = std::min(axes.seconds.low, p.seconds);
      axes.seconds.high = std::max(axes.seconds.high, p.seconds);
      axes.db.low = std::min(axes.db.low, p.db);
      axes.db.high = std::max(axes.db.high, p.db);
    }
  // A single time or a single value still needs an axis.
  if (!(axes.seconds.high > axes.seconds.low * 1.05)) axes.seconds = {axes.seconds.low / 2, axes.seconds.low * 2};
  axes.db = {std::floor(axes.db.low - 0.25), std::ceil(axes.db.high + 0.25)};
  if (axes.db.high - axes.db.low < 2) axes.db.high = axes.db.low + 2;
  return axes;
}

std::string line(double x0, double y0, double x1, double y1, const char* kind) {
  return std::string("<line class=\"") + kind + "\" x1=\"" + coordinate(x0) + "\" y1=\"" + coordinate(y0) + "\" x2=\"" +
         coordinate(x1) + "\" y2=\"" + coordinate(y1) + "\"/>\n";
}

std::string text(double x, double y, const char* kind, const std::string& words) {
  return std::string("<text class=\"") + kind + "\" x=\"" + coordinate(x) + "\" y=\"" + coordinate(y) + "\">" +
         xml_text(words) + "</text>\n";
}

double db_step(const Range& db) {
  for (const double step : {1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0})
    if ((db.high - db.low) / step <= 10) return step;
  return 500;
}

std::string draw_axes(const Axes& axes) {
  std::string out;
  const double step = db_step(axes.db);
  for (double v = std::ceil(axes.db.low / step) * step; v <= axes.db.high + 1e-9; v += step) {
    out += line(kLeft, axes.y(v), kRight, axes.y(v), "grid");
    char words[16];
    std::snprintf(words, sizeof words, "%.0f", v);
    out += text(kLeft - 6, axes.y(v) + 4, "mark end", words);
  }
  for (const double t : log_marks(axes.seconds.low, axes.seconds.high)) {
    out += line(axes.x(t), kTop, axes.x(t), kBottom, "grid");
    out += text(axes.x(t), kBottom + 17, "mark middle", exact_text(t));
  }
  out += line(kLeft, kBottom, kRight, kBottom, "axis");
  out += text((kLeft + kRight) / 2, kBottom + 36, "mark middle", "seconds from the first camera (logarithmic)");
  out += text(kLeft - 24, 12, "mark", "dB");
  return out;
}

// Circle, square, triangle or diamond: told apart without colour.
std::string marker(double x, double y, std::size_t look) {
  const std::string kind = "\" class=\"dot s" + std::to_string(look) + "\"/>";
  const auto at = [&](double dx, double dy) { return coordinate(x + dx) + "," + coordinate(y + dy); };
  switch (look % 4) {
    case 0:
      return "<circle cx=\"" + coordinate(x) + "\" cy=\"" + coordinate(y) + "\" r=\"3.2" + kind;
    case 1:
      return "<polygon points=\"" + at(-3, -3) + " " + at(3, -3) + " " + at(3, 3) + " " + at(-3, 3) + kind;
    case 2:
      return "<polygon points=\"" + at(0, -4) + " " + at(3.6, 3) + " " + at(-3.6, 3) + kind;
    default:
      return "<polygon points=\"" + at(0, -4.2) + " " + at(4.2, 0) + " " + at(0, 4.2) + " " + at(-4.2, 0) + kind;
  }
}

std::string draw_curve(const Axes& axes, const Series& series, std::size_t look) {
  std::string path, dots;
  for (const auto& p : series.points) {
    path.append(path.empty() ? "M" : "L").append(coordinate(axes.x(p.seconds)));
    path.append(" ").append(coordinate(axes.y(p.db)));
    dots += marker(axes.x(p.seconds), axes.y(p.db), look);
  }
  return "<g>\n<path class=\"curve s" + std::to_string(look) + "\" d=\"" + path + "\"/>\n" + dots + "\n</g>\n";
}

// Names stand beside the last points, moved apart where they would cover each other.
std::string draw_names(const Axes& axes, const std::vector<Series>& series) {
  struct Name {
    double wanted = 0, y = 0, x = 0;
    std::size_t look = 0;
    const Series* of = nullptr;
  };
  std::vector<Name> names;
  for (std::size_t i = 0; i < series.size(); ++i)
    if (const auto& points = series[i].points; !points.empty()) {
      const double y = axes.y(points.back().db);
      names.push_back({y, y, axes.x(points.back().seconds), i % kLooks, &series[i]});
    }
  std::stable_sort(names.begin(), names.end(), [](const Name& a, const Name& b) { return a.wanted < b.wanted; });
  for (std::size_t i = 1; i < names.size(); ++i) names[i].y = std::max(names[i].y, names[i - 1].y + kLabelStep);
  double floor = kBottom;
  for (std::size_t i = names.size(); i-- > 0; floor = names[i].y - kLabelStep) names[i].y = std::min(names[i].y, floor);
  std::string out;
  for (const auto& n : names) {
    const std::string look = std::to_string(n.look);
    out += line(n.x + 5, n.wanted, kRight + 12, n.y, ("lead s" + look).c_str());
    out += marker(kRight + 18, n.y, n.look);
    out += text(kRight + 27, n.y + 4, "name", n.of->label);
  }
  return out;
}

}  // namespace

std::vector<double> log_marks(double low, double high) {
  std::vector<double> marks;
  if (!(low > 0) || !(high > low) || !std::isfinite(high)) return marks;
  for (int decade = static_cast<int>(std::floor(std::log10(low))); decade <= std::log10(high); ++decade)
    for (const int digit : {1, 2, 5}) {
      const double value = decade >= 0 ? digit * std::pow(10.0, decade) : digit / std::pow(10.0, -decade);
      if (value >= low * 0.999 && value <= high * 1.001) marks.push_back(value);
    }
  if (marks.size() <= 12) return marks;
  const auto is_decade = [](double m) { return std::abs(std::log10(m) - std::round(std::log10(m))) < 1e-9; };
  std::erase_if(marks, [&](double m) { return !is_decade(m); });
  const std::size_t every = marks.size() / 12 + 1;
  std::vector<double> out;
  for (std::size_t i = 0; i < marks.size(); i += every) out.push_back(marks[i]);
  return out;
}

std::string svg_chart(const Chart& chart, bool standalone) {
  auto series = chart.series;
  for (auto& s : series) s.points = drawable(s.points);
  const bool any = std::any_of(series.begin(), series.end(), [](const Series& s) { return !s.points.empty(); });
  const std::string id = xml_text(chart.id);
  std::string out = "<svg xmlns=\"http://www.w3.org/2000/svg\" class=\"chart\" viewBox=\"0 0 " + coordinate(kWidth) +
                    " " + coordinate(kHeight) + "\" role=\"img\" aria-labelledby=\"" + id + "-t " + id + "-d\">\n";
  out += "<title id=\"" + id + "-t\">" + xml_text(chart.title) + "</title>\n";
  out += "<desc id=\"" + id + "-d\">" + xml_text(chart.description) + "</desc>\n";
  if (standalone) {
    out += "<style>" + chart_style() + "</style>\n";
    out += "<rect class=\"paper\" width=\"" + coordinate(kWidth) + "\" height=\"" + coordinate(kHeight) + "\"/>\n";
  }
  if (!any) return out + text(kWidth / 2, kHeight / 2, "mark middle", "no measurements") + "</svg>\n";
  const Axes axes = axes_of(series);
  out += draw_axes(axes);
  for (std::size_t i = 0; i < series.size(); ++i)
    if (!series[i].points.empty()) out += draw_curve(axes, series[i], i % kLooks);
  return out + draw_names(axes, series) + "</svg>\n";
}

// Hues after Okabe and Ito (Color Universal Design, 2008), darker on white, lighter on black.
std::string chart_style() {
  return R"(
.chart{--paper:#fff;--ink:#1c1e21;--soft:#5a6068;--grid:#e3e6ea;--s0:#0063a0;--s1:#b84300;--s2:#00785a;--s3:#a8467f;--s4:#8f6200;--s5:#2b87b8;--s6:#4a4f57}
@media (prefers-color-scheme:dark){.chart{--paper:#14171a;--ink:#eceef0;--soft:#a8b0b9;--grid:#2b3137;--s0:#5ab4f0;--s1:#ff8f4a;--s2:#35c99c;--s3:#eba3cb;--s4:#f0bd3a;--s5:#a5dcf7;--s6:#b7bec7}}
.chart{font:13px system-ui,sans-serif}
.chart .paper{fill:var(--paper)}.chart .grid{stroke:var(--grid);stroke-width:1}.chart .axis{stroke:var(--soft);stroke-width:1}
.chart text{fill:var(--ink)}.chart .mark{fill:var(--soft);font-size:12px}.chart .middle{text-anchor:middle}.chart .end{text-anchor:end}
.chart .curve{fill:none;stroke-width:2.2;stroke-linejoin:round}.chart .lead{stroke-width:1;opacity:.55;stroke-dasharray:2 3}
.chart .dot{stroke:none}
.chart .s0{stroke:var(--s0)}.chart .s1{stroke:var(--s1)}.chart .s2{stroke:var(--s2)}.chart .s3{stroke:var(--s3)}.chart .s4{stroke:var(--s4)}.chart .s5{stroke:var(--s5)}.chart .s6{stroke:var(--s6)}
.chart .dot.s0{fill:var(--s0)}.chart .dot.s1{fill:var(--s1)}.chart .dot.s2{fill:var(--s2)}.chart .dot.s3{fill:var(--s3)}.chart .dot.s4{fill:var(--s4)}.chart .dot.s5{fill:var(--s5)}.chart .dot.s6{fill:var(--s6)}
)";
}

}  // namespace darm::accuracy

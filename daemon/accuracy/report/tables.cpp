#include "daemon/accuracy/report/tables.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "daemon/accuracy/report/curve.hpp"
#include "daemon/accuracy/report/origin.hpp"
#include "daemon/accuracy/report/text.hpp"

namespace darm::accuracy {
namespace {

using Curves = std::vector<const Measurement*>;

std::optional<double> figure_of(const Measurement& m, const char* name) {
  const auto it = m.figures.find(name);
  return it == m.figures.end() ? std::nullopt : std::optional(it->second);
}

template <class Format>
std::string or_nothing(const std::optional<double>& value, const Format& format) {
  return value ? format(*value) : std::string(kNothing);
}

const Measurement* balanced(const Report& report, const std::string& camera) {
  return report.find(camera, Group::kPresets, kBalanced);
}

const Measurement* frames(const Report& report, const std::string& camera) {
  return report.find(camera, Group::kFrames, kCameraFrames);
}

// The group's variants between balanced and camera frames: every curve is read beside both.
Curves curves_of(const Report& report, const std::string& camera, Group group) {
  Curves out;
  const auto add = [&](const Measurement* m) {
    if (m != nullptr && !m->curve.empty() && std::find(out.begin(), out.end(), m) == out.end()) out.push_back(m);
  };
  add(balanced(report, camera));
  for (const auto& m : report.measurements)
    if (m.camera == camera && m.group == group) add(&m);
  add(frames(report, camera));
  return out;
}

// Highest whole decibel that both curves reach.
std::optional<double> common_db(const Measurement& a, const Measurement& b) {
  if (a.curve.empty() || b.curve.empty()) return std::nullopt;
  return std::floor(std::min(a.curve.back().db, b.curve.back().db));
}

std::string against_frames(const Measurement& m, const Measurement* plain) {
  if (plain == nullptr || plain == &m) return kNothing;
  const auto db = common_db(m, *plain);
  const auto ratio = db ? time_ratio(plain->curve, m.curve, *db) : std::nullopt;
  return ratio ? ratio_text(*ratio) + " times, to " + db_text(*db) + " dB" : std::string(kNothing);
}

// Says of each row where it comes from, if one of them is apart. `from`: the rows' results, in order.
void add_origins(Table& table, const Curves& from, const Origins& origins) {
  if (std::none_of(from.begin(), from.end(), [&](const Measurement* m) { return origins.is_apart(*m); })) return;
  table.columns.emplace_back("measured");
  for (std::size_t i = 0; i < from.size(); ++i) table.rows[i].push_back(origins.words_of(*from[i]));
}

Curves group_of_camera(const Report& report, const std::string& camera, Group group) {
  Curves out;
  for (const auto& m : report.measurements)
    if (m.camera == camera && m.group == group) out.push_back(&m);
  return out;
}

Table ends_table(const Curves& curves, const Measurement* plain, const Origins& origins) {
  Table table{
      "Where each variant ends",
      {"variant", "dB", "after, s", "first picture, s", "dB without codec", "samples", "stream", "camera frames take"},
      {}};
  for (const auto* m : curves) {
    const auto& last = m->curve.back();
    const std::string unit = m == plain ? " a pixel" : "";
    const auto done = figure_of(*m, figure::kStoppedEarly);
    table.rows.push_back({origins.name_of(*m), db_text(last.db),
                          seconds_text(done.value_or(last.seconds)) + (done ? ", done" : ""),
                          seconds_text(m->curve.front().seconds), or_nothing(figure_of(*m, figure::kLightDb), db_text),
                          count_text(last.samples) + unit, or_nothing(figure_of(*m, figure::kBytes), bytes_text),
                          against_frames(*m, plain)});
  }
  add_origins(table, curves, origins);
  return table;
}

// Lowest and highest whole decibel that a curve of these passes.
std::optional<std::pair<int, int>> decibels_of(const Curves& curves) {
  // What is outside of this is no picture's error.
  constexpr double kLeast = -10, kMost = 110;
  double low = kMost, high = kLeast;
  for (const auto* m : curves) {
    const double first = m->curve.front().db, last = m->curve.back().db;
    if (!std::isfinite(first) || !std::isfinite(last)) continue;
    low = std::min(low, std::ceil(std::clamp(first, kLeast, kMost)));
    high = std::max(high, std::floor(std::clamp(last, kLeast, kMost)));
  }
  return low <= high ? std::optional(std::pair(static_cast<int>(low), static_cast<int>(high))) : std::nullopt;
}

// When a curve gets to `db`; "at once": its first picture is there already.
std::string reached_words(const Measurement& m, int db) {
  if (m.curve.front().db >= db && time_to(m.curve, db) == m.curve.front().seconds) return "at once";
  return or_nothing(time_to(m.curve, db), seconds_text);
}

std::optional<double> price_of(const Measurement& m, int to) {
  for (const auto& p : decibel_prices(m.curve))
    if (p.db + 1 == to) return p.seconds;
  return std::nullopt;
}

// Time to each whole decibel, and in brackets what it cost beyond the one before.
Table price_table(const Curves& curves, const Origins& origins) {
  Table table{"Seconds to each whole decibel (and the price of that decibel)", {"dB"}, {}};
  for (const auto* m : curves) table.columns.push_back(origins.name_of(*m));
  const auto range = decibels_of(curves);
  for (int db = range ? range->first : 0; range && db <= range->second; ++db) {
    std::vector<std::string> row{std::to_string(db)};
    for (const auto* m : curves) {
      const auto price = price_of(*m, db);
      row.push_back(reached_words(*m, db) + (price ? " (+" + seconds_text(*price) + ")" : ""));
    }
    table.rows.push_back(std::move(row));
  }
  return table;
}

// What the plain alternative asks for each decibel, beside ours.
Table alternative_table(const Measurement& ours, const Measurement& plain, const Origins& origins) {
  const char* apart = origins.is_apart(ours) || origins.is_apart(plain) ? " *" : "";
  Table table{std::string("Price of each further decibel: the atlas and camera frames") + apart,
              {"dB", "atlas, s", "its price, s", "camera frames, s", "their price, s", "camera frames / atlas"},
              {}};
  const auto range = decibels_of({&ours, &plain});
  for (int db = range ? range->first : 0; range && db <= range->second; ++db)
    table.rows.push_back({std::to_string(db), reached_words(ours, db), or_nothing(price_of(ours, db), seconds_text),
                          reached_words(plain, db), or_nothing(price_of(plain, db), seconds_text),
                          or_nothing(time_ratio(plain.curve, ours.curve, db), ratio_text)});
  return table;
}

Table codec_table(const Curves& curves, const Origins& origins) {
  Table table{"The same light through the codec",
              {"quality", "codec, first picture, dB", "codec, last picture, dB", "dB to the reference",
               "until the first picture", "whole stream", "a frame, ms"},
              {}};
  for (const auto* result : curves) {
    const auto& m = *result;
    const auto milliseconds = figure_of(m, figure::kEncodeSeconds);
    table.rows.push_back({origins.name_of(m), or_nothing(figure_of(m, figure::kFirstCodecDb), db_text),
                          or_nothing(figure_of(m, figure::kLastCodecDb), db_text),
                          m.curve.empty() ? kNothing : db_text(m.curve.back().db),
                          or_nothing(figure_of(m, figure::kFirstBytes), bytes_text),
                          or_nothing(figure_of(m, figure::kBytes), bytes_text),
                          milliseconds ? seconds_text(*milliseconds * 1e3) : kNothing});
  }
  add_origins(table, curves, origins);
  return table;
}

std::string without_words(const Measurement& m) {
  const auto db = figure_of(m, figure::kWithoutDb);
  if (!db) return kNothing;
  return (figure_of(m, figure::kAtLeast).value_or(0) > 0 ? "over " : "") + db_text(*db);
}

std::string saving_words(const Measurement& m) {
  const auto with = figure_of(m, figure::kSecondsWith), without = figure_of(m, figure::kSecondsWithout);
  if (!with || !without || !(*with > 0)) return kNothing;
  return ratio_text(100 * (*with - *without) / *with) + " %";
}

Table effects_table(const Curves& curves, const Origins& origins) {
  Table table{
      "Leaving an effect out, measured on camera frames",
      {"left out", "picture without it, dB", "a sample per pixel without, s", "with, s", "its share of the time"},
      {}};
  for (const auto* m : curves)
    table.rows.push_back({origins.name_of(*m), without_words(*m),
                          or_nothing(figure_of(*m, figure::kSecondsWithout), seconds_text),
                          or_nothing(figure_of(*m, figure::kSecondsWith), seconds_text), saving_words(*m)});
  add_origins(table, curves, origins);
  return table;
}

// By number: names of cameras may be anything.
std::string id_of(const Report& report, const std::string& camera, Group group) {
  std::size_t number = 0;
  while (number < report.cameras.size() && report.cameras[number].name != camera) ++number;
  return "camera" + std::to_string(number + 1) + "-" + name_of(group);
}

std::string heading_of(Group group) {
  switch (group) {
    case Group::kPresets:
      return "Presets";
    case Group::kDensity:
      return "Texel density q";
    case Group::kSamples:
      return "Samples per texel";
    case Group::kIndirect:
      return "Where paths end";
    case Group::kFilter:
      return "Filter of soft light";
    case Group::kLayers:
      return "Private layer";
    case Group::kFrames:
      return "The plain alternative";
    case Group::kCodec:
      return "Codec quality";
    default:
      return "Effects";
  }
}

std::string words_of(Group group) {
  switch (group) {
    case Group::kPresets:
      return "What the three presets of [accuracy] give in the same time.";
    case Group::kDensity:
      return "Half and twice the texels per metre. A denser atlas has the higher ceiling and the later start.";
    case Group::kSamples:
      return "No texel takes more samples than this: how far a fixed budget goes, and what it takes.";
    case Group::kIndirect:
      return "Paths that end in stored light (balanced) beside paths traced to their end, which are unbiased.";
    case Group::kFilter:
      return "Soft light of few samples averaged within its patch (balanced), and not.";
    case Group::kLayers:
      return "The same shared light while the session also has what depends on its eye shaded: what the private layer "
             "costs the shared picture in time.";
    case Group::kFrames:
      return "The same integrator tracing camera frames on the same threads.";
    case Group::kCodec:
      return "One recorded run of the balanced preset, coded again at each constant rate factor. Codec dB: the drawn "
             "view after the codec against before. The first picture is the first of which half is tiles: what is "
             "coarser does not go through this codec.";
    default:
      return "The reference tracer with and without, eight samples a pixel each. The difference is taken between two "
             "pairs of independent halves, so that noise cancels; within two standard errors it is given as a bound. "
             "Seconds are processor time by threads.";
  }
}

Chart chart_of(const Report& report, const std::string& camera, Group group, const Curves& curves,
               const Origins& origins) {
  Chart chart{id_of(report, camera, group),
              heading_of(group) + ", camera " + camera,
              "PSNR against the reference over seconds, logarithmic.",
              {}};
  for (const auto* m : curves) {
    chart.series.push_back({origins.name_of(*m), m->curve});
    chart.description += " " + origins.name_of(*m) + ": " + db_text(m->curve.back().db) + " dB after " +
                         seconds_text(m->curve.back().seconds) + " s.";
  }
  return chart;
}

}  // namespace

std::vector<Section> sections_of(const Report& report, const std::string& camera) {
  std::vector<Section> sections;
  const auto* plain = frames(report, camera);
  const auto* ours = balanced(report, camera);
  const Origins origins(report);
  for (int g = 0; g < kGroups; ++g) {
    const auto group = static_cast<Group>(g);
    const auto measured = group_of_camera(report, camera, group);
    if (measured.empty()) continue;
    Section section{heading_of(group), words_of(group), {}, {}};
    if (group == Group::kCodec) {
      section.tables.push_back(codec_table(measured, origins));
    } else if (group == Group::kEffects) {
      section.tables.push_back(effects_table(measured, origins));
    } else if (const auto curves = curves_of(report, camera, group); !curves.empty()) {
      section.chart = chart_of(report, camera, group, curves, origins);
      section.tables.push_back(ends_table(curves, plain, origins));
      section.tables.push_back(group == Group::kFrames && ours != nullptr && plain != nullptr
                                   ? alternative_table(*ours, *plain, origins)
                                   : price_table(curves, origins));
    }
    sections.push_back(std::move(section));
  }
  return sections;
}

Table plan_table(const Report& report) {
  Table table{"What the scene calls for", {"effect", "needed", "why"}, {}};
  const bool costs = std::ranges::any_of(report.plan, [](const PlannedEffect& e) { return !e.cost.empty(); });
  if (costs) table.columns.emplace_back("cost");
  for (const auto& effect : report.plan) {
    table.rows.push_back({effect.name, effect.needed ? "yes" : "no", effect.reason});
    if (costs) table.rows.back().push_back(effect.cost.empty() ? kNothing : effect.cost);
  }
  return table;
}

std::vector<std::string> method_words(const Report& report) {
  return {
      "Each atlas run starts a tile scheduler, a renderer and an H.264 encoder, wired as darmd serve wires them, on "
      "an empty radiance store. The clock starts with the first camera, which then rests. What goes out to the "
      "session is recorded and drawn afterwards, in software, as a client draws it: four samples a pixel, the page "
      "table, three coarser levels, CoarseTex, decoded slots. Drawing and error do not run while the clock does.",
      "Error is the RMS difference of display RGB (0 to 1), dB is -20 log10 of it, against the view-independent "
      "reference picture of darmd render: mean((a - r1)(a - r2)) over its two independent halves, so that the "
      "reference's noise cancels. Pixels that show the sky, or a surface that is seen through, are left out for atlas "
      "and camera frames alike.",
      "Camera frames are traced by the reference renderer with the same integrator on the same number of threads (" +
          std::to_string(report.threads) + "); their clock counts rendering alone.",
      "Not measured here: the network, geometry on its way to a client, decoding and drawing on a client. darm-bench "
      "time-to-quality measures those. Not in the error: what depends on the eye, which has its own layer."};
}

}  // namespace darm::accuracy

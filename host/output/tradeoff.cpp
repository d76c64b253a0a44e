// What a measurement of accuracy against time is written as: CSV, JSON, Markdown, a plot.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "clrad/error.hpp"
#include "clrad/output.hpp"
#include "clrad/tradeoff.hpp"
#include "output/gnuplot.hpp"
#include "version.hpp"

namespace clrad {
namespace {

using Json = nlohmann::ordered_json;

const char* estimator_text(Estimator e) {
  return e == Estimator::disk ? "disk" : e == Estimator::subdisk ? "subdisk" : "exact";
}

const char* precision_text(Precision p) {
  return p == Precision::float64 ? "double" : "float";
}

// What a spreadsheet reads as a number, or nothing.
std::string csv_number(double x) {
  return std::isfinite(x) ? fmt::format("{:.6g}", x) : "";
}

std::string csv_text(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? "\"\"" : std::string(1, c);
  return quoted + "\"";
}

Json setting_json(const TradeoffSetting& s) {
  const SolveOptions& o = s.options;
  return {{"kind", s.kind},
          {"name", s.name},
          {"patch_edge_m", o.mesh.patch_edge_m},
          {"element_edge_m", o.mesh.element_edge_m},
          {"samples", o.samples},
          {"light_samples", o.light_samples},
          {"visibility_exact", o.visibility_exact},
          {"sensor_rays", o.sensor_rays},
          {"converge", o.converge},
          {"form_factor", estimator_text(o.estimator)},
          {"adaptive", o.adaptive.tolerance},
          {"max_level", o.adaptive.max_level},
          {"near_field", o.near_field},
          {"engine", o.engine},
          {"target_error_relative", o.target_error},
          {"precision", precision_text(s.precision)}};
}

std::string percent(double relative) {
  return std::isnan(relative) ? "" : fmt::format("{:.3g} %", 100 * relative);
}

std::string seconds_short(double s) {
  return s < 0.0995  ? fmt::format("{:.3f} s", s)
         : s < 0.995 ? fmt::format("{:.2f} s", s)
         : s < 9.95  ? fmt::format("{:.1f} s", s)
                     : fmt::format("{:.0f} s", s);
}

// ---- the plot ----------------------------------------------------------------------------------------------------------
// Kinds of one look.
struct Look {
  std::vector<std::string> kinds;
  const char* title;
  const char* color;
  int shape;  // filled; the hollow one of the same outline is one less
};

const std::vector<Look>& looks() {
  static const std::vector<Look> all = {
      {{"ladder"}, "mesh and samples together", "#222222", 7},
      {{"patches"}, "patch size", "#d98324", 11},
      {{"elements"}, "element size", "#3f8f3f", 9},
      {{"adaptive"}, "adaptive subdivision", "#8a55a8", 13},
      {{"samples", "light samples", "visibility"}, "samples, exact visibility", "#2473b5", 5},
      {{"sensor rays"}, "rays from sensors", "#20a0a0", 15},
      {{"estimator"}, "form factor disk or subdisk", "#c8362f", 15},
      {{"target"}, "--target-error 5, 1, 0.3 %", "#d6246e", 13},
      {{"convergence"}, "convergence", "#b59b00", 5},
      {{"precision", "engine", "near field"}, "precision, engine, near field", "#888888", 7}};
  return all;
}

bool has_look(const Look& look, const TradeoffRun& run) {
  return std::find(look.kinds.begin(), look.kinds.end(), run.setting.kind) != look.kinds.end();
}

bool drawable(const TradeoffRun& run) {
  return run.rms_relative > 0 && run.seconds > 0;
}

std::string plot_data(const Tradeoff& t) {
  std::string data =
      "# seconds, true error [%], the solve's own estimate [%] (nan: none), setting; first the front\n";
  const auto line = [&](const TradeoffRun& r) {
    data += fmt::format("{:.6g} {:.6g} {:.6g} \"{} ({})\"\n", r.seconds, 100 * r.rms_relative,
                        100 * r.estimate_relative, r.setting.name, r.setting.kind);
  };
  for (const std::size_t i : t.front)
    if (drawable(t.runs[i])) line(t.runs[i]);
  for (const Look& look : looks()) {
    const bool any = std::any_of(t.runs.begin(), t.runs.end(),
                                 [&](const TradeoffRun& r) { return has_look(look, r) && drawable(r); });
    if (!any) continue;
    data += fmt::format("\n\n# {}\n", look.title);
    for (const TradeoffRun& r : t.runs)
      if (has_look(look, r) && drawable(r)) line(r);
  }
  return data;
}

// Ends of an axis with some room around the values: on 1, 2 or 5.
std::pair<double, double> axis(double low, double high) {
  low /= 1.3, high *= 1.3;
  const auto nice = [](double x, bool up) {
    double best = NAN;
    const int decade = int(std::floor(std::log10(x)));
    for (int d = decade - 1; d <= decade + 1; ++d)
      for (const int digit : {1, 2, 5}) {
        const double v = std::stod(fmt::format("{}e{}", digit, d));
        if (up ? v >= x && !(v >= best) : v <= x && !(v <= best)) best = v;
      }
    return best;
  };
  return {nice(low, false), nice(high, true)};
}

std::string plot_script(const Tradeoff& t) {
  double x0 = INFINITY, x1 = 0, y0 = INFINITY, y1 = 0;
  double true_low = INFINITY, true_high = 0;
  bool estimates = false;
  for (const TradeoffRun& r : t.runs) {
    if (!drawable(r)) continue;
    true_low = std::min(true_low, 100 * r.rms_relative),
    true_high = std::max(true_high, 100 * r.rms_relative);
    x0 = std::min(x0, r.seconds), x1 = std::max(x1, r.seconds);
    y0 = std::min(y0, 100 * r.rms_relative), y1 = std::max(y1, 100 * r.rms_relative);
    if (!(r.estimate_relative > 0)) continue;
    estimates = true;
    y0 = std::min(y0, 100 * r.estimate_relative), y1 = std::max(y1, 100 * r.estimate_relative);
  }
  if (!(x1 > 0)) return "";
  // An estimate far off runs out of the picture, rather than make it unreadable.
  y0 = std::max(y0, true_low / 10), y1 = std::min(y1, true_high * 10);
  const auto [low_x, high_x] = axis(x0, x1);
  const auto [low_y, high_y] = axis(y0, y1);
  const std::string scene = std::filesystem::path(t.scene).filename().string();
  std::string script = fmt::format(
      "# gnuplot tradeoff.gnuplot, in this folder, draws tradeoff.png and tradeoff.svg from tradeoff.dat\n"
      "set encoding utf8\n"
      "set label 1 '{}' at graph 0, screen 0.965 font ',17' noenhanced\n"
      "set label 2 '{}' at graph 0, screen 0.925 font ',11' tc rgb '#555555' noenhanced\n"
      "set lmargin at screen 0.085\nset rmargin at screen 0.705\nset tmargin at screen 0.89\nset bmargin at "
      "screen 0.105\n"
      "set logscale xy\nset xrange "
      "[{:g}:{:g}]\nset yrange [{:g}:{:g}]\n"
      "set xtics {} nomirror tc rgb '#333333'\nset ytics {} nomirror tc rgb '#333333'\n"
      "set mxtics 10\nset mytics 10\n"
      "set grid xtics ytics lc rgb '#d8d8d8' lt 1 lw 0.7\nset border 3 lc rgb '#666666'\n"
      "set xlabel 'time to solve' offset 0,0.2\nset ylabel 'RMS error of irradiance, relative to its mean' "
      "offset 0.3,0\n"
      "set key at screen 0.725, screen 0.885 left top Left reverse vertical spacing 1.35 samplen 2 font "
      "',11' noenhanced\n",
      gnuplot_text("What accuracy costs: " + scene),
      gnuplot_text(fmt::format("{}; error at {} {}", t.device, t.points,
                               t.at_sensors ? "sensors" : "points of the surfaces")),
      low_x, high_x, low_y, high_y, log_ticks(low_x, high_x, " s"), log_ticks(low_y, high_y, " %"));
  for (const TradeoffAdvice& a : t.advice) {
    if (a.run == SIZE_MAX || !drawable(t.runs[a.run])) continue;
    script += fmt::format(
        "set arrow from {1:.6g}, {0:g} to graph 1, first {0:g} nohead lc rgb '#999999' dt 3 lw 1\n",
        std::clamp(100 * a.target_relative, low_y, high_y), t.runs[a.run].seconds);
    if (100 * a.target_relative <= high_y && 100 * a.target_relative >= low_y)
      script += fmt::format(
          "set label '{} costs {}' at graph 0.99, first {:g} right offset 0,0.5 font ',10' tc rgb "
          "'#444444'\n",
          percent(a.target_relative), seconds_short(t.runs[a.run].seconds), 100 * a.target_relative);
  }
  std::vector<std::string> plots;
  const double own = 100 * t.reference.error_relative;
  if (own > low_y && own < high_y)
    plots.push_back(
        fmt::format("{:g} with lines lc rgb '#aaaaaa' dt 2 lw 1 title 'error of the reference itself'", own));
  plots.emplace_back(
      "'tradeoff.dat' index 0 using 1:2 with lines lc rgb '#222222' lw 2.2 title 'front: best for its time'");
  std::vector<std::string> estimated;
  int index = 0;
  for (const Look& look : looks()) {
    if (std::none_of(t.runs.begin(), t.runs.end(),
                     [&](const TradeoffRun& r) { return has_look(look, r) && drawable(r); }))
      continue;
    ++index;
    if (estimates) {
      estimated.push_back(fmt::format(
          "'tradeoff.dat' index {} using 1:2:(0):($3-$2) with vectors nohead lc rgb '{}' lw 0.6 notitle",
          index, look.color));
      estimated.push_back(
          fmt::format("'tradeoff.dat' index {} using 1:3 with points pt {} ps 0.9 lw 1 lc rgb '{}' notitle",
                      index, look.shape - 1, look.color));
    }
    plots.push_back(
        fmt::format("'tradeoff.dat' index {} using 1:2 with points pt {} ps 1.25 lc rgb '{}' title '{}'",
                    index, look.shape, look.color, look.title));
  }
  plots.insert(plots.begin(), estimated.begin(), estimated.end());
  if (estimates)
    plots.emplace_back(
        "NaN with points pt 6 ps 0.9 lw 1 lc rgb '#555555' title 'hollow: as the solve estimates it'");
  std::string plot = "plot ";
  for (std::size_t i = 0; i < plots.size(); ++i) plot += (i ? ", \\\n     " : "") + plots[i];
  return script +
         "set terminal pngcairo size 1100,640 font 'DejaVu Sans,12' linewidth 1.2\nset output "
         "'tradeoff.png'\n" +
         plot +
         "\nset terminal svg size 1100,640 font 'DejaVu Sans,12' linewidth 1.2 background rgb 'white'\n"
         "set output 'tradeoff.svg'\nreplot\n";
}

}  // namespace

std::string tradeoff_csv(const Tradeoff& t) {
  std::string csv =
      "kind,setting,seconds,rms_relative,estimate_relative,on_front,limited_by_reference,patch_edge_m,"
      "element_edge_m,"
      "samples,light_samples,sensor_rays,converge,form_factor,adaptive,max_level,near_field,visibility_exact,"
      "engine,precision,"
      "target_error_relative,"
      "patches,"
      "elements,vertices,rays,device_peak_bytes,predicted_s\n";
  for (const TradeoffRun& r : t.runs) {
    const SolveOptions& o = r.setting.options;
    csv += fmt::format(
        "{},{},{},{},{},{},{},{:.6g},{:.6g},{},{},{},{:g},{},{:g},{},{},{},{},{},{:g},{},{},{},{},{},{}\n",
        r.setting.kind, csv_text(r.setting.name), csv_number(r.seconds), csv_number(r.rms_relative),
        csv_number(r.estimate_relative), int(r.on_front), int(r.limited_by_reference), o.mesh.patch_edge_m,
        o.mesh.element_edge_m, o.samples, o.light_samples, o.sensor_rays, o.converge,
        estimator_text(o.estimator), o.adaptive.tolerance, o.adaptive.max_level, int(o.near_field),
        int(o.visibility_exact), o.engine, precision_text(r.setting.precision), o.target_error, r.patches,
        r.elements, r.vertices, r.rays, r.device_peak_bytes, csv_number(r.predicted_s));
  }
  return csv;
}

std::string tradeoff_json(const Tradeoff& t) {
  Json json;
  json["schema"] = "clrad-tradeoff-1";
  json["program"] = {{"version", version}, {"commit", commit}};
  json["scene"] = {{"file", t.scene},
                   {"quantity", t.quantity == Quantity::photometric ? "photometric" : "radiometric"},
                   {"bands", t.bands},
                   {"extent_m", t.extent_m}};
  json["device"] = {{"name", t.device}, {"driver", t.driver}};
  json["points"] = {{"count", t.points}, {"at", t.at_sensors ? "sensors" : "surfaces"}};
  json[t.quantity == Quantity::photometric ? "mean_irradiance_lm_m2" : "mean_irradiance_W_m2"] =
      t.mean_irradiance;
  json["reference"] = {{"what", t.reference.what},
                       {"error_relative", t.reference.error_relative},
                       {"seconds", t.reference.seconds}};
  json["budget_s"] = t.budget_s, json["seconds"] = t.seconds, json["stopped"] = t.stopped;
  json["settings"] = Json::array();
  for (const TradeoffRun& r : t.runs) {
    Json row = setting_json(r.setting);
    row["arguments"] = solve_arguments(r.setting, t.at_sensors);
    row["seconds"] = r.seconds, row["predicted_s"] = r.predicted_s;
    row["rms_relative"] = r.rms_relative, row["estimate_relative"] = r.estimate_relative;
    row["limited_by_reference"] = r.limited_by_reference, row["on_front"] = r.on_front;
    row["patches"] = r.patches, row["elements"] = r.elements, row["vertices"] = r.vertices,
    row["rays"] = r.rays;
    row["device_peak_bytes"] = r.device_peak_bytes;
    json["settings"].push_back(std::move(row));
  }
  json["middle"] = t.middle == SIZE_MAX ? Json(nullptr) : Json(t.middle);
  json["front"] = t.front;
  json["advice"] = Json::array();
  for (const TradeoffAdvice& a : t.advice) {
    Json row{{"target_relative", a.target_relative}, {"setting", nullptr}};
    if (a.run != SIZE_MAX) {
      row["setting"] = a.run, row["seconds"] = t.runs[a.run].seconds,
      row["rms_relative"] = t.runs[a.run].rms_relative;
      row["arguments"] = solve_arguments(t.runs[a.run].setting, t.at_sensors);
    }
    json["advice"].push_back(std::move(row));
  }
  json["left_out"] = Json::array();
  for (const TradeoffLeftOut& l : t.left_out) {
    Json row = setting_json(l.setting);
    row["predicted_s"] = l.predicted_s, row["reason"] = l.reason;
    json["left_out"].push_back(std::move(row));
  }
  // A NaN is written as null.
  return json.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

std::string tradeoff_markdown(const Tradeoff& t) {
  std::string text = fmt::format(
      "{} {} on {}. Reference: {}{}.\n\n", t.points, t.at_sensors ? "sensors" : "points of the surfaces",
      t.device, t.reference.what,
      t.reference.error_relative > 0 ? fmt::format(" (about {})", percent(t.reference.error_relative)) : "");
  text += "| error | time | settings that do it |\n|---|---|---|\n";
  for (const TradeoffAdvice& a : t.advice)
    text += a.run == SIZE_MAX ? fmt::format("| {} | not reached | |\n", percent(a.target_relative))
                              : fmt::format("| {} | {} | `{}` |\n", percent(a.target_relative),
                                            seconds_short(t.runs[a.run].seconds),
                                            solve_arguments(t.runs[a.run].setting, t.at_sensors));
  text +=
      "\n| setting | patches | elements | rays | time | true error | own estimate "
      "|\n|---|---|---|---|---|---|---|\n";
  const auto row = [&](std::size_t i) {
    const TradeoffRun& r = t.runs[i];
    const bool bold = r.on_front;
    text += fmt::format("| {}{} | {} | {} | {:.2g} M | {} | {}{}{} | {} |\n", r.setting.name,
                        i == t.middle ? " (middle)" : "", r.patches, r.elements, double(r.rays) / 1e6,
                        seconds_short(r.seconds), bold ? "**" : "", percent(r.rms_relative), bold ? "**" : "",
                        percent(r.estimate_relative));
  };
  std::vector<std::string> kinds;
  for (const TradeoffRun& r : t.runs)
    if (std::find(kinds.begin(), kinds.end(), r.setting.kind) == kinds.end()) kinds.push_back(r.setting.kind);
  std::stable_partition(kinds.begin(), kinds.end(), [](const std::string& k) { return k == "ladder"; });
  for (const std::string& kind : kinds)
    for (std::size_t i = 0; i < t.runs.size(); ++i)
      if (t.runs[i].setting.kind == kind) row(i);
  return text;
}

std::vector<std::string> write_tradeoff(const std::string& folder, const Tradeoff& t) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw DeviceError(fmt::format("cannot make the folder {}: {}", folder, error.message()));
  std::vector<std::string> written;
  const auto write = [&](const std::string& name, const std::string& text) {
    write_file(folder + "/" + name, text);
    written.push_back(folder + "/" + name);
  };
  write("tradeoff.csv", tradeoff_csv(t));
  write("tradeoff.json", tradeoff_json(t));
  write("tradeoff.md", tradeoff_markdown(t));
  const std::string data = plot_data(t), script = plot_script(t);
  if (script.empty()) return written;
  write("tradeoff.dat", data);
  write("tradeoff.gnuplot", script);
  if (draw_with_gnuplot(folder, {{"tradeoff.dat", data}, {"tradeoff.gnuplot", script}}, "tradeoff.gnuplot",
                        {"tradeoff.png", "tradeoff.svg"})) {
    written.push_back(folder + "/tradeoff.png");
    written.push_back(folder + "/tradeoff.svg");
  }
  return written;
}

}  // namespace clrad

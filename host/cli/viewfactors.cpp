#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <filesystem>
#include <memory>

#include "cli/cli.hpp"
#include "cli/progress.hpp"
#include "clrad/view_factors.hpp"

namespace clrad::cli {
namespace {

constexpr const char* description =
    "view factors between all faces of a scene, with what stands between them: the share of what one face "
    "sends out "
    "that arrives at another";

constexpr const char* help =
    "Example:\n"
    "  clrad viewfactors room.obj -o room.npz\n"
    "  python3 -c 'import scipy.sparse as s; F = s.load_npz(\"room.npz\"); print(F.sum(axis=1))'\n"
    "writes the matrix F (row: from, column: to), and room.json with names, areas, row sums and errors of "
    "the rows, in "
    "the order of the file. Formats, by the ending of the name:\n"
    "  .mtx         MatrixMarket (names and areas in comments)\n"
    "  .npz         SciPy's sparse CSR, with arrays area_m2, emissivity, error, row_sum and name beside it\n"
    "  .vf, .txt    View3D's text: areas, the full square matrix, emissivities\n"
    "Faces are one-sided and hide from both sides. Each entry has an error estimate; --target-error is what "
    "is asked of "
    "it, relative to the entry (entries below 0.001 that something partly hides: to 0.001). In a closed "
    "scene every row "
    "sums to 1, and how far each is off is printed and in the JSON.\n"
    "Double precision is the default here, where the device has it: single precision cannot do better than "
    "about 1e-4.\n"
    "Ctrl-C writes what is done so far: rows that still lack some pair are marked in the JSON.";

// What single precision's rounding leaves of a factor near an edge or at a distance.
constexpr double float_floor = 1e-4;

struct ViewFactorArguments {
  std::string scene, output, json, unit = "m", rows = "face";
  SidesArguments sides;
  ViewFactorOptions options;
  DeviceArguments device;
  CLI::Option* precision = nullptr;
  bool quiet = false;
};

std::string json_name(const ViewFactorArguments& a) {
  return a.json.empty() ? std::filesystem::path(a.output).replace_extension(".json").string() : a.json;
}

// Redrawn on a terminal a few times a second.
class Line {
 public:
  explicit Line(bool quiet) : on_(!quiet && isatty(STDERR_FILENO)) {}
  ~Line() { clear(); }
  void show(const ViewFactorProgress& p) {
    using namespace std::chrono_literals;
    const auto now = std::chrono::steady_clock::now();
    if (!on_ || now - last_ < 100ms) return;
    last_ = now;
    fmt::print(stderr, "\r\033[K{} of {} pairs, {:.1f} s", p.pairs_done, p.pairs, p.seconds);
    std::fflush(stderr);
    drawn_ = true;
  }
  void clear() {
    if (drawn_) fmt::print(stderr, "\r\033[K");
    drawn_ = false;
  }

 private:
  bool on_, drawn_ = false;
  std::chrono::steady_clock::time_point last_{};
};

void print_summary(const ViewFactors& f, const Device& device) {
  constexpr std::uint32_t most = 20;  // rows shown
  fmt::print("{:>6}  {:<24} {:>12} {:>14} {:>10}\n", "row", "name", "area [m2]", "row sum", "+-");
  for (std::uint32_t i = 0; i < std::min(most, f.rows()); ++i)
    fmt::print("{:>6}  {:<24} {:>12.6g} {:>14.9f} {:>10.1e}\n", i + 1, f.name[i].substr(0, 24), f.area_m2[i],
               f.row_sum[i], f.row_error[i]);
  if (f.rows() > most) fmt::print("   ...  {} more rows in the JSON\n", f.rows() - most);
  fmt::print("{} rows, {} entries; {} pairs of polygons face each other, {} of them partly hidden\n",
             f.rows(), f.column.size(), f.pairs, f.hidden_pairs);
  if (f.stopped)
    fmt::print("not all of it: {} rows are complete\n",
               std::count(f.complete.begin(), f.complete.end(), true));
  else if (f.closed)
    fmt::print("closed scene: row sums are within {:.1e} of 1\n", f.worst_row_defect);
  else if (f.rows() > 0)
    fmt::print("open scene (or faces that do not share their corners): row sums between {:.6f} and {:.6f}\n",
               *std::min_element(f.row_sum.begin(), f.row_sum.end()),
               *std::max_element(f.row_sum.begin(), f.row_sum.end()));
  fmt::print("worst error estimate {:.1e} of an entry", f.worst_relative_error);
  if (f.reciprocity.pairs > 0)
    fmt::print(", reciprocity within {:.1e} ({} pairs, {} beyond their estimates)", f.reciprocity.worst,
               f.reciprocity.pairs, f.reciprocity.beyond);
  fmt::print("\n{} point factors in {:.2f} s on {}\n", f.points, f.seconds, device.info().name);
}

std::unique_ptr<Device> open_device(ViewFactorArguments& a) {
  DeviceOptions options = a.device.resolved();
  if (a.precision->count() == 0) {
    options.precision = Precision::float32;
    auto device = std::make_unique<Device>(options);
    if (!device->info().fp64) {
      fmt::print(stderr, "note: {} has no double precision; errors below about {:.0e} are out of reach\n",
                 device->info().name, float_floor);
      return device;
    }
    options.precision = Precision::float64;
  }
  return std::make_unique<Device>(options);
}

int run_viewfactors(ViewFactorArguments& a) {
  watch_for_interrupt();
  const std::string json = json_name(a);
  const std::string ending = std::filesystem::path(a.output).extension().string();
  a.options.rows = a.rows == "object" ? ViewFactorRows::objects : ViewFactorRows::faces;
  const Scene scene = load_scene(a.scene, {.unit_m = parse_unit(a.unit), .sides = a.sides.resolved()});
  if (!a.quiet) {
    // Whether anything emits does not matter here.
    std::vector<Diagnostic> findings = scene.diagnostics;
    std::erase_if(findings, [](const Diagnostic& d) { return d.rule == "no-emitter"; });
    print_diagnostics(findings, stderr);
  }
  const std::unique_ptr<Device> device = open_device(a);
  if (device->options().precision == Precision::float32 && a.options.target_error < float_floor)
    fmt::print(
        stderr,
        "warning: in single precision errors below about {:.0e} are out of reach; use --precision double\n",
        float_floor);
  Line line(a.quiet);
  a.options.progress = [&](const ViewFactorProgress& p) {
    line.show(p);
    return !interrupted();
  };
  const ViewFactors factors = view_factors(*device, scene, a.options);
  line.clear();
  write_view_factors(a.output, factors);
  write_file(json, view_factor_report_json(factors, scene, *device, a.options,
                                           std::filesystem::path(a.output).filename().string()));
  if (factors.over_target > 0)
    fmt::print(
        stderr, "warning: {} entries missed the target of {:.0e}; their errors are in the JSON's rows{}\n",
        factors.over_target, a.options.target_error, ending == ".npz" ? " and in error of the .npz" : "");
  if (!a.quiet) {
    print_summary(factors, *device);
    fmt::print("wrote {}\nwrote {}\n", a.output, json);
  }
  if (factors.stopped) {
    fmt::print(stderr,
               "stopped after {:.1f} s: {} of {} pairs are done; rows that lack some are marked in {} "
               "(\"complete\": "
               "false)\n",
               factors.seconds, factors.pairs_done, factors.pairs_asked, json);
    return stopped;
  }
  return done;
}

}  // namespace

void add_viewfactors(CLI::App& app, Action& action) {
  CLI::App* verb = app.add_subcommand("viewfactors", description);
  verb->footer(help);
  const auto a = std::make_shared<ViewFactorArguments>();
  const auto ending = [](const std::string& text) -> std::string {
    std::string e = std::filesystem::path(text).extension().string();
    for (char& c : e) c = char(std::tolower(static_cast<unsigned char>(c)));
    if (e == ".mtx" || e == ".npz" || e == ".vf" || e == ".txt") return {};
    return fmt::format("the ending of '{}' must be .mtx, .npz, .vf or .txt", text);
  };
  verb->add_option("scene", a->scene, "OBJ, glTF or GLB file")->required();
  verb->add_option("-o,--output", a->output, "write the matrix here: .mtx, .npz, .vf or .txt")
      ->required()
      ->check(CLI::Validator(ending, "FILE"));
  verb->add_option("--json", a->json, "write the report here (default: beside the matrix, ending .json)");
  verb->add_option("--target-error", a->options.target_error, "error asked of each entry, relative to it")
      ->check(CLI::Range(1e-12, 0.1))
      ->capture_default_str();
  verb->add_option("--rows", a->rows, "what a row is: each face, or each object (all faces of one name)")
      ->check(CLI::IsMember({"face", "object"}))
      ->capture_default_str();
  verb->add_option("--reciprocity-sample", a->options.reciprocity_sample,
                   "pairs to integrate the other way round, too")
      ->capture_default_str();
  verb->add_option("--unit", a->unit, "length of one unit of the file: mm, cm, m, in, ft or metres")
      ->capture_default_str();
  a->sides.add_to(*verb);
  verb->add_flag("--quiet", a->quiet, "print warnings and errors only");
  a->device.precision = "double";
  a->device.add_to(*verb);
  a->precision = verb->get_option("--precision");
  verb->callback([a, &action] { action = [a] { return run_viewfactors(*a); }; });
}

}  // namespace clrad::cli

// The verbs of the command line: parsing and printing, nothing else.
#pragma once
#include <CLI/CLI.hpp>
#include <functional>
#include <string>

#include "clrad/clrad.hpp"

namespace clrad::cli {

enum ExitCode { done = 0, failure = 1, bad_usage = 2, bad_input = 3, stopped = 4 };

/// A verb adds its subcommand and leaves in `action` what to run when it was chosen; the action returns an exit code.
using Action = std::function<int()>;
void add_solve(CLI::App& app, Action& action);
void add_plan(CLI::App& app, Action& action);
void add_tradeoff(CLI::App& app, Action& action);
void add_render(CLI::App& app, Action& action);
void add_viewfactors(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_devices(CLI::App& app, Action& action);

/// --device, --cores, --precision, --memory, for every verb that computes.
struct DeviceArguments {
  DeviceOptions options;
  std::string precision = "float", memory;
  void add_to(CLI::App& verb);
  DeviceOptions resolved() const;
};

/// --two-sided and --one-sided, for every verb that reads a scene.
struct SidesArguments {
  bool two = false, one = false;
  void add_to(CLI::App& verb);
  Sides resolved() const { return two ? Sides::two : one ? Sides::one : Sides::as_file; }
};

/// "64M", "2GiB", "1000000" -> bytes. Throws UsageError.
std::uint64_t parse_bytes(const std::string& text);
/// "2%" or "0.02" -> 0.02. Throws UsageError.
double parse_share(const char* option, const std::string& text);
/// "10s", "10", "2min", "1h" -> seconds. Throws UsageError.
double parse_seconds(const char* option, const std::string& text);
/// Since the process began [s].
double seconds_since_start();
/// "640x480". Throws UsageError.
std::pair<unsigned, unsigned> parse_size(const std::string& text);
/// "8x8x4". Throws UsageError.
std::array<std::uint32_t, 3> parse_grid(const std::string& text);
/// A camera of the scene by name or number, or "ex,ey,ez,tx,ty,tz[,degrees]" in the file's units; empty: the scene's
/// first camera, else one that shows the scene. Throws UsageError.
Camera choose_camera(const std::string& text, const Scene& scene, double unit_m);
/// Lengths: metres, or a number with mm, cm, m.
double parse_unit(const std::string& text);

/// Says at once, not after the work, when no file can be written under `path`: its folder is missing, or it is one itself.
/// An empty path is fine. Throws UsageError that names the option.
void check_place(const char* option, const std::string& path);

/// Findings, one a line: `file:line: warning (rule): message`.
void print_diagnostics(const std::vector<Diagnostic>& diagnostics, std::FILE* to);

}  // namespace clrad::cli

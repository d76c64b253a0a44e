#include <fmt/format.h>
#include <unistd.h>

#include <charconv>
#include <chrono>
#include <cmath>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <glm/geometric.hpp>
#include <sstream>

#include "cli/cli.hpp"

namespace clrad::cli {
namespace {

bool parse_number(std::string_view text, double& value) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  return error == std::errc() && end == text.data() + text.size() && std::isfinite(value);
}

// A number and what follows it.
bool split_number(const std::string& text, double& value, std::string& rest) {
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || !std::isfinite(value)) return false;
  rest.assign(end, text.data() + text.size());
  return true;
}

// Libraries are loaded before main(): since the kernel started the process, from field 22 of /proc/self/stat (proc(5)), in ticks since boot;
// 0 where there is no such file.
double seconds_of_loading() {
  std::ifstream file("/proc/self/stat");
  std::string text;
  std::getline(file, text);
  const std::size_t after_name = text.rfind(')');
  if (after_name == std::string::npos) return 0;
  std::istringstream fields(text.substr(after_name + 1));
  for (int field = 3; field < 22; ++field) fields >> text;
  double ticks = 0;
  timespec now{};
  if (!(fields >> ticks) || clock_gettime(CLOCK_BOOTTIME, &now) != 0) return 0;
  const double seconds =
      double(now.tv_sec) + 1e-9 * double(now.tv_nsec) - ticks / double(sysconf(_SC_CLK_TCK));
  return seconds > 0 && seconds < 60 ? seconds : 0;
}

}  // namespace

std::uint64_t parse_bytes(const std::string& text) {
  double value = 0;
  std::string unit;
  int power = -1;
  if (split_number(text, value, unit) && value > 0) {
    if (unit.empty() || unit == "B") power = 0;
    if (unit == "K" || unit == "KiB") power = 10;
    if (unit == "M" || unit == "MiB") power = 20;
    if (unit == "G" || unit == "GiB") power = 30;
  }
  const double bytes = power < 0 ? 0 : std::ldexp(value, power);
  if (!(bytes >= 1 && bytes < 0x1p63))
    throw UsageError(fmt::format("--memory '{}' is not a size; write 512M or 2G", text));
  return std::uint64_t(bytes);
}

std::pair<unsigned, unsigned> parse_size(const std::string& text) {
  unsigned width = 0, height = 0;
  const auto x = text.find('x');
  if (x != std::string::npos) {
    const char* begin = text.data();
    const bool whole = std::from_chars(begin, begin + x, width).ptr == begin + x &&
                       std::from_chars(begin + x + 1, begin + text.size(), height).ptr == begin + text.size();
    if (whole && width > 0 && height > 0 && width <= 16384 && height <= 16384) return {width, height};
  }
  throw UsageError(
      fmt::format("--size '{}' is not a picture's size; write 640x480 (at most 16384 each way)", text));
}

std::array<std::uint32_t, 3> parse_grid(const std::string& text) {
  std::array<std::uint32_t, 3> cells{};
  const char *at = text.data(), *end = at + text.size();
  for (std::size_t axis = 0; axis < 3; ++axis) {
    const auto [next, error] = std::from_chars(at, end, cells[axis]);
    const bool last = axis == 2;
    const bool bad = error != std::errc() || (last ? next != end : next == end || *next != 'x');
    if (bad || cells[axis] == 0 || cells[axis] > 512)
      throw UsageError(fmt::format("--grid '{}' is not a grid; write 8x8x8 (at most 512 each way)", text));
    at = next + 1;
  }
  return cells;
}

double parse_share(const char* option, const std::string& text) {
  double value = 0;
  std::string unit = text;
  split_number(text, value, unit);
  const double share = unit == "%" ? value / 100 : unit.empty() ? value : -1;
  if (!(share > 0 && share < 1))
    throw UsageError(fmt::format("{} '{}' is not a share such as 2% or 0.02", option, text));
  return share;
}

double parse_seconds(const char* option, const std::string& text) {
  double value = 0;
  std::string unit = text;
  split_number(text, value, unit);
  const double of = unit.empty() || unit == "s" ? 1 : unit == "min" ? 60 : unit == "h" ? 3600 : 0;
  if (!(value * of > 0) || !std::isfinite(value * of))
    throw UsageError(fmt::format("{} '{}' is not a time such as 10s, 2min or 1h", option, text));
  return value * of;
}

double seconds_since_start() {
  static const auto main_began = std::chrono::steady_clock::now();
  static const double before_main = seconds_of_loading();
  return before_main + std::chrono::duration<double>(std::chrono::steady_clock::now() - main_began).count();
}

double parse_unit(const std::string& text) {
  double value = 1;
  std::string unit = text;
  split_number(text, value, unit);
  // Together with the scene's coordinates it makes sizes, which are checked where the scene is.
  const double of = unit == "m" || unit.empty() ? 1
                    : unit == "cm"              ? 0.01
                    : unit == "mm"              ? 0.001
                    : unit == "in"              ? 0.0254
                    : unit == "ft"              ? 0.3048
                                                : 0;
  if (!(of > 0) || !(value * of > 0) || !std::isfinite(value * of))
    throw UsageError(
        fmt::format("--unit '{}' is not a length; write mm, cm, m, in, ft or metres as a number", text));
  return value * of;
}

Camera choose_camera(const std::string& text, const Scene& scene, double unit_m) {
  if (text.empty()) return scene.cameras.empty() ? default_camera(scene) : scene.cameras.front();
  std::string known;
  for (std::size_t i = 0; i < scene.cameras.size(); ++i) {
    if (scene.cameras[i].name == text || fmt::to_string(i) == text) return scene.cameras[i];
    known += fmt::format(" {} '{}'", i, scene.cameras[i].name);
  }
  std::vector<double> v;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t comma = std::min(text.find(',', at), text.size());
    double value = 0;
    if (!parse_number(std::string_view(text).substr(at, comma - at), value)) {
      v.clear();
      break;
    }
    v.push_back(value);
    at = comma + 1;
  }
  if (v.size() != 6 && v.size() != 7)
    throw UsageError(fmt::format(
        "--camera '{}' is neither a camera of the scene (it has:{}) nor ex,ey,ez,tx,ty,tz[,degrees]", text,
        known.empty() ? " none" : known));
  Camera camera;
  camera.name = "command line";
  camera.eye = glm::dvec3(v[0], v[1], v[2]) * unit_m;
  camera.target = glm::dvec3(v[3], v[4], v[5]) * unit_m;
  // The up of the camera that shows the whole scene follows the scene's own up axis.
  camera.up = scene.cameras.empty() ? default_camera(scene).up : scene.cameras.front().up;
  if (v.size() == 7) camera.vertical_field_of_view_rad = v[6] * 3.14159265358979323846 / 180;
  const glm::dvec3 look = camera.target - camera.eye;
  if (!(glm::length(look) > 0)) throw UsageError("--camera: eye and target are the same point");
  if (!std::isfinite(glm::length(look))) throw UsageError("--camera: eye and target are too far away");
  // Straight along the up axis: what lies behind is at the top then.
  if (!(glm::length(glm::cross(look, camera.up)) > 1e-9 * glm::length(look)))
    camera.up = std::abs(look.y) > std::abs(look.z) ? glm::dvec3(0, 0, -1) : glm::dvec3(0, 1, 0);
  if (!(camera.vertical_field_of_view_rad > 0 && camera.vertical_field_of_view_rad < 3.1))
    throw UsageError("--camera: the field of view is between 0 and 178 degrees");
  return camera;
}

void check_place(const char* option, const std::string& path) {
  namespace fs = std::filesystem;
  if (path.empty()) return;
  std::error_code ignored;
  const fs::path folder = fs::path(path).parent_path();
  if (!folder.empty() && !fs::is_directory(folder, ignored))
    throw UsageError(
        fmt::format("{} {}: there is no folder {}; make it first", option, path, folder.string()));
  if (fs::is_directory(path, ignored))
    throw UsageError(fmt::format("{} {}: is a folder; name a file in it", option, path));
}

void DeviceArguments::add_to(CLI::App& verb) {
  verb.add_option("--device", options.device,
                  "OpenCL device: its number or part of its name (default: first GPU, else CPU)");
  verb.add_option("--cores", options.cores, "use N compute units (an OpenCL sub-device)")
      ->check(CLI::PositiveNumber);
  verb.add_option("--precision", precision, "float or double")
      ->check(CLI::IsMember({"float", "double"}))
      ->capture_default_str();
  verb.add_option("--memory", memory, "most device memory to use, such as 512M or 2G (default: half of it)");
  verb.add_option("--work-group", options.work_group_size,
                  "work-group size (default: 64 on CPUs, 128 on GPUs)")
      ->check(CLI::Range(1, 1024))
      ->group("Tuning");
  verb.add_option("--packet", options.packet_width,
                  "rays a work-item: 1, 4, 8 or 16 (default: 16 on CPUs, 1 on GPUs)")
      ->check(CLI::IsMember({1, 4, 8, 16}))
      ->group("Tuning");
}

void SidesArguments::add_to(CLI::App& verb) {
  CLI::Option* both = verb.add_flag("--two-sided", two, "all polygons reflect and emit on both sides");
  verb.add_flag("--one-sided", one, "none does, whatever the file says (glTF's doubleSided)")->excludes(both);
}

DeviceOptions DeviceArguments::resolved() const {
  DeviceOptions o = options;
  o.precision = precision == "double" ? Precision::float64 : Precision::float32;
  if (!memory.empty()) o.memory_bytes = parse_bytes(memory);
  return o;
}

void print_diagnostics(const std::vector<Diagnostic>& diagnostics, std::FILE* to) {
  constexpr const char* names[] = {"warning", "repair", "error"};
  for (const auto& d : diagnostics)
    fmt::print(to, "{}: {} ({}): {}\n", d.where.text(), names[int(d.severity)], d.rule, d.message);
}

}  // namespace clrad::cli

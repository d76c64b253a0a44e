#include "cli/outputs.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>

namespace clrad::cli {
namespace {

// A path whose ending says the format: a wrong one is bad usage at once, not after the work.
CLI::Option* add_file(CLI::App& verb, const std::string& name, std::string& path,
                      const std::vector<std::string>& endings, const std::string& help) {
  const auto check = [endings](const std::string& text) -> std::string {
    std::string ending = std::filesystem::path(text).extension().string();
    for (char& c : ending) c = char(std::tolower(static_cast<unsigned char>(c)));
    if (std::find(endings.begin(), endings.end(), ending) != endings.end()) return {};
    return fmt::format("the ending of '{}' must be {}", text, fmt::join(endings, " or "));
  };
  return verb.add_option(name, path, help)->check(CLI::Validator(check, "FILE"));
}

bool left_out(const Report& report, std::string_view effect) {
  return std::any_of(report.effects.begin(), report.effects.end(),
                     [&](const Effect& e) { return e.name == effect && e.needed && !e.runs; });
}

}  // namespace

void OutputArguments::add_views_to(CLI::App& verb, const std::string& in_folder) {
  verb.add_option("-o,--output", folder, "folder for " + in_folder + " (made when missing)");
  add_file(verb, "--image", image, {".png", ".exr"},
           "write the picture here: .png (exposed, sRGB) or .exr (linear radiance)");
  add_file(verb, "--gltf", gltf, {".glb", ".gltf"},
           "write the model here: .glb or .gltf with vertex colours and radiosity");
  add_file(verb, "--vtu", vtu, {".vtu"}, "write mesh, radiosity and irradiance here, for ParaView and VTK");
  verb.add_option("--unit", unit, "length of one unit of the files: mm, cm, m, in, ft or metres")
      ->capture_default_str();

  const char* group = "Picture";
  verb.add_option("--camera", camera, "a camera of the scene, or ex,ey,ez,tx,ty,tz[,degrees]")->group(group);
  verb.add_option("--size", size, "of the picture")->capture_default_str()->group(group);
  verb.add_option("--exposure", picture.exposure_stops, "stops, added to the automatic exposure")
      ->group(group);
  verb.add_option("--depth", picture.depth, "mirrors and sides of glass that a ray is followed by")
      ->capture_default_str()
      ->group(group);
  verb.add_flag("--ambient", picture.ambient,
                "add what light not yet shot would bring if it were everywhere the same: for previews")
      ->group(group);
}

void OutputArguments::add_results_to(CLI::App& verb) {
  results_ = true;
  verb.add_option("--json", json, "write the report here");
  add_file(verb, "--solution", solution, {".clrad"}, "write the solution here, for `clrad render`");
}

void OutputArguments::parse() {
  std::tie(picture.width, picture.height) = parse_size(size);
  unit_m_ = parse_unit(unit);
  if (!std::isfinite(picture.exposure_stops) || std::abs(picture.exposure_stops) > 100)
    throw UsageError(fmt::format("--exposure {} is not between -100 and 100 stops", picture.exposure_stops));
  if (picture.depth > 64) throw UsageError(fmt::format("--depth {} is more than 64", picture.depth));
  check_place("--image", image), check_place("--gltf", gltf), check_place("--vtu", vtu);
  check_place("--json", json), check_place("--solution", solution);
  std::error_code ignored;
  if (std::filesystem::exists(folder, ignored) && !std::filesystem::is_directory(folder, ignored))
    throw UsageError(fmt::format("-o {}: is a file; name a folder", folder));
}

Camera OutputArguments::chosen_camera(const Scene& scene) const {
  return choose_camera(camera, scene, unit_m_);
}

double OutputArguments::seconds() const {
  // A pixel of the Cornell box takes 4 us on two cores; models and solutions are some megabytes.
  constexpr double pixel = 4e-6, file = 0.15;
  double sum = folder.empty() ? 0 : 3 * file;
  for (const std::string* one : {&gltf, &vtu, &solution})
    if (!one->empty()) sum += file;
  if (!image.empty() || !folder.empty()) sum += pixel * picture.width * picture.height;
  return sum;
}

bool OutputArguments::any() const {
  return !(folder.empty() && image.empty() && gltf.empty() && vtu.empty() && solution.empty() &&
           json.empty());
}

std::vector<std::string> OutputArguments::write(const std::function<Device&()>& device, Solution& solved,
                                                ProgressLine& line) const {
  namespace fs = std::filesystem;
  if (!folder.empty()) {
    std::error_code error;
    fs::create_directories(folder, error);
    if (error) throw DeviceError(fmt::format("cannot make the folder {}: {}", folder, error.message()));
  }
  std::vector<std::string> written;
  const auto output = [&](const std::string& given, const char* name, const char* stage,
                          const std::function<void(const std::string&)>& make) {
    const std::string path = given.empty() && !folder.empty() ? (fs::path(folder) / name).string() : given;
    if (path.empty()) return;
    line.say(stage);
    make(path);
    written.push_back(path);
  };
  output(image, "picture.png", "draw the picture", [&](const std::string& path) {
    const auto start = std::chrono::steady_clock::now();
    Device& drawing = device();
    ImageOptions options = picture;
    if (left_out(solved.report, "specular")) options.depth = 0;
    write_image(path, render(drawing, solved, chosen_camera(solved.scene), options), options);
    auto& seconds = solved.report.seconds;
    seconds.render = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    seconds.total += seconds.render;
    solved.report.stages = drawing.profile();
    for (const char* of_view : {"specular", "textures"})
      charge(solved.report.effects, of_view, solved.report.stages);
  });
  output(gltf, "scene.glb", "write the glTF", [&](const std::string& path) { write_gltf(path, solved); });
  output(vtu, "scene.vtu", "write the VTK grid", [&](const std::string& path) { write_vtu(path, solved); });
  if (!results_) return written;
  output(solution, "solution.clrad", "write the solution",
         [&](const std::string& path) { write_solution(path, solved); });
  output(json, "report.json", "write the report",
         [&](const std::string& path) { write_report(path, solved); });
  return written;
}

}  // namespace clrad::cli

#include "hard/obj_scene.hpp"

#include "cli/program.hpp"

namespace clrad::test {
namespace {

// Not a test of its own: the program's folder and process, for those that are.
class CommandLine : public Program {
 public:
  CommandLine() { SetUp(); }
  ~CommandLine() override { TearDown(); }
  void TestBody() override {}

  oracle::json report(const ObjScene& scene, const SolveOptions& options,
                      const std::vector<std::string>& more) {
    const clrad_test::Folder folder;
    std::vector<std::string> words{"solve", scene.write(folder), "--quiet", "--json", path("report.json")};
    const auto add = [&](const std::string& name, double value) {
      words.push_back(name), words.push_back(fmt::format("{:.17g}", value));
    };
    if (options.mesh.patch_edge_m > 0) add("--patch-edge", options.mesh.patch_edge_m);
    if (options.mesh.element_edge_m > 0) add("--element-edge", options.mesh.element_edge_m);
    add("--samples", options.samples), add("--light-samples", options.light_samples);
    add("--sensor-rays", options.sensor_rays), add("--converge", options.converge);
    add("--seed", double(options.seed));
    if (!options.sensors.empty()) {
      std::string text;
      for (const Sensor& s : options.sensors)
        text += fmt::format("{:.17g} {:.17g} {:.17g} {:.17g} {:.17g} {:.17g}\n", s.position_m.x,
                            s.position_m.y, s.position_m.z, s.normal.x, s.normal.y, s.normal.z);
      words.insert(words.end(), {"--sensors", folder.write("points.pts", text)});
    }
    words.insert(words.end(), more.begin(), more.end());
    const Outcome outcome = run(words);
    EXPECT_EQ(outcome.code, 0) << outcome.error;
    if (outcome.code != 0) return {};
    return oracle::json::parse(text("report.json"));
  }
};

}  // namespace

oracle::json command_line_report(const ObjScene& scene, const SolveOptions& options,
                                 const std::vector<std::string>& more) {
  return CommandLine().report(scene, options, more);
}

std::vector<double> command_line_irradiance(const ObjScene& scene, const SolveOptions& options,
                                            const std::vector<std::string>& more) {
  std::vector<double> all;
  for (const auto& s : command_line_report(scene, options, more).value("sensors", oracle::json::array()))
    all.push_back(s.at("irradiance_W_m2").at(0));
  return all;
}

}  // namespace clrad::test

// clrad render: views of a finished solution.
#include <OpenImageIO/imageio.h>

#include "cli/program.hpp"
#include "clrad/output.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

class CliRender : public test::Program {
 protected:
  Outcome solve_furnace() {
    return run({"solve", CLRAD_SCENES "/furnace.obj", "-o", path("out"), "--size", "32x24", "--patch-edge",
                "0.5", "--element-edge", "0.25", "--samples", "1", "--converge", "1e-3", "--quiet"});
  }
  std::vector<float> pixels(const std::string& name, int width, int height, int channels) const {
    const auto in = OIIO::ImageInput::open(path(name));
    if (!in) return {};
    EXPECT_EQ(in->spec().width, width);
    EXPECT_EQ(in->spec().height, height);
    EXPECT_EQ(in->spec().nchannels, channels);
    std::vector<float> values(std::size_t(width * height * channels));
    EXPECT_TRUE(in->read_image(0, 0, 0, channels, OIIO::TypeDesc::FLOAT, values.data()));
    return values;
  }
};

TEST_F(CliRender, DrawsTheSamePictureAndFilesAsTheSolveDid) {
  const auto solved = solve_furnace();
  ASSERT_EQ(solved.code, 0) << solved.error;
  const auto r = run({"render", path("out/solution.clrad"), "-o", path("again"), "--size", "32x24"});
  ASSERT_EQ(r.code, 0) << r.error;
  for (const char* file : {"picture.png", "scene.glb", "scene.vtu"}) {
    EXPECT_NE(r.out.find(path("again/") + file), std::string::npos) << r.out;
    EXPECT_FALSE(text(std::string("out/") + file).empty()) << file;
    EXPECT_EQ(text(std::string("out/") + file), text(std::string("again/") + file)) << file;
  }
  EXPECT_FALSE(holds("again/report.json"));
  EXPECT_FALSE(holds("again/solution.clrad"));
}

TEST_F(CliRender, DrawsAnotherViewAndOnlyWhatIsNamed) {
  ASSERT_EQ(solve_furnace().code, 0);
  const auto r = run({"render", path("out/solution.clrad"), "--camera", "50,50,50,50,50,0,60", "--unit", "cm",
                      "--size", "20x10", "--image", path("view.exr"), "--quiet"});
  ASSERT_EQ(r.code, 0) << r.error;
  EXPECT_TRUE(r.out.empty()) << r.out;
  // E = 1, rho = 1/2: B = 2 on every wall up to the light not yet shot, which is 0.1 % of E's power here.
  const auto view = pixels("view.exr", 20, 10, 1);
  ASSERT_EQ(view.size(), 200u);
  for (const float l : view) EXPECT_NEAR(l, 2 / 3.14159265, 2e-3);
}

TEST_F(CliRender, ModelsNeedNoDevice) {
  ASSERT_EQ(solve_furnace().code, 0);
  const auto r = run({"render", path("out/solution.clrad"), "--vtu", path("a.vtu"), "--gltf", path("a.gltf"),
                      "--device", "abacus"});
  EXPECT_EQ(r.code, 0) << r.error;
  EXPECT_EQ(text("a.vtu"), text("out/scene.vtu"));
  EXPECT_TRUE(holds("a.gltf"));
  const auto picture =
      run({"render", path("out/solution.clrad"), "--image", path("a.png"), "--device", "abacus"});
  EXPECT_EQ(picture.code, 2);
  EXPECT_FALSE(holds("a.png"));
}

TEST_F(CliRender, AmbientAddsReflectedAmbientIrradianceToThePictureAlone) {
  const Scene scene = test::scene({test::polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}})}, 3);
  Solution s = test::solution(
      scene, 0.5, [](std::uint32_t, std::uint32_t band, const glm::dvec3& x) { return 1 + band + x.x; });
  s.ambient = {0.5, 1, 2};
  s.stopped = true;
  s.unshot_relative = 0.25;
  write_solution(path("a.clrad"), s);
  const auto draw = [&](const std::string& name, std::vector<std::string> more) {
    std::vector<std::string> words{"render", path("a.clrad"), "--camera", "1,1,3,1,1.01,0,20", "--size",
                                   "8x8"};
    words.insert(words.end(), {"--image", path(name + ".exr"), "--vtu", path(name + ".vtu")});
    words.insert(words.end(), more.begin(), more.end());
    return run(words);
  };
  const auto plain = draw("plain", {}), with = draw("ambient", {"--ambient"});
  ASSERT_EQ(plain.code, 0) << plain.error;
  ASSERT_EQ(with.code, 0) << with.error;
  EXPECT_NE(plain.error.find("25 % of its light unshot; --ambient"), std::string::npos) << plain.error;
  const auto a = pixels("plain.exr", 8, 8, 3), b = pixels("ambient.exr", 8, 8, 3);
  ASSERT_EQ(a.size(), b.size());
  ASSERT_EQ(a.size(), 192u);
  // rho = 1/2. Radiance below 2 in float, a few roundings of 2^-24 each through shading and the mean over 16 samples.
  for (std::size_t i = 0; i < a.size(); ++i)
    EXPECT_NEAR(b[i] - a[i], 0.5 * s.ambient[i % 3] / 3.14159265358979, 2 * 32 * std::ldexp(1, -24)) << i;
  EXPECT_EQ(text("plain.vtu"), text("ambient.vtu"));
}

TEST_F(CliRender, WithoutSpecularMirrorsShowTheirDiffusePartAlone) {
  const auto draw = [&](const std::string& name, const std::vector<std::string>& more) {
    std::vector<std::string> words{
        "solve", CLRAD_SCENES "/mirror_room.obj", "--patch-edge", "3", "--element-edge", "1.5"};
    words.insert(words.end(),
                 {"--samples", "1", "--light-samples", "0", "--converge", "0.5", "--size", "16x16"});
    words.insert(words.end(), {"--image", path(name)});
    words.insert(words.end(), more.begin(), more.end());
    EXPECT_EQ(run(words).code, 0);
    return pixels(name, 16, 16, 3);
  };
  const auto all = draw("all.exr", {}), none = draw("none.exr", {"--without", "specular"}),
             flat = draw("flat.exr", {"--depth", "0"});
  EXPECT_EQ(none, flat);
  EXPECT_NE(none, all);
}

TEST_F(CliRender, BadUsageIsSaidBeforeAnythingIsWritten) {
  ASSERT_EQ(solve_furnace().code, 0);
  const std::string solution = path("out/solution.clrad");
  const auto nothing = run({"render", solution});
  EXPECT_EQ(nothing.code, 2);
  EXPECT_NE(nothing.error.find("nothing to write"), std::string::npos) << nothing.error;
  EXPECT_EQ(run({"render"}).code, 2);
  EXPECT_EQ(run({"render", solution, "--vtu", path("a.txt")}).code, 2);
  EXPECT_EQ(run({"render", solution, "--image", path("a.gif")}).code, 2);
  EXPECT_EQ(run({"render", solution, "--gltf", path("a.obj")}).code, 2);
  EXPECT_EQ(run({"solve", CLRAD_SCENES "/furnace.obj", "--solution", path("a.bin")}).code, 2);
  EXPECT_EQ(run({"render", solution, "--camera", "kitchen", "--vtu", path("a.vtu")}).code, 2);
  EXPECT_EQ(run({"render", solution, "--size", "big", "--vtu", path("a.vtu")}).code, 2);
  EXPECT_FALSE(holds("a.vtu"));
}

TEST_F(CliRender, OtherFilesAreBadInputWithTheReason) {
  const auto scene = run({"render", CLRAD_SCENES "/furnace.obj", "--vtu", path("a.vtu")});
  EXPECT_EQ(scene.code, 3);
  EXPECT_NE(scene.error.find("furnace.obj: is not a file of clrad's"), std::string::npos) << scene.error;
  EXPECT_EQ(run({"render", path("missing.clrad"), "--vtu", path("a.vtu")}).code, 3);
  ASSERT_EQ(solve_furnace().code, 0);
  const std::string whole = text("out/solution.clrad");
  write("cut.clrad", whole.substr(0, whole.size() / 2));
  const auto cut = run({"render", path("cut.clrad"), "--vtu", path("a.vtu")});
  EXPECT_EQ(cut.code, 3);
  EXPECT_NE(cut.error.find("is cut short"), std::string::npos) << cut.error;
  EXPECT_FALSE(holds("a.vtu"));
}

TEST_F(CliRender, SolveWritesSolutionAndGridWhereTheyAreNamed) {
  const auto r =
      run({"solve", CLRAD_SCENES "/furnace.obj", "--vtu", path("f.vtu"), "--solution", path("f.clrad"),
           "--json", path("f.json"), "--patch-edge", "1", "--element-edge", "1", "--quiet"});
  ASSERT_EQ(r.code, 0) << r.error;
  EXPECT_EQ(text("f.json"), report_json(load_solution(path("f.clrad"))));
  EXPECT_TRUE(holds("f.vtu"));
  EXPECT_FALSE(holds("picture.png"));
}

}  // namespace
}  // namespace clrad

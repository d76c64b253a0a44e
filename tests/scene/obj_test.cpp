#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "scene/files.hpp"

namespace {

using namespace clrad;
using namespace clrad_test;
using Severity = Diagnostic::Severity;

const char* kTriangle = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

TEST(SceneObj, NumbersArriveToTheLastBit) {
  Folder folder;
  // tinyobjloader alone turns several of these into a neighbour.
  const Scene scene =
      load_scene(write_obj(folder,
                           "v 0.1 0.5592 1e-7\nv +0.30000000000000004 -1000000.1 3.14159265358979\n"
                           "v 123456789.123456789 2.2250738585072014e-308 .5\nf 1 2 3\n"));
  ASSERT_EQ(scene.polygons.size(), 1u);
  const auto& c = scene.polygons[0].corner;
  EXPECT_EQ(c[0], glm::dvec3(0.1, 0.5592, 1e-7));
  EXPECT_EQ(c[1], glm::dvec3(0.30000000000000004, -1000000.1, 3.14159265358979));
  EXPECT_EQ(c[2], glm::dvec3(123456789.123456789, 2.2250738585072014e-308, 0.5));
}

TEST(SceneObj, FacesKeepNamesMaterialsLinesAndOrder) {
  Folder folder;
  folder.write("two.mtl", "newmtl white\nKd 0.7 0.6 0.5\n\nnewmtl lamp\nKd 0.25\nKe 2 3 4\n");
  const std::string path = folder.write("two.obj",
                                        "# comment\nmtllib two.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n"
                                        "o floor\nusemtl white\nf 1 2 3 4\n"
                                        "g light panel\nusemtl lamp\nf -4/1/1 -3//2 -2/7 # three corners\n");
  const Scene scene = load_scene(path);
  ASSERT_EQ(scene.polygons.size(), 2u);
  EXPECT_EQ(scene.polygons[0].corners, 4u);
  EXPECT_EQ(scene.polygons[0].name, "floor");
  EXPECT_EQ(scene.polygons[0].where.text(), path + ":9");
  EXPECT_EQ(scene.materials[scene.polygons[0].material].name, "white");
  EXPECT_EQ(scene.polygons[1].corners, 3u);
  EXPECT_EQ(scene.polygons[1].name, "light panel");
  EXPECT_EQ(scene.polygons[1].where.line, 12u);
  EXPECT_EQ(scene.polygons[1].corner[2], glm::dvec3(1, 1, 0));
  const Material& lamp = scene.materials[scene.polygons[1].material];
  EXPECT_EQ(lamp.reflectance, (std::vector{0.25, 0.25, 0.25}));
  EXPECT_EQ(lamp.emitted_exitance,
            (std::vector{2 * std::numbers::pi, 3 * std::numbers::pi, 4 * std::numbers::pi}));
  EXPECT_EQ(lamp.where.text(), folder.at("two.mtl") + ":5");
  EXPECT_EQ(scene.bands, (std::vector<std::string>{"red", "green", "blue"}));
  EXPECT_EQ(scene.quantity, Quantity::radiometric);
  EXPECT_TRUE(scene.diagnostics.empty());
}

TEST(SceneObj, OneBandWhereNoMaterialTellsThemApart) {
  Folder folder;
  const Scene scene = load_scene(write_obj(folder, kTriangle));
  EXPECT_EQ(scene.bands, std::vector<std::string>{"grey"});
  EXPECT_EQ(scene.materials[0].reflectance, std::vector{0.5});
  EXPECT_EQ(scene.materials[0].emitted_exitance, std::vector{std::numbers::pi});
}

TEST(SceneObj, UnitScalesCoordinates) {
  Folder folder;
  const Scene scene = load_scene(write_obj(folder, kTriangle), {0.001});
  EXPECT_EQ(scene.polygons[0].corner[1], glm::dvec3(0.001, 0, 0));
  EXPECT_THROW(load_scene(folder.at("a.obj"), {0.0}), UsageError);
  EXPECT_THROW(load_scene(folder.at("a.obj"), {std::nan("")}), UsageError);
}

TEST(SceneObj, LineEndsAndByteOrderMark) {
  Folder folder;
  folder.write("a.mtl", "newmtl m\r\nKd 0.5 0.5 0.5\r\nKe 1 1 1\r\n");
  const std::string body = "mtllib a.mtl%usemtl m%v 0 0 0%v 1 0 0%v 0 1 0%f 1 2 3";
  for (const std::string end : {"\n", "\r\n", "\r"}) {
    std::string text = "\xEF\xBB\xBF" + body;
    for (auto at = text.find('%'); at != std::string::npos; at = text.find('%')) text.replace(at, 1, end);
    const Scene scene = load_scene(folder.write("a.obj", text));
    ASSERT_EQ(scene.polygons.size(), 1u);
    EXPECT_EQ(scene.polygons[0].where.line, 6u);
    EXPECT_TRUE(scene.diagnostics.empty());
  }
}

TEST(SceneObj, FaceWithoutMaterialGetsThePrintedDefault) {
  Folder folder;
  const Scene scene = load_scene(folder.write("a.obj", kTriangle));
  EXPECT_EQ(scene.materials[scene.polygons[0].material].reflectance, std::vector{0.5});
  const auto found = of_rule(scene.diagnostics, "no-material");
  ASSERT_EQ(found.size(), 1u);
  EXPECT_EQ(found[0].severity, Severity::warning);
  EXPECT_EQ(found[0].where.line, 4u);
}

TEST(SceneObj, EachMtlFileOfALineIsRead) {
  Folder folder;
  folder.write("a.mtl", "newmtl a\nKd 0.1 0.1 0.1\n");
  folder.write("b.mtl", "newmtl b\nKd 0.2 0.2 0.2\nKe 1 1 1\n");
  const Scene scene = load_scene(
      folder.write("x.obj", std::string("mtllib a.mtl b.mtl\nmtllib b.mtl\nusemtl b\n") + kTriangle));
  ASSERT_EQ(scene.materials.size(), 2u);
  EXPECT_EQ(scene.materials[scene.polygons[0].material].reflectance, std::vector{0.2});
}

TEST(SceneObj, MtlNamesMayHoldBlanksAndEndInThem) {
  Folder folder;
  folder.write("my lamp.mtl", kMtl);
  EXPECT_TRUE(load_scene(folder.write("x.obj", std::string("mtllib my lamp.mtl  \nusemtl m\n") + kTriangle))
                  .diagnostics.empty());
}

struct Bad {
  const char *what, *mtl, *obj, *at, *rule;
};

class SceneObjError : public testing::TestWithParam<Bad> {};

TEST_P(SceneObjError, NamesFileLineAndRule) {
  const Bad& bad = GetParam();
  Folder folder;
  if (bad.mtl) folder.write("a.mtl", bad.mtl);
  const std::string path = folder.write("a.obj", bad.obj);
  const std::string message = load_error(path);
  EXPECT_TRUE(message.starts_with(folder.at(bad.at))) << message;
  bool listed = false;
  for (const Diagnostic& d : check_scene(path)) listed |= d.severity == Severity::error && d.rule == bad.rule;
  EXPECT_TRUE(listed) << testing::PrintToString(rules_of(check_scene(path)));
}

INSTANTIATE_TEST_SUITE_P(
    All, SceneObjError,
    testing::Values(
        Bad{"MissingMtl", nullptr, "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "a.obj:1: ", "material-file"},
        Bad{"UnknownMaterial", kMtl, "mtllib a.mtl\nusemtl x\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n",
            "a.obj:2: ", "material-not-found"},
        Bad{"MtllibTooLate", kMtl, "usemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nmtllib a.mtl\n",
            "a.obj:1: ", "material-not-found"},
        Bad{"IndexTooHigh", nullptr, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 4\n", "a.obj:4: ", "face-index"},
        Bad{"IndexTooLow", nullptr, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 -4\n", "a.obj:4: ", "face-index"},
        Bad{"IndexZero", nullptr, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 0 1 2\n", "a.obj:4: ", "face-index"},
        Bad{"IndexNoNumber", nullptr, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 x\n", "a.obj:4: ", "face-index"},
        Bad{"Nan", nullptr, "v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj:2: ", "vertex"},
        Bad{"Infinity", nullptr, "v 0 0 0\nv 1 0 0\nv 0 -inf 0\nf 1 2 3\n", "a.obj:3: ", "vertex"},
        Bad{"TooLargeForDouble", nullptr, "v 0 0 0\nv 1e999 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj:2: ", "vertex"},
        Bad{"Words", nullptr, "v 0 0 0\nv 1 zero 0\nv 0 1 0\nf 1 2 3\n", "a.obj:2: ", "vertex"},
        Bad{"CutOffInVertex", nullptr, "v 0 0 0\nv 1 0", "a.obj:2: ", "vertex"},
        Bad{"CutOffInFace", nullptr, "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2", "a.obj:4: ", "too-few-corners"},
        Bad{"CutOffBeforeFaces", nullptr, "v 0 0 0\nv 1 0 0\nv 0 1 0\n", "a.obj: ", "no-polygons"},
        Bad{"TooFar", nullptr, "v 0 0 0\nv 1e101 0 0\nv 0 1 0\nf 1 2 3\n", "a.obj:4: ", "coordinate"},
        Bad{"ReflectanceOne", "newmtl m\nKd 1 0.5 0.5\n",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.mtl:2: ", "reflectance"},
        Bad{"ReflectanceNegative", "newmtl m\n\nKd 0.5 -0.1 0.5\n",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.mtl:3: ", "reflectance"},
        Bad{"ReflectanceNan", "newmtl m\nKd nan nan nan\n",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.mtl:2: ", "reflectance"},
        Bad{"EmissionNegative", "newmtl m\nKd 0.5 0.5 0.5\nKe -1 0 0\n",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.mtl:3: ", "emission"},
        Bad{"EmissionInfinite", "newmtl m\nKd 0.5 0.5 0.5\nKe inf 0 0\n",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.mtl:3: ", "emission"},
        Bad{"TwoNumbers", "newmtl m\nKd 0.5 0.5\n",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.mtl:2: ", "number"},
        Bad{"Spectral", "newmtl m\nKd spectral steel.rfl\n",
            "mtllib a.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n", "a.mtl:2: ", "number"}),
    [](const auto& each) { return std::string(each.param.what); });

TEST(SceneObj, ACornerOfManyIsTooMany) {
  Folder folder;
  std::string text, face = "f";
  for (int i = 0; i < 256; ++i) {
    text += "v " + std::to_string(i) + " " + std::to_string(i * i) + " 0\n";
    face += std::to_string(i + 1).insert(0, 1, ' ');
  }
  EXPECT_NE(load_error(folder.write("a.obj", text + face)).find("a.obj:257: a face has at most 255"),
            std::string::npos);
}

TEST(SceneObj, FilesThatCannotBeReadAtAll) {
  Folder folder;
  EXPECT_TRUE(load_error(folder.at("none.obj"))
                  .starts_with(folder.at("none.obj") + ": cannot be read: No such file"));
  EXPECT_TRUE(load_error(folder.write("empty.obj", "")).starts_with(folder.at("empty.obj") + ": is empty"));
  EXPECT_NE(load_error(folder.write("scene.stl", "solid")).find(".obj, .gltf and .glb"), std::string::npos);
  EXPECT_NE(load_error(folder.write("b.obj", std::string("v 0\0 0", 6))).find("not a text file"),
            std::string::npos);
  const auto findings = check_scene(folder.at("empty.obj"));
  ASSERT_EQ(findings.size(), 1u);
  EXPECT_EQ(findings[0].severity, Severity::error);
  EXPECT_EQ(findings[0].where.text(), folder.at("empty.obj"));
  EXPECT_EQ(findings[0].message.find(folder.at("")), std::string::npos);
}

TEST(SceneObj, CheckListsEveryFindingInFileOrderAndDoesNotThrow) {
  Folder folder;
  const auto found = check_scene(write_obj(folder,
                                           "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 2 0 0\nv inf 0 0\n"
                                           "f 1 2 9\nf 1 2 4\nf 1 2 3\nf 1 2 3\nf 3 0 1\nf 1 2 5\n"));
  std::vector<std::pair<std::string, std::uint32_t>> list;
  for (const Diagnostic& d : found) list.emplace_back(d.rule, d.where.line);
  using List = decltype(list);
  EXPECT_EQ(list, (List{{"vertex", 7},
                        {"face-index", 8},
                        {"degenerate-face", 9},
                        {"duplicate-face", 11},
                        {"face-index", 12},
                        {"coordinate", 13}}));
}

TEST(SceneObj, WarningsOfMaterialsAndElements) {
  Folder folder;
  folder.write(
      "a.mtl",
      "newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\nmap_Ke wood.png\nd 0.5\nnewmtl m\nKd 0.1 0.1 0.1\nnewmtl bare\n");
  const Scene scene =
      load_scene(folder.write("a.obj", std::string("mtllib a.mtl\nusemtl m\nl 1 2\np 1\n") + kTriangle));
  EXPECT_EQ(scene.materials[scene.polygons[0].material].reflectance, std::vector{0.5});
  for (const char* rule : {"texture-ignored", "transparency-ignored", "duplicate-material", "no-reflectance",
                           "element-ignored"}) {
    ASSERT_EQ(of_rule(scene.diagnostics, rule).size(), 1u) << rule;
    EXPECT_EQ(of_rule(scene.diagnostics, rule)[0].severity, Severity::warning);
  }
}

// The one material of an MTL text, as a triangle of it has it.
Scene with_material(const Folder& folder, const std::string& lines) {
  folder.write("a.mtl", "newmtl m\n" + lines);
  return load_scene(folder.write("a.obj", std::string("mtllib a.mtl\nusemtl m\n") + kTriangle));
}

TEST(SceneObj, IlluminationModelsOfMirrorsAndGlass) {
  Folder folder;
  using Bands = std::vector<double>;
  for (const char* illum : {"illum 3", "illum 5"}) {
    const Scene scene = with_material(
        folder, std::string("Kd 0.1 0.1 0.1\nKe 1 1 1\n") + illum + "\nKs 0.8 0.7 0.6 # bright\n");
    EXPECT_TRUE(scene.materials[0].is_mirror());
    EXPECT_EQ(scene.materials[0].specular, (Bands{0.8, 0.7, 0.6}));
    EXPECT_EQ(scene.materials[0].reflectance, (Bands{0.1, 0.1, 0.1}));
    EXPECT_TRUE(scene.diagnostics.empty());
  }
  for (const char* illum : {"illum 4", "illum 6", "illum 7", "illum 9"}) {
    const Scene scene = with_material(
        folder, std::string("Ke 1 1 1\nKs 1 1 1\nTf 0.9 0.8 0.7\nd 0.2\nNi 1.33\n") + illum + "\n");
    EXPECT_TRUE(scene.materials[0].is_glass());
    EXPECT_EQ(scene.materials[0].transmission, (Bands{0.9, 0.8, 0.7}));
    EXPECT_EQ(scene.materials[0].ior, 1.33);
    EXPECT_TRUE(scene.materials[0].specular.empty()) << "glass reflects by Fresnel, not by Ks";
    EXPECT_TRUE(scene.diagnostics.empty());
  }
  // Without Tf: d, or Tr, or all that is not diffuse. Grey materials come out in one band.
  EXPECT_EQ(with_material(folder, "Ke 1 1 1\nd 0.25\nillum 4\n").materials[0].transmission, Bands{0.75});
  EXPECT_EQ(with_material(folder, "Ke 1 1 1\nTr 0.75\nillum 4\n").materials[0].transmission, Bands{0.75});
  EXPECT_EQ(with_material(folder, "Ke 1 1 1\nKd 0.25\nillum 4\n").materials[0].transmission, Bands{0.75});
  // Any other model: an exporter's highlight.
  for (const char* illum : {"", "illum 2\n", "illum 8\n"}) {
    const Scene scene =
        with_material(folder, std::string("Kd 0.5\nKe 1 1 1\nKs 0.9 0.9 0.9\nNi 1.4\n") + illum);
    EXPECT_FALSE(has_specular(scene));
    EXPECT_TRUE(scene.diagnostics.empty());
  }
}

TEST(SceneObj, SpecularSharesThatDoNotFitAreRepairedAndSaidSo) {
  Folder folder;
  Scene scene = with_material(folder, "Kd 0.6 0.2 0.2\nKe 1 1 1\nKs 0.8 0.8 0.8\nillum 3\n");
  EXPECT_DOUBLE_EQ(scene.materials[0].specular[0], 0.4);
  EXPECT_EQ(scene.materials[0].specular[1], 0.8);
  ASSERT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"specular-share"});
  EXPECT_EQ(scene.diagnostics[0].severity, Severity::repair);
  EXPECT_EQ(scene.diagnostics[0].where.text(), folder.at("a.mtl") + ":2");
  scene = with_material(folder, "Kd 0 0 0\nKe 1 1 1\nTf 1 1 1\nNi 0.5\nillum 7\n");
  EXPECT_EQ(scene.materials[0].ior, 1.5);
  EXPECT_EQ(rules_of(scene.diagnostics), std::vector<std::string>{"ior"});

  const auto error = [&](const std::string& lines) {
    folder.write("a.mtl", "newmtl m\nKe 1 1 1\n" + lines);
    return load_error(folder.write("a.obj", std::string("mtllib a.mtl\nusemtl m\n") + kTriangle));
  };
  EXPECT_NE(error("Ks -0.5 0 0\nillum 3\n").find("mirrors -0.5 of red light"), std::string::npos);
  EXPECT_NE(error("Ks nan 0 0\nillum 3\n").find("mirrors nan of red light"), std::string::npos);
  EXPECT_NE(error("Tf 0 0 -1\nillum 7\n").find("transmits -1 of blue light"), std::string::npos);
  EXPECT_NE(error("Ks spectral a.rfl\nillum 3\n").find("a.mtl:3: Ks takes one decimal number or three"),
            std::string::npos);
  EXPECT_NE(error("Ni high\nillum 7\n").find("a.mtl:3: Ni takes one decimal number"), std::string::npos);
  EXPECT_NE(error("Ni nan\nillum 7\n").find("a.mtl:3: Ni takes one decimal number"), std::string::npos);
  EXPECT_EQ(error("Ks spectral a.rfl\nNi high\nd -halo 0.5\n"), "") << "not a mirror: not read";
}

}  // namespace

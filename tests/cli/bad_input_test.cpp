// Bad input: exit code 3, one line that names file and line (or node) and says what is expected, and no file anywhere.
#include <cmath>
#include <cstring>
#include <map>

#include "cli/program.hpp"
#include "oracle/reference.hpp"
#include "output/damage.hpp"
#include "scene/gltf_text.hpp"

namespace clrad {
namespace {

namespace fs = std::filesystem;

class BadInput : public test::Program {
 protected:
  // What is there, but for what the harness itself writes.
  std::map<std::string, std::string> listing() const {
    std::map<std::string, std::string> files;
    for (const auto& entry : fs::recursive_directory_iterator(folder_)) {
      const std::string name = fs::relative(entry.path(), folder_).string();
      if (name != "stdout" && name != "stderr")
        files[name] = entry.is_regular_file() ? text(name) : "not a file";
    }
    return files;
  }

  std::string names() const {
    std::string all;
    for (const auto& file : listing()) all += file.first + " ";
    return all;
  }

  // Runs the words with every output there is, and expects code, one line on stderr that begins with `place` and holds
  // `says`, nothing on stdout, and the folder as it was.
  void refused(int code, std::vector<std::string> words, const std::string& place, const std::string& says) {
    SCOPED_TRACE(place + " ... " + says);
    const auto before = listing();
    const Outcome r = run(words);
    EXPECT_EQ(r.code, code) << r.error;
    EXPECT_TRUE(r.out.empty()) << r.out;
    EXPECT_TRUE(listing() == before) << "the folder has changed: " << names();
    EXPECT_TRUE(r.error.starts_with(place)) << r.error;
    EXPECT_NE(r.error.find(says), std::string::npos) << r.error;
    EXPECT_EQ(r.error.find('\n'), r.error.size() - 1) << "more than a line, or none: " << r.error;
  }
  void refused_scene(const std::string& name, const std::string& where, const std::string& says,
                     std::vector<std::string> more = {}) {
    std::vector<std::string> words{"solve", path(name), "-o", path("out"), "--image", path("i.png")};
    words.insert(words.end(), {"--json", path("r.json"), "--solution", path("s.clrad"), "--checkpoint",
                               path("c.ck"), "--vtu", path("v.vtu"), "--gltf", path("g.glb")});
    words.insert(words.end(), more.begin(), more.end());
    refused(3, words, folder_.string() + "/" + where, says);
  }
  void write_bytes(const std::string& name, const std::string& bytes) const {
    std::ofstream(folder_ / name, std::ios::binary) << bytes;
  }
};

// Four corners on lines 3 to 6, a face on line 7 of whichever case; the material on lines 1 to 3 of its file.
constexpr const char* corners = "mtllib m.mtl\nusemtl m\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n";
constexpr const char* material = "newmtl m\nKd 0.5 0.5 0.5\nKe 1 1 1\n";

TEST_F(BadInput, LinesOfObjFiles) {
  struct Case {
    std::string tail;  // after `corners`
    const char *line, *says;
  };
  std::vector<Case> cases{
      {"v 0 0\nf 1 2 3\n", "7", "a vertex needs three coordinates"},
      {"v\nf 1 2 3\n", "7", "a vertex needs three coordinates"},
      {"v 0 0 1,5\nf 1 2 3\n", "7", "write a finite decimal number"},
      {"v 0 0 0x10\nf 1 2 3\n", "7", "write a finite decimal number"},
      {"f 1 2 9\n", "7", "names vertex 9, but there are 4"},
      {"f 1 2 -5\n", "7", "names vertex -5, but there are 4"},
      {"f 0 1 2\n", "7", "a face lists numbers from 1"},
      {"f 1 2 x\n", "7", "a face lists numbers from 1"},
      {"f 1 2 1.5\n", "7", "a face lists numbers from 1"},
      {"f 1 2 99999999999999999999\n", "7", "a face lists numbers from 1"},
      {"f 1 2 4294967297\n", "7", "names vertex 4294967297"},
      {"f 1 2\n", "7", "a face needs three corners"},
      {"f 1\n", "7", "a face needs three corners"},
      {"f\n", "7", "a face needs three corners"},
      {"f 1 1 1\n", "7", "at least one face with an area"},
      {"f 1 2 2\n", "7", "at least one face with an area"},
      {"v 2 0 0\nf 1 2 5\n", "8", "at least one face with an area"},
      {"f 1 3 2 4\n", "7", "cross"},
      {"f 1 3 2 4 1\n", "7", "cross"},
      {"usemtl nobody\nf 1 2 3\n", "7", "add it there, or a mtllib line above"},
      {"v 1e101 0 0\nf 1 2 5\n", "8", "at most 1e+100 m"},
      {"v 1e50 0 0\nv 0 1e50 0\nf 1 5 6\n", "9", "is --unit right"},
      {"v 1e11 0 0\nf 1 5 4\n", "8", "is --unit right"},
      {"v 0 0 1e-12\nv 1e-12 0 0\nf 1 5 6\n", "9", "is --unit right"},
      {"f" +
           [] {
             std::string many;
             for (int i = 0; i < 300; ++i) many += " 1 2 3";
             return many;
           }() +
           "\n",
       "7", "split it"},
  };
  const char* forms[] = {"v # 0 0\nf 1 2 5\n", "v 0 # 0\nf 1 2 5\n", "v 0 0 #\nf 1 2 5\n"};
  std::size_t next = 0;
  for (const char* number :
       {"nan", "NaN", "inf", "-inf", "Infinity", "1e400", "-1e400", "1e", "--1", "1_000"}) {
    std::string tail = forms[next++ % 3];
    tail.replace(tail.find('#'), 1, number);
    cases.push_back({tail, "7", "write a finite decimal number"});
  }
  write("m.mtl", material);
  for (const Case& c : cases) {
    write("bad.obj", corners + c.tail);
    refused_scene("bad.obj", std::string("bad.obj:") + c.line + ": ", c.says);
  }
}

TEST_F(BadInput, LinesOfMtlFiles) {
  struct Case {
    std::string text;
    const char *where, *says;
  };
  std::vector<Case> cases{
      {"newmtl m\nKd 1 1 1\n", "m.mtl:2: ", "a reflectance lies in [0, 1)"},
      {"newmtl m\nKd 0.5 1.5 0.5\n", "m.mtl:2: ", "a reflectance lies in [0, 1)"},
      {"newmtl m\nKd -0.1 0 0\n", "m.mtl:2: ", "a reflectance lies in [0, 1)"},
      {"newmtl m\nKd 0.5 0.5\n", "m.mtl:2: ", "one decimal number or three"},
      {"newmtl m\nKd\n", "m.mtl:2: ", "one decimal number or three"},
      {"newmtl m\nKd red\n", "m.mtl:2: ", "one decimal number or three"},
      {"newmtl m\nKd spectral a.rfl\n", "m.mtl:2: ", "one decimal number or three"},
      {"newmtl m\nKd 0.5\nKe -1\n", "m.mtl:3: ", "finite and not negative"},
      {"newmtl m\nKd 0.5\nKe 1 2 -1e-9\n", "m.mtl:3: ", "finite and not negative"},
      {"newmtl m\nKd 0.5\nKe 1e17\n", "m.mtl:3: ", "choose other units of power"},
      {"newmtl m\nKd 0.5\nKe 1e300\n", "m.mtl:3: ", "choose other units of power"},
      {"newmtl m\nKd 0.5\nKe 1e-20\n", "m.mtl:3: ", "choose other units of power"},
      {"newmtl\nKd 0.5\n", "m.mtl:1: ", "newmtl needs a name"},
      {"Kd 0.5\nnewmtl m\n", "m.mtl:1: ", "before the first newmtl"},
      {"newmtl m\nKd 0.5\nillum 3\nKs -1 0 0\n", "m.mtl:2: ", "a share is a number from 0 to 1"},
      {"newmtl m\nKd 0.5\nillum 3\nKs x\n", "m.mtl:4: ", "one decimal number or three"},
      {"newmtl m\nKd 0.5\nillum 7\nNi glass\n", "m.mtl:4: ", "one decimal number"},
      {"newmtl other\nKd 0.5\n", "bad.obj:2: ", "add it there, or a mtllib line above"},
      {"", "bad.obj:1: ", "is empty; put it there or correct the mtllib line"},
  };
  for (const char* number : {"nan", "inf", "-inf"}) {
    cases.push_back(
        {std::string("newmtl m\nKd ") + number + "\n", "m.mtl:2: ", "a reflectance lies in [0, 1)"});
    cases.push_back(
        {std::string("newmtl m\nKd 0.5\nKe ") + number + "\n", "m.mtl:3: ", "finite and not negative"});
    cases.push_back({std::string("newmtl m\nKd 0.5\nillum 7\nTf ") + number + "\n",
                     "m.mtl:2: ", "a share is a number from 0 to 1"});
  }
  write("bad.obj", std::string(corners) + "f 1 2 3 4\n");
  for (const Case& c : cases) {
    SCOPED_TRACE(c.text);
    write("m.mtl", c.text);
    refused_scene("bad.obj", c.where, c.says);
  }
  fs::remove(path("m.mtl"));
  refused_scene("bad.obj", "bad.obj:1: ", "put it there or correct the mtllib line");
  fs::create_directory(path("m.mtl"));
  refused_scene("bad.obj", "bad.obj:1: ", "put it there or correct the mtllib line");
}

// Every polygon of the reference's family of invalid ones.
TEST_F(BadInput, PolygonsOfTheReference) {
  const auto reference = oracle::reference("d_hard_cases.json");
  const auto& all = oracle::reference_case(reference, "D-invalid").at("polygons");
  ASSERT_GE(all.size(), 11u);
  write("m.mtl", material);
  for (const auto& polygon : all) {
    std::string body = "mtllib m.mtl\nusemtl m\n", face = "f";
    int count = 0;
    for (const auto& vertex : polygon.at("vertices")) {
      body += "v";
      for (const auto& x : vertex) body += " " + (x.is_string() ? x.get<std::string>() : x.dump());
      body += "\n";
      face += " " + std::to_string(++count);
    }
    SCOPED_TRACE(polygon.at("what").get<std::string>());
    write("bad.obj", body + face + "\n");
    refused_scene("bad.obj", "bad.obj:", "");
    // The message is about a line of the polygon, not about the file.
    const std::string said = text("stderr").substr((folder_ / "bad.obj:").string().size());
    EXPECT_TRUE(said[0] >= '3' && said[0] <= '9') << said;
  }
}

using clrad_test::Gltf;
using Json = nlohmann::json;

Gltf square() {
  Gltf g;
  g.material({{"name", "lamp"},
              {"emissiveFactor", {1, 1, 1}},
              {"pbrMetallicRoughness", {{"metallicFactor", 0}, {"baseColorFactor", {0.5, 0.5, 0.5, 1}}}}});
  const int p = g.positions({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}});
  const int i = g.indices(std::vector<std::uint16_t>{0, 1, 2, 0, 2, 3});
  g.mesh({{{"attributes", {{"POSITION", p}}}, {"indices", i}, {"material", 0}}});
  g.node({{"name", "wall"}, {"mesh", 0}});
  return g;
}

TEST_F(BadInput, ContentOfGltfFiles) {
  struct Case {
    const char* where;
    const char* says;
    void (*change)(Json&);
  };
  const std::vector<Case> cases{
      {": node \"wall\", primitive 0: ", "material 7 does not exist",
       [](Json& j) { j["meshes"][0]["primitives"][0]["material"] = 7; }},
      {": node \"wall\", primitive 0: ", "it has no POSITION",
       [](Json& j) {
         j["meshes"][0]["primitives"][0]["attributes"] = {{"NORMAL", 0}};
       }},
      {": node \"wall\", primitive 0: ", "accessor 9 does not exist",
       [](Json& j) { j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 9; }},
      {": ", "indices accessor out of bounds",
       [](Json& j) { j["meshes"][0]["primitives"][0]["indices"] = 9; }},
      {": node \"wall\", primitive 0: ", "vectors of three floats",
       [](Json& j) { j["meshes"][0]["primitives"][0]["attributes"]["POSITION"] = 1; }},
      {": node \"wall\", primitive 0: ", "must be scalars",
       [](Json& j) { j["meshes"][0]["primitives"][0]["indices"] = 0; }},
      {": node \"wall\", primitive 0: ", "vectors of three floats",
       [](Json& j) { j["accessors"][0]["type"] = "VEC2"; }},
      {": node \"wall\", primitive 0: ", "unsigned bytes, shorts or ints",
       [](Json& j) { j["accessors"][1]["componentType"] = 5126, j["accessors"][1]["count"] = 3; }},
      {": node \"wall\", primitive 0: ", "reaches past the end of its buffer",
       [](Json& j) { j["accessors"][0]["count"] = 1000000000; }},
      {": node \"wall\", primitive 0: ", "reaches past the end of its buffer",
       [](Json& j) { j["accessors"][1]["byteOffset"] = 4000000000u; }},
      {": node \"wall\", primitive 0: ", "buffer 5 does not exist",
       [](Json& j) { j["bufferViews"][0]["buffer"] = 5; }},
      {": node \"wall\", primitive 0: ", "reaches past the end of its buffer",
       [](Json& j) { j["bufferViews"][0]["byteOffset"] = 1000000; }},
      {": node \"wall\", primitive 0: ", "index 2 is 2, but there are 2 vertices",
       [](Json& j) { j["accessors"][0]["count"] = 2; }},
      {": node \"wall\", primitive 0: ", "not a whole number of triangles",
       [](Json& j) { j["accessors"][1]["count"] = 5; }},
      {": node \"wall\", primitive 0: ", "sparse accessors are not read; export without them",
       [](Json& j) {
         j["accessors"][0]["sparse"] = {{"count", 1},
                                        {"indices", {{"bufferView", 1}, {"componentType", 5123}}},
                                        {"values", {{"bufferView", 0}}}};
       }},
      {": the scene: ", "node 3 does not exist",
       [](Json& j) {
         j["scenes"] = {{{"nodes", {3}}}}, j["scene"] = 0;
       }},
      {": node \"wall\": ", "mesh 4 does not exist", [](Json& j) { j["nodes"][0]["mesh"] = 4; }},
      {": node \"wall\": ", "camera 4 does not exist", [](Json& j) { j["nodes"][0]["camera"] = 4; }},
      {": node \"wall\": ", "a node has one parent and no cycle",
       [](Json& j) {
         j["nodes"][0]["children"] = {0};
         j["scenes"] = {{{"nodes", {0}}}};
       }},
      {": node \"wall\": ", "a node has one parent and no cycle",
       [](Json& j) {
         j["nodes"].push_back({{"name", "b"}, {"children", {0}}});
         j["nodes"][0]["children"] = {1};
         j["scenes"] = {{{"nodes", {0}}}};
       }},
      {": ", "at least one face", [](Json& j) { j["nodes"][0]["children"] = {0}; }},
      {": material \"lamp\": ", "a reflectance lies in [0, 1)",
       [](Json& j) {
         j["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {1, 1, 1, 1};
       }},
      {": material \"lamp\": ", "a reflectance lies in [0, 1)",
       [](Json& j) {
         j["materials"][0]["pbrMetallicRoughness"]["baseColorFactor"] = {-1, 0, 0, 1};
       }},
      {": material \"lamp\": ", "finite and not negative",
       [](Json& j) {
         j["materials"][0]["emissiveFactor"] = {0, -1, 0};
       }},
      {": material \"lamp\": ", "choose other units of power",
       [](Json& j) {
         j["materials"][0]["extensions"] = {
             {"KHR_materials_emissive_strength", {{"emissiveStrength", 1e200}}}};
       }},
      {": ", "needs extension KHR_draco_mesh_compression, which is not read; export without it",
       [](Json& j) { j["extensionsRequired"] = {"KHR_draco_mesh_compression"}; }},
      {": node \"wall\", primitive 0: ", "coordinates are finite",
       [](Json& j) {
         j["nodes"][0]["scale"] = {1e308, 1e308, 1};
       }},
      {": node \"wall\", primitive 0: ", "is --unit right",
       [](Json& j) {
         j["nodes"][0]["scale"] = {1e20, 1e20, 1};
       }},
      {": node \"wall\", primitive 0: ", "at least one face with an area",
       [](Json& j) {
         j["nodes"][0]["scale"] = {0, 0, 0};
       }},
      {": node \"wall\", primitive 0: ", "coordinates are finite",
       [](Json& j) { j["nodes"][0]["matrix"] = std::vector<double>(16, 1e308); }},
      {": node \"wall\": ", "mesh 0 does not exist", [](Json& j) { j["meshes"] = "none"; }},
      {": ", "is not valid glTF",
       [](Json& j) {
         j["buffers"] = Json::array({{{"byteLength", 60}, {"uri", "no.bin"}}});
       }},
  };
  for (const Case& c : cases) {
    Gltf g = square();
    Json j = Json::parse(g.text());
    c.change(j);
    SCOPED_TRACE(c.says);
    write("bad.gltf", j.dump());
    refused_scene("bad.gltf", std::string("bad.gltf") + c.where, c.says);
  }
  // A position that is not a number stands in the bytes.
  Gltf g;
  const float nan = std::nanf("");
  g.mesh({{{"attributes", {{"POSITION", g.positions({{0, 0, 0}, {1, 0, nan}, {0, 1, 0}})}}}}});
  g.node({{"mesh", 0}});
  write("nan.gltf", g.text());
  refused_scene("nan.gltf", "nan.gltf: node 0, primitive 0: ", "coordinates are finite");
}

TEST_F(BadInput, CutAndBrokenGltfFiles) {
  const std::string text = square().text(), binary = square().binary();
  for (const std::size_t at : {text.size() / 4, text.size() / 2, text.size() - 2}) {
    write("cut.gltf", text.substr(0, at));
    refused_scene("cut.gltf", "cut.gltf: ", "is not valid glTF, or cut off");
  }
  for (const std::size_t at :
       {std::size_t(3), std::size_t(11), std::size_t(19), binary.size() / 2, binary.size() - 4}) {
    write_bytes("cut.glb", binary.substr(0, at));
    refused_scene("cut.glb", "cut.glb: ", "");
  }
  std::string other = binary;
  other[4] = 1;  // the version
  write_bytes("other.glb", other);
  refused_scene("other.glb", "other.glb: ", "clrad reads version 2");
  other = binary;
  std::memset(other.data() + 12, 0xff, 4);  // the length of the JSON
  write_bytes("other.glb", other);
  refused_scene("other.glb", "other.glb: ", "is not valid glTF");
  std::string base64 = text;
  base64.erase(base64.find("base64,") + 20, 40);
  write("short.gltf", base64);
  refused_scene("short.gltf", "short.gltf: ", "");
  base64 = text;
  base64.replace(base64.find("base64,") + 20, 4, "!?!?");
  write("letters.gltf", base64);
  refused_scene("letters.gltf", "letters.gltf: ", "");
  write("deep.gltf", "{\"asset\":{\"version\":\"2.0\"},\"extras\":" + std::string(200000, '['));
  refused_scene("deep.gltf", "deep.gltf: ", "nests deeper than");
}

TEST_F(BadInput, FilesThatAreNotThereOrOfNoUse) {
  refused_scene("missing.obj", "missing.obj: ", "No such file");
  refused_scene("missing.gltf", "missing.gltf: ", "No such file");
  refused_scene("missing.glb", "missing.glb: ", "No such file");
  for (const char* ending : {"obj", "gltf", "glb"}) {
    const std::string name = std::string("folder.") + ending, empty = std::string("empty.") + ending;
    fs::create_directory(path(name));
    refused_scene(name, name + ": ", "name the scene file inside it");
    write(empty, "");
    refused_scene(empty, empty + ": ", "is empty");
  }
  write("scene.fbx", "x");
  refused_scene("scene.fbx", "scene.fbx: ", "clrad reads .obj, .gltf and .glb");
  write("scene", "x");
  refused_scene("scene", "scene: ", "clrad reads .obj, .gltf and .glb");
  write_bytes("binary.obj", std::string("v 0 0 0\n\0\1\2", 11));
  refused_scene("binary.obj", "binary.obj: ", "is not a text file");
  write("nothing.obj", "# nothing\n");
  refused_scene("nothing.obj", "nothing.obj: ", "at least one face");
  write("text.glb", "# nothing\n");
  refused_scene("text.glb", "text.glb: ", "is not valid glTF");
}

TEST_F(BadInput, Sensors) {
  struct Case {
    const char *text, *where, *says;
  };
  const Case cases[] = {
      {"0 0 0 0 0 1\n0 0 0 0 0\n", "bad.pts:2: ", "six numbers"},
      {"0 0 0 0 0 1 7\n", "bad.pts:1: ", "six numbers"},
      {"# x\n\n0 0 nan 0 0 1\n", "bad.pts:3: ", "six numbers"},
      {"0 0 inf 0 0 1\n", "bad.pts:1: ", "six numbers"},
      {"0 0 1e999 0 0 1\n", "bad.pts:1: ", "six numbers"},
      {"0 0 0 nan 0 1\n", "bad.pts:1: ", "six numbers"},
      {"0 0 0 0 0 -inf\n", "bad.pts:1: ", "six numbers"},
      {"0 0 zero 0 0 1\n", "bad.pts:1: ", "six numbers"},
      {"0,0,0,0,0,1\n", "bad.pts:1: ", "six numbers"},
      {"0 0 0 0 0 0\n", "bad.pts:1: ", "write a direction such as 0 0 1"},
      {"0 0 0 0 0 1\n1e300 0 0 0 0 1\n", "bad.pts:2: ", "at most"},
      {"0 0 0 0 0 1\n1e12 0 0 0 0 1\n", "bad.pts: sensor 2 ", "is --unit right"},
      {"0 0 0x10 0 0 1\n", "bad.pts:1: ", "six numbers"},
      {"", "bad.pts: ", "expected lines of x y z nx ny nz"},
      {"# nothing\n", "bad.pts: ", "expected lines of x y z nx ny nz"},
  };
  write("m.mtl", material);
  write("good.obj", std::string(corners) + "f 1 2 3 4\n");
  for (const Case& c : cases) {
    write("bad.pts", c.text);
    refused_scene("good.obj", c.where, c.says, {"--quiet", "--sensors", path("bad.pts")});
  }
  fs::create_directory(path("folder.pts"));
  refused_scene("good.obj", "folder.pts: ", "is a folder", {"--quiet", "--sensors", path("folder.pts")});
  refused_scene("good.obj", "missing.pts: ", "cannot be read", {"--quiet", "--sensors", path("missing.pts")});
}

// A checkpoint and a solution of a real solve, then what can happen to them.
TEST_F(BadInput, CheckpointsAndSolutions) {
  write("m.mtl", material);
  write("good.obj", std::string(corners) + "v 0 0 1\nv 1 0 1\nv 0 1 1\nf 1 2 3 4\nf 7 6 5\n");
  const auto solve = [&](std::vector<std::string> more) {
    std::vector<std::string> words{"solve", path("good.obj"), "--quiet", "--patch-edge",
                                   "1",     "--element-edge", "1"};
    words.insert(words.end(), more.begin(), more.end());
    return words;
  };
  ASSERT_EQ(run(solve({"--checkpoint", path("a.ck"), "--solution", path("a.clrad")})).code, 0)
      << text("stderr");
  const std::string whole[2] = {text("a.ck"), text("a.clrad")};
  for (const int kind : {0, 1}) {
    const std::string name = kind == 0 ? "b.ck" : "b.clrad";
    const auto refused_bytes = [&](const std::string& bytes, const std::string& says) {
      write_bytes(name, bytes);
      const auto words =
          kind == 0
              ? solve({"--resume", path(name), "-o", path("out"), "--json", path("r.json")})
              : std::vector<std::string>{"render", path(name), "-o", path("out"), "--image", path("i.png")};
      refused(3, words, path(name) + ": ", says);
    };
    const std::string& good = whole[kind];
    ASSERT_GT(good.size(), 400u);
    refused_bytes("", "is not a file of clrad's");
    refused_bytes("v 0 0 0\n", "is not a file of clrad's");
    refused_bytes(good.substr(0, 40), "is cut short");
    refused_bytes(good.substr(0, good.size() / 2), "is cut short");
    refused_bytes(good.substr(0, good.size() - 1), "is cut short");
    refused_bytes(good + "x", "is damaged");
    std::string other = good;
    other[8] = 99;
    refused_bytes(other, "version 99 of the format");
    for (const std::size_t at :
         {std::size_t(20), std::size_t(50), std::size_t(100), good.size() / 2, good.size() - 1}) {
      other = good;
      other[at] = char(other[at] ^ 4);
      refused_bytes(other, "is damaged");
    }
    refused_bytes(whole[1 - kind], "is needed");
    // Whole, but a number in it is none: eight bytes of ones are a NaN. Where they fall on something else, that is
    // refused, or it is still a solution; never does a file come of it that says NaN.
    for (std::size_t at = test::header_bytes; at + 8 < good.size(); at += good.size() / 8) {
      other = good;
      std::memset(other.data() + at, 0xff, 8);
      write_bytes(name, test::with_right_checksums(other));
      const auto r = kind == 0 ? run(solve({"--resume", path(name), "--json", path("r.json")}))
                               : run({"render", path(name), "--vtu", path("v.vtu"), "--quiet"});
      EXPECT_TRUE(r.code == 3 || r.code == 0) << at << ": " << r.error;
      EXPECT_TRUE(r.code == 0 || r.error.starts_with(path(name) + ": ")) << r.error;
      EXPECT_EQ(holds(kind == 0 ? "r.json" : "v.vtu"), r.code == 0);
      fs::remove(path("r.json")), fs::remove(path("v.vtu"));
    }
  }
  refused(3, {"render", path("none.clrad"), "--vtu", path("v.vtu")}, path("none.clrad") + ": ",
          "cannot be read");
  fs::create_directory(path("f.clrad"));
  refused(3, {"render", path("f.clrad"), "--vtu", path("v.vtu")}, path("f.clrad") + ": ", "is a folder");
  const auto folder = run(solve({"--resume", path("f.clrad")}));
  EXPECT_EQ(folder.code, 2);
  EXPECT_NE(folder.error.find("is actually a directory: " + path("f.clrad")), std::string::npos)
      << folder.error;
  // Of other options, of another scene.
  refused(3,
          {"solve", path("good.obj"), "--quiet", "--patch-edge", "1", "--element-edge", "1", "--samples", "9",
           "--resume", path("a.ck"), "--json", path("r.json")},
          path("a.ck") + ": ", "another --samples: it was 4, and now it is 9");
  write("good.obj", std::string(corners) + "v 0 0 1\nv 1 0 1\nv 0 1 2\nf 1 2 3 4\nf 7 6 5\n");
  refused(3, solve({"--resume", path("a.ck"), "--json", path("r.json")}), path("a.ck") + ": ",
          "another scene");
}

// Exit code 2, before anything is read: the scene is not there.
TEST_F(BadInput, ValuesOfOptions) {
  const std::vector<std::vector<std::string>> wrong{
      {"--converge", "0"},
      {"--converge", "1"},
      {"--converge", "-1e-3"},
      {"--converge", "nan"},
      {"--converge", "inf"},
      {"--converge", "tight"},
      {"--converge", ""},
      {"--samples", "0"},
      {"--samples", "5000"},
      {"--samples", "-1"},
      {"--samples", "1.5"},
      {"--samples", "99999999999999999999"},
      {"--light-samples", "4000000000"},
      {"--sensor-rays", "0"},
      {"--patch-edge", "0"},
      {"--patch-edge", "-1"},
      {"--patch-edge", "nan"},
      {"--patch-edge", "inf"},
      {"--element-edge", "-0.1"},
      {"--element-edge", "1e999"},
      {"--engine", "magic"},
      {"--grid", "0x1x1"},
      {"--grid", "8x8"},
      {"--grid", "8x8x8x8"},
      {"--grid", "513x1x1"},
      {"--form-factor", "good"},
      {"--solver", "jacobi"},
      {"--shooters", "0"},
      {"--adaptive", "-1"},
      {"--adaptive", "nan"},
      {"--adaptive", "inf"},
      {"--max-level", "16"},
      {"--min-area", "-1"},
      {"--min-area", "nan"},
      {"--min-projected-area", "inf"},
      {"--refine-every", "0"},
      {"--checkpoint-every", "-1"},
      {"--checkpoint-every", "inf"},
      {"--size", "640"},
      {"--size", "0x10"},
      {"--size", "20000x10"},
      {"--size", "1e3x10"},
      {"--exposure", "nan"},
      {"--exposure", "1e9"},
      {"--depth", "65"},
      {"--unit", "0"},
      {"--unit", "-1"},
      {"--unit", "nan"},
      {"--unit", "parsec"},
      {"--unit", "1e-323mm"},
      {"--image", "a.gif"},
      {"--gltf", "a.obj"},
      {"--vtu", "a.vtk"},
      {"--solution", "a.bin"},
      {"--image", "no/such/folder/a.png"},
      {"--json", "no/such/folder/a.json"},
      {"--json", "."},
      {"--checkpoint", "no/such/folder/a.ck"},
      {"--precision", "half"},
      {"--work-group", "0"},
      {"--packet", "3"},
      {"--cores", "0"},
      {"--seed", "x"},
      {"--resume", "no/such/file.ck"},
      {"--sensors"},
      {"--no-such-option"},
      {"one-scene-too-many.obj"},
  };
  for (const auto& option : wrong) {
    SCOPED_TRACE(option[0] + " " + (option.size() > 1 ? option[1] : ""));
    std::vector<std::string> words{"solve", path("none.obj"), "-o", path("out")};
    words.insert(words.end(), option.begin(), option.end());
    const auto before = listing();
    const Outcome r = run(words);
    EXPECT_EQ(r.code, 2) << r.error;
    EXPECT_TRUE(r.out.empty()) << r.out;
    EXPECT_FALSE(r.error.empty());
    EXPECT_TRUE(listing() == before) << "the folder has changed: " << names();
  }
}

// What needs the scene or the device to be judged.
TEST_F(BadInput, ValuesThatDoNotSuitTheScene) {
  write("m.mtl", material);
  write("good.obj", std::string(corners) + "f 1 2 3 4\n");
  const auto with = [&](int code, std::vector<std::string> more, const std::string& says) {
    std::vector<std::string> words{"solve", path("good.obj"), "-o", path("out"), "--quiet"};
    words.insert(words.end(), more.begin(), more.end());
    refused(code, words, "", says);
  };
  with(2, {"--camera", "0,0,0,0,0,0"}, "the same point");
  with(2, {"--camera", "0,0,nan,0,0,0"}, "--camera");
  with(2, {"--camera", "0,0,1,0,0,0,180"}, "field of view");
  with(2, {"--camera", "0,0,1,0,0"}, "--camera");
  with(2, {"--camera", "1e300,0,1,0,0,0"}, "too far away");
  with(2, {"--memory", "0"}, "--memory");
  with(2, {"--memory", "1e300G"}, "--memory");
  with(2, {"--memory", "1000000G"}, "--memory");
  // These list the devices there are, one a line.
  for (const char* device : {"abacus", "99999"}) {
    const Outcome r = run({"solve", path("good.obj"), "-o", path("out"), "--quiet", "--device", device});
    EXPECT_EQ(r.code, 2) << r.error;
    EXPECT_NE(r.error.find(device), std::string::npos) << r.error;
    EXPECT_FALSE(holds("out"));
  }
  with(2, {"--cores", "1000000"}, "more than the");
  // Meshes that no machine holds are refused before they are begun.
  with(2, {"--patch-edge", "1e-9"}, "larger --patch-edge");
  with(2, {"--patch-edge", "1e-300"}, "larger --patch-edge");
  // 297 GiB: half of what the machines are that would begin this one.
  with(1, {"--element-edge", "3e-5", "--patch-edge", "1e-4"}, "larger --patch-edge and --element-edge");
  with(1, {"--memory", "1M"}, "allow more");
}

}  // namespace
}  // namespace clrad

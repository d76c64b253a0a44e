#include <tiny_gltf.h>

#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "clrad/error.hpp"
#include "clrad/output.hpp"
#include "output/support.hpp"
#include "output/tone.hpp"
#include "render/support.hpp"

namespace clrad {
namespace {

using nlohmann::json;
using test::polygon;

// Two materials in use and one not, a quad, a general quad and a triangle, a covered vertex, far from the
// origin.
Solution sample_solution(unsigned bands) {
  const glm::dvec3 o(4e5, -7e5, 2.5);
  Scene scene = test::scene(
      {polygon({o, o + glm::dvec3(1, 0, 0), o + glm::dvec3(1, 1, 0), o + glm::dvec3(0, 1, 0)}),
       polygon({o, o + glm::dvec3(0, 0, 1), o + glm::dvec3(0.7, 0, 0.8), o + glm::dvec3(1, 0, 0)}, 2),
       polygon({o + glm::dvec3(0, 0, 1), o + glm::dvec3(1, 0.3, 1), o + glm::dvec3(0, 1, 1)}, 2)},
      bands);
  scene.materials = {test::material(bands, 0.3), test::material(bands, 0.9), test::material(bands, 0.6, 2.5)};
  scene.materials[2].name = "lamp \"\xc3\xa4\"";
  Solution s = test::solution(scene, 0.3, [&](std::uint32_t p, std::uint32_t band, const glm::dvec3& x) {
    const glm::dvec3 d = x - o;
    return 1 + p + band + 0.37 * d.x + d.y * d.y + std::sin(3 * d.z);
  });
  s.vertex_covered[7] = 1;
  return s;
}

// A GLB's or glTF's JSON and buffer, taken apart by hand (specification section 4.4).
struct Parts {
  json root;
  std::string buffer;
};

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t w;
  std::memcpy(&w, bytes.data() + at, 4);
  return w;
}

Parts glb_parts(const std::string& bytes) {
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(bytes, 4), 2u);
  EXPECT_EQ(word(bytes, 8), bytes.size());
  const std::uint32_t length = word(bytes, 12);
  EXPECT_EQ(length % 4, 0u);
  EXPECT_EQ(bytes.substr(16, 4), "JSON");
  const std::size_t second = 20 + length;
  EXPECT_EQ(word(bytes, second) % 4, 0u);
  EXPECT_EQ(bytes.substr(second + 4, 4), std::string("BIN\0", 4));
  EXPECT_EQ(second + 8 + word(bytes, second), bytes.size());
  return {json::parse(bytes.substr(20, length)), bytes.substr(second + 8)};
}

template <class T>
std::vector<T> values(const Parts& parts, std::size_t accessor) {
  const json& a = parts.root["accessors"][accessor];
  const json& v = parts.root["bufferViews"][a["bufferView"].get<std::size_t>()];
  const std::size_t components = a["type"] == "VEC3" ? 3 : 1;
  std::vector<T> out(a["count"].get<std::size_t>() * components);
  std::memcpy(out.data(), parts.buffer.data() + v["byteOffset"].get<std::size_t>(), out.size() * sizeof(T));
  return out;
}

// The rules of the specification that a validator would check of a file of this kind.
void expect_valid(const Parts& parts) {
  const json& root = parts.root;
  EXPECT_EQ(root["asset"]["version"], "2.0");
  EXPECT_FALSE(root["asset"]["generator"].get<std::string>().empty());
  const std::set<std::string> known{"asset",  "extensionsUsed", "scene",     "scenes",      "nodes",
                                    "meshes", "materials",      "accessors", "bufferViews", "buffers"};
  for (const auto& [key, value] : root.items()) EXPECT_TRUE(known.count(key)) << key;
  ASSERT_EQ(root["buffers"].size(), 1u);
  const std::size_t length = root["buffers"][0]["byteLength"];
  EXPECT_LE(length, parts.buffer.size());
  EXPECT_LT(parts.buffer.size() - length, 4u);

  // Views: aligned, inside the buffer, without overlap or gap, each used by one accessor with its target.
  std::size_t end = 0;
  for (const json& view : root["bufferViews"]) {
    EXPECT_EQ(view["byteOffset"].get<std::size_t>() % 4, 0u);
    EXPECT_EQ(view["byteOffset"].get<std::size_t>(), end);
    EXPECT_GT(view["byteLength"].get<std::size_t>(), 0u);
    EXPECT_FALSE(view.contains("byteStride"));
    end += view["byteLength"].get<std::size_t>();
  }
  EXPECT_EQ(end, length);
  std::vector<int> view_uses(root["bufferViews"].size(), 0), accessor_uses(root["accessors"].size(), 0),
      material_uses(root["materials"].size(), 0);
  for (const json& a : root["accessors"]) {
    ++view_uses[a["bufferView"].get<std::size_t>()];
    EXPECT_GT(a["count"].get<std::size_t>(), 0u);
    EXPECT_TRUE(a["componentType"] == 5126 || a["componentType"] == 5125);
    const std::size_t bytes = a["count"].get<std::size_t>() * (a["type"] == "VEC3" ? 12 : 4);
    EXPECT_EQ(root["bufferViews"][a["bufferView"].get<std::size_t>()]["byteLength"], bytes);
  }
  for (const int uses : view_uses) EXPECT_EQ(uses, 1);

  ASSERT_EQ(root["meshes"].size(), 1u);
  for (const json& primitive : root["meshes"][0]["primitives"]) {
    EXPECT_EQ(primitive["mode"], 4);
    ++material_uses[primitive["material"].get<std::size_t>()];
    const std::size_t count =
        root["accessors"][primitive["attributes"]["POSITION"].get<std::size_t>()]["count"];
    for (const auto& [name, index] : primitive["attributes"].items()) {
      EXPECT_TRUE(name == "POSITION" || name == "COLOR_0" || name[0] == '_') << name;
      const json& a = root["accessors"][index.get<std::size_t>()];
      ++accessor_uses[index.get<std::size_t>()];
      EXPECT_EQ(a["count"], count);
      EXPECT_EQ(a["componentType"], 5126);
      EXPECT_EQ(root["bufferViews"][a["bufferView"].get<std::size_t>()]["target"], 34962);
      for (const float x : values<float>(parts, index.get<std::size_t>())) {
        ASSERT_TRUE(std::isfinite(x)) << name;
        if (name == "COLOR_0") {
          ASSERT_GE(x, 0);
          ASSERT_LE(x, 1);
        }
      }
    }
    const std::size_t indices = primitive["indices"];
    ++accessor_uses[indices];
    EXPECT_EQ(root["accessors"][indices]["type"], "SCALAR");
    EXPECT_EQ(root["accessors"][indices]["componentType"], 5125);
    EXPECT_EQ(root["bufferViews"][root["accessors"][indices]["bufferView"].get<std::size_t>()]["target"],
              34963);
    const auto corner = values<std::uint32_t>(parts, indices);
    ASSERT_EQ(corner.size() % 3, 0u);
    for (std::size_t i = 0; i < corner.size(); i += 3) {
      ASSERT_LT(std::max({corner[i], corner[i + 1], corner[i + 2]}), count);
      ASSERT_TRUE(corner[i] != corner[i + 1] && corner[i + 1] != corner[i + 2] && corner[i] != corner[i + 2]);
    }
  }
  for (const int uses : accessor_uses) EXPECT_GE(uses, 1);
  for (const int uses : material_uses) EXPECT_EQ(uses, 1);

  // Bounds of POSITION are those of the stored floats, exactly.
  const std::size_t position = root["meshes"][0]["primitives"][0]["attributes"]["POSITION"];
  const auto xyz = values<float>(parts, position);
  for (int c = 0; c < 3; ++c) {
    float low = xyz[c], high = xyz[c];
    for (std::size_t i = c; i < xyz.size(); i += 3)
      low = std::min(low, xyz[i]), high = std::max(high, xyz[i]);
    EXPECT_EQ(root["accessors"][position]["min"][c].get<double>(), double(low));
    EXPECT_EQ(root["accessors"][position]["max"][c].get<double>(), double(high));
  }
  std::set<std::string> used, declared;
  for (const json& material : root["materials"])
    for (const auto& [name, value] : material["extensions"].items()) used.insert(name);
  for (const json& name : root["extensionsUsed"]) declared.insert(name.get<std::string>());
  EXPECT_EQ(used, declared);
  EXPECT_EQ(root["scene"], 0);
  EXPECT_EQ(root["scenes"][0]["nodes"], json::array({0}));
  EXPECT_EQ(root["nodes"][0]["mesh"], 0);
}

class Gltf : public test::FileTest {};

TEST_F(Gltf, GlbObeysTheSpecification) {
  for (const unsigned bands : {1u, 3u, 5u}) {
    write_gltf(in_folder("a.glb"), sample_solution(bands));
    expect_valid(glb_parts(bytes(in_folder("a.glb"))));
  }
}

TEST_F(Gltf, TriangleForTriangleTheMesh) {
  const Solution s = sample_solution(3);
  write_gltf(in_folder("a.glb"), s);
  const Parts parts = glb_parts(bytes(in_folder("a.glb")));
  const json& primitives = parts.root["meshes"][0]["primitives"];
  ASSERT_EQ(primitives.size(), 2u);  // the second material is on no polygon
  EXPECT_EQ(parts.root["materials"][1]["name"], s.scene.materials[2].name);
  std::map<std::uint32_t, std::vector<std::uint32_t>> expected;
  for (const Element& e : s.mesh.elements) {
    auto& list = expected[s.scene.polygons[s.mesh.patches[e.patch].polygon].material];
    for (const int k : {0, 1, 2}) list.push_back(e.vertex[k]);
    if (e.vertex[3] != 0xffffffffu)
      for (const int k : {0, 2, 3}) list.push_back(e.vertex[k]);
  }
  EXPECT_EQ(values<std::uint32_t>(parts, primitives[0]["indices"]), expected[0]);
  EXPECT_EQ(values<std::uint32_t>(parts, primitives[1]["indices"]), expected[2]);
  // Positions: half an ulp of a coordinate below 1 m, though the scene stands 8e5 m away.
  const auto xyz = values<float>(parts, primitives[0]["attributes"]["POSITION"]);
  const json& translation = parts.root["nodes"][0]["translation"];
  for (std::size_t v = 0; v < s.vertex_count(); ++v)
    for (int c = 0; c < 3; ++c)
      ASSERT_NEAR(translation[c].get<double>() + xyz[3 * v + c], s.mesh.position_m[v][c], std::ldexp(1, -24));
}

// Stored as float: every value within half an ulp, 2^-24 of it. A mean is a sum of values >= 0 with weights
// >= 0 that add up to 1, so its relative error is no larger; the sums in double add 1e-13 at most.
TEST_F(Gltf, RadiosityReadBackIsThatOfTheReport) {
  for (const unsigned bands : {1u, 3u, 4u}) {
    const Solution s = sample_solution(bands);
    write_gltf(in_folder("a.glb"), s);
    const Parts parts = glb_parts(bytes(in_folder("a.glb")));
    const json& attributes = parts.root["meshes"][0]["primitives"][0]["attributes"];
    const auto read = [&](const std::string& name, std::uint32_t band, std::uint32_t v) -> double {
      if (bands == 3) return values<float>(parts, attributes[name])[3 * v + band];
      return values<float>(parts, attributes[bands == 1 ? name : name + "_" + std::to_string(band)])[v];
    };
    const auto means = polygon_means(s);
    const json report = json::parse(report_json(s));
    for (std::uint32_t p = 0; p < s.scene.polygons.size(); ++p)
      for (std::uint32_t band = 0; band < bands; ++band) {
        const PolygonMesh& mesh = s.mesh.polygons[p];
        for (std::uint32_t v = mesh.first_vertex; v < mesh.first_vertex + mesh.vertices; ++v) {
          ASSERT_EQ(read("_RADIOSITY", band, v), float(s.vertex_radiosity(band, v, p)));
          ASSERT_EQ(read("_IRRADIANCE", band, v), float(s.vertex_irradiance[band * s.vertex_count() + v]));
        }
        double power = 0, area = 0;
        for (std::uint32_t e = mesh.first_element; e < mesh.first_element + mesh.elements; ++e) {
          const Element& element = s.mesh.elements[e];
          area += element.area_m2;
          for (int k = 0; k < 4; ++k)
            if (element.vertex[k] != 0xffffffffu)
              power += element.area_m2 * element.weight[k] * read("_RADIOSITY", band, element.vertex[k]);
        }
        const double bound = means[p].radiosity[band] * (std::ldexp(1, -24) + 1e-13);
        EXPECT_NEAR(power / area, means[p].radiosity[band], bound);
        EXPECT_EQ(report["polygons"][p]["radiosity_W_m2"][band].get<double>(), means[p].radiosity[band]);
      }
  }
}

TEST_F(Gltf, ColoursAreTheExposedDisplayRadiosity) {
  const Solution s = sample_solution(3);
  write_gltf(in_folder("a.glb"), s);
  const Parts parts = glb_parts(bytes(in_folder("a.glb")));
  const auto colours =
      values<float>(parts, parts.root["meshes"][0]["primitives"][0]["attributes"]["COLOR_0"]);
  const auto b = display_radiosity(s);
  const std::size_t n = s.vertex_count();
  std::vector<double> luminances;
  for (std::size_t v = 0; v < n; ++v)
    luminances.push_back(0.2126 * b[v] + 0.7152 * b[n + v] + 0.0722 * b[2 * n + v]);
  const double exposure = automatic_exposure(luminances);
  for (std::size_t v = 0; v < n; ++v) {
    double colour[3] = {b[v], b[n + v], b[2 * n + v]};
    expose(colour, exposure, true);
    // Luminances were summed from floats: 2^-24 of relative difference in the exposure, and as much in the
    // float stored.
    for (int c = 0; c < 3; ++c) ASSERT_NEAR(colours[3 * v + c], colour[c], std::ldexp(1, -22));
  }
}

TEST_F(Gltf, AnotherReaderUnderstandsBothForms) {
  const Solution s = sample_solution(3);
  write_gltf(in_folder("a.glb"), s);
  write_gltf(in_folder("a.gltf"), s);
  EXPECT_EQ(files(), 2u);
  tinygltf::Model binary, text;
  tinygltf::TinyGLTF reader;
  std::string error, warning;
  ASSERT_TRUE(reader.LoadBinaryFromFile(&binary, &error, &warning, in_folder("a.glb"))) << error;
  ASSERT_TRUE(reader.LoadASCIIFromFile(&text, &error, &warning, in_folder("a.gltf"))) << error;
  EXPECT_EQ(error + warning, "");
  EXPECT_EQ(text.buffers[0].data, binary.buffers[0].data);
  EXPECT_EQ(text.accessors, binary.accessors);
  EXPECT_EQ(binary.meshes[0].primitives.size(), 2u);
  EXPECT_EQ(binary.accessors[binary.meshes[0].primitives[0].attributes.at("_RADIOSITY")].type,
            TINYGLTF_TYPE_VEC3);
  EXPECT_EQ(binary.nodes[0].translation,
            (std::vector<double>{s.frame.centre.x, s.frame.centre.y, s.frame.centre.z}));
  expect_valid(glb_parts(bytes(in_folder("a.glb"))));
}

TEST_F(Gltf, RefusesOtherEndingsAndEmptyMeshes) {
  EXPECT_THROW(write_gltf(in_folder("a.obj"), sample_solution(1)), UsageError);
  EXPECT_THROW(write_gltf(in_folder("a.glb"), Solution{}), UsageError);
  EXPECT_EQ(files(), 0u);
}

}  // namespace
}  // namespace clrad

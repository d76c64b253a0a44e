#include <cstdlib>
#include <map>
#include <nlohmann/json.hpp>

#include "output/adaptive.hpp"
#include "output/support.hpp"
#include "output/tone.hpp"

namespace clrad {
namespace {

using nlohmann::json;
using test::none;

std::vector<std::uint32_t> chain(const Element& e) {
  std::vector<std::uint32_t> all;
  for (std::uint32_t k = 0; k < test::corners_of(e); ++k) {
    all.push_back(e.vertex[k]);
    if (e.middle[k] != none) all.push_back(e.middle[k]);
  }
  return all;
}

// Edges on the polygons' sides: one cell each by right.
std::size_t boundary_edges(const Solution& s) {
  const Mesh& mesh = s.mesh;
  std::size_t count = 0;
  for (const Element& e : mesh.elements) {
    const std::uint32_t polygon = mesh.patches[e.patch].polygon;
    const PolygonMesh& m = mesh.polygons[polygon];
    const std::uint32_t u = m.patches_u * lattice_unit(0), v = m.patches_v * lattice_unit(0);
    const auto all = chain(e);
    for (std::size_t k = 0; k < all.size(); ++k) {
      const auto &a = mesh.lattice[all[k]], &b = mesh.lattice[all[(k + 1) % all.size()]];
      const bool low = (a[0] == 0 && b[0] == 0) || (a[1] == 0 && b[1] == 0);
      const bool high = s.scene.polygons[polygon].corners == 4
                            ? (a[0] == u && b[0] == u) || (a[1] == v && b[1] == v)
                            : a[0] + a[1] == u && b[0] + b[1] == u;
      count += low || high;
    }
  }
  return count;
}

// What the file must hold, from the solution alone.
json expectation(const Solution& s) {
  const std::size_t n = s.vertex_count();
  json all;
  json &point = all["point_data"], &cell = all["cell_data"];
  const auto array = [](const char* type, const std::vector<std::string>& components = {}) {
    return json{{"type", type}, {"components", components}, {"tuples", json::array()}};
  };
  point["radiosity"] = array("double", s.scene.bands), point["irradiance"] = array("double", s.scene.bands);
  point["covered"] = array("unsigned char"), point["luminance"] = array("double");
  point["display_colour"] = array("unsigned char", {"red", "green", "blue"});
  const auto display = display_radiosity(s);
  std::vector<double> luminances;
  for (std::size_t v = 0; v < n; ++v) {
    std::vector<float> bands;
    for (std::uint32_t b = 0; b < s.bands; ++b) bands.push_back(float(display[b * n + v]));
    luminances.push_back(luminance(bands.data(), s.bands));
  }
  const double exposure = automatic_exposure(luminances);
  for (std::uint32_t v = 0; v < n; ++v) {
    const auto& p = s.mesh.position_m[v];
    all["points"].push_back({p.x, p.y, p.z});
    json radiosity, irradiance;
    for (std::uint32_t b = 0; b < s.bands; ++b) {
      radiosity.push_back(s.vertex_radiosity(b, v, s.mesh.receivers[v].surface));
      irradiance.push_back(s.vertex_irradiance[b * n + v]);
    }
    point["radiosity"]["tuples"].push_back(radiosity);
    point["irradiance"]["tuples"].push_back(irradiance);
    point["covered"]["tuples"].push_back({s.vertex_covered[v]});
    point["luminance"]["tuples"].push_back({luminances[v] / 3.14159265358979323846});
    double colour[3];
    for (std::size_t c = 0; c < 3; ++c) colour[c] = s.bands == 3 ? display[c * n + v] : luminances[v];
    expose(colour, exposure, true);
    json codes;
    for (const double c : colour) codes.push_back(std::lround(255 * srgb_encoded(c)));
    point["display_colour"]["tuples"].push_back(codes);
  }
  for (const char* name : {"polygon", "patch", "material", "level"}) cell[name] = array("unsigned int");
  cell["area_m2"] = array("double"), cell["mean_radiosity"] = array("double", s.scene.bands);
  for (const Element& e : s.mesh.elements) {
    const auto points = chain(e);
    const std::uint32_t corners = test::corners_of(e), polygon = s.mesh.patches[e.patch].polygon;
    all["cells"].push_back({{"class", points.size() > corners ? "vtkPolygon"
                                      : corners == 3          ? "vtkTriangle"
                                                              : "vtkQuad"},
                            {"points", points}});
    cell["polygon"]["tuples"].push_back({polygon});
    cell["patch"]["tuples"].push_back({e.patch});
    cell["material"]["tuples"].push_back({s.scene.polygons[polygon].material});
    cell["level"]["tuples"].push_back({e.level});
    cell["area_m2"]["tuples"].push_back({e.area_m2});
    json means;
    for (std::uint32_t b = 0; b < s.bands; ++b) {
      double mean = 0;
      for (std::uint32_t k = 0; k < corners; ++k)
        mean += e.weight[k] * s.vertex_radiosity(b, e.vertex[k], polygon);
      means.push_back(mean);
    }
    cell["mean_radiosity"]["tuples"].push_back(means);
  }
  const bool photometric = s.scene.quantity == Quantity::photometric;
  all["field_data"] = {{"quantity", {photometric ? "photometric" : "radiometric"}},
                       {"unit", {photometric ? "lm/m^2" : "W/m^2"}},
                       {"luminance_unit", {photometric ? "cd/m^2" : "W/(sr m^2)"}},
                       {"bands", s.scene.bands}};
  all["boundary_edges"] = boundary_edges(s);
  all["report"] = json::parse(report_json(s));
  return all;
}

class Vtu : public test::FileTest {
 protected:
  // Debian's Python, which has Debian's VTK; what it prints, and "" when all is as expected.
  std::string read_back(const json& expected) {
    write_file(in_folder("expected.json"), expected.dump());
    const std::string log = in_folder("log"), script = CLRAD_TEST_DATA "/../output/read_vtu.py";
    const int status = std::system(("/usr/bin/python3 '" + script + "' '" + in_folder("a.vtu") + "' '" +
                                    in_folder("expected.json") + "' >'" + log + "' 2>&1")
                                       .c_str());
    return status == 0 ? bytes(log) : "refused: " + bytes(log);
  }
};

TEST_F(Vtu, VtksOwnReaderFindsTheSolution) {
  for (const unsigned bands : {1u, 3u, 5u}) {
    Solution s = test::adaptive_solution(bands);
    if (bands == 3) s.scene.quantity = Quantity::photometric;
    if (bands == 5) s.scene.bands[2] = "near <infrared> & \"more\"";
    s.vertex_covered[7] = 1;
    write_vtu(in_folder("a.vtu"), s);
    EXPECT_EQ(read_back(expectation(s)), "") << bands << " bands; the test needs the package python3-vtk9";
  }
}

TEST_F(Vtu, TheComparisonSeesDifferences) {
  const Solution s = test::adaptive_solution(3);
  write_vtu(in_folder("a.vtu"), s);
  const json right = expectation(s);
  const auto seen = [&](const char* pointer, const json& value, const std::string& message) {
    json wrong = right;
    ASSERT_NE(wrong.at(json::json_pointer(pointer)), value);
    wrong[json::json_pointer(pointer)] = value;
    const std::string answer = read_back(wrong);
    EXPECT_EQ(answer.rfind("refused: ", 0), 0u) << pointer;
    EXPECT_NE(answer.find(message), std::string::npos) << answer;
  };
  seen("/points/3/1", 0.125, "points differ");
  seen("/point_data/radiosity/tuples/3/2", 0.125, "radiosity: values differ");
  seen("/cell_data/level/tuples/0/0", 7, "level: values differ");
  seen("/cells/0/points/0", 1, "cell 0 has the points");
  seen("/boundary_edges", 0, "edges on one cell only");
  seen("/report/polygons/1/radiosity_W_m2/0", 0.125, "mean radiosity");
}

TEST_F(Vtu, RefusesOtherEndingsAndEmptyMeshes) {
  EXPECT_THROW(write_vtu(in_folder("a.vtk"), test::adaptive_solution(1)), UsageError);
  EXPECT_THROW(write_vtu(in_folder("a.vtu"), Solution{}), UsageError);
  Solution torn = test::adaptive_solution(1);
  torn.vertex_covered.pop_back();
  EXPECT_THROW(write_vtu(in_folder("a.vtu"), torn), UsageError);
  EXPECT_EQ(files(), 0u);
}

}  // namespace
}  // namespace clrad

// Whole solves with known answers, at moderate reflectance: family C's boxes, rooms, furnaces, spheres and plates, read from
// OBJ files.
//
// What is allowed. Where meshing makes an error, a solve on a mesh twice as coarse tells how large it is: a method whose
// error falls at least in proportion to the elements' size is off by no more than the two solves differ. That difference,
// the worst over all points of a case, is allowed at each of them, and with it the reference's own error, light that is
// still unshot (converge / (1 - rho)) and 1e-5 of rounding of factors, amplified by 1 / (1 - rho).
#include <gtest/gtest.h>

#include <cmath>

#include "hard/obj_scene.hpp"
#include "hard/table.hpp"

namespace clrad {
namespace {

using test::corners_of;
using test::HardCase;
using test::ObjScene;

ObjScene scene_of(const oracle::json& polygons, double* brightest = nullptr) {
  ObjScene scene;
  double rho = 0;
  for (const auto& p : polygons) {
    const auto reflectance = p["reflectance"].get<std::vector<double>>();
    rho = std::max({rho, reflectance[0], reflectance[1], reflectance[2]});
    scene.face(corners_of(p["vertices"]), scene.material(reflectance, p["emission"]), p["name"]);
  }
  if (brightest != nullptr) *brightest = rho;
  return scene;
}

// The same material everywhere.
ObjScene furnace(const oracle::json& polygons, const std::vector<double>& rho,
                 const std::vector<double>& emitted) {
  ObjScene scene;
  const int material = scene.material(rho, emitted);
  for (const auto& p : polygons) scene.face(corners_of(p), material);
  return scene;
}

SolveOptions options_of(const oracle::json& points, const MeshOptions& mesh, double converge) {
  SolveOptions options;
  options.mesh = mesh;
  options.converge = converge;
  for (const auto& p : points) options.sensors.push_back({oracle::vec(p["point"]), oracle::vec(p["normal"])});
  return options;
}

TEST(HardEnclosures, BoxesAndADaylitRoomAtPoints) {
  constexpr double converge = 1e-5;
  for (const auto& c : test::cases_of("c_boxes.json")) {
    HardCase verdict(fmt::format("{}: irradiance at {} points, also 0.1 m and less from edges and corners",
                                 c["description"].get<std::string>(), c["points"].size()),
                     "One patch a face misses gradients at edges; points near corners are off by 20 %");
    double rho = 0;
    const ObjScene scene = scene_of(c["scene"], &rho);
    const Scene loaded = scene.load();
    const Frame frame = frame_of(loaded);
    const double extent = frame.metres() * 1.5;  // its order is what matters
    Device device;
    std::vector<SensorResult> got[2];
    for (const int fine : {0, 1}) {
      const double h = extent / (fine ? 12 : 6);
      SolveOptions options = options_of(c["points"], {h, h / 3}, converge);
      options.sensor_rays = 1 << 17;  // so many that light is gathered anew at the vertices of either mesh
      options.error = false;
      got[fine] = solve(device, loaded, options).sensors;
    }
    // A scene without colours is read as one band.
    const auto at = [&](int fine, std::size_t point, std::size_t band) {
      const auto& h = got[fine][point].irradiance;
      return h[std::min(band, h.size() - 1)];
    };
    double differs = 0;
    for (std::size_t i = 0; i < got[1].size(); ++i)
      for (std::size_t b = 0; b < 3; ++b)
        differs = std::max(differs, std::abs(at(0, i, b) / at(1, i, b) - 1));
    for (std::size_t i = 0; i < got[1].size(); ++i)
      for (std::size_t b = 0; b < 3; ++b) {
        const double expected = c["points"][i]["H"][b], known = c["points"][i]["H_rel_error_estimate"][b];
        verdict.relative(at(1, i, b), expected, differs + known + (2 * converge + 1e-5) / (1 - rho),
                         fmt::format("point {} band {}", i, b));
      }
    EXPECT_LT(differs, 0.03) << "the meshes are too coarse to say anything";
  }
}

// Where all emit E and reflect rho, B = E / (1 - rho) at every point: factors of a convex enclosure are exact at points, so
// there is no meshing error. Rounding of a factor, 1e-5, is amplified by rho / (1 - rho) at most.
TEST(HardEnclosures, ConvexFurnaces) {
  constexpr double converge = 1e-6;
  Device device;
  for (const auto& c : test::cases_of("c_closed_forms.json")) {
    if (c["kind"] != "white_furnace") continue;
    const std::string what = c["description"];
    // Not convex: visibility is sampled there, and the solve for high reflectance answers for it.
    if (what.starts_with("L-shaped") || what.starts_with("room with a block")) continue;
    HardCase verdict(fmt::format("White furnace, {}, rho up to 0.9: every vertex and sensor", what),
                     "Rows of form factors that sum to 0.9 or 1.1 at edges and corners");
    std::vector<std::vector<double>> sets;  // three reflectances each
    std::vector<double> emitted = c["emission"];
    if (c.contains("rho"))
      sets = {{0.1, 0.3, 0.5}, {0.8, 0.9, 0.5}};
    else
      sets = {c["reflectance_rgb"].get<std::vector<double>>()};
    for (const auto& rho : sets) {
      const Scene scene = furnace(c["polygons"], rho, emitted).load();
      SolveOptions options;
      const double extent = frame_of(scene).metres();
      options.mesh = {extent / 2, extent / 8};
      options.samples = 1, options.light_samples = 0;
      options.converge = converge;
      const glm::dvec3 middle = frame_of(scene).centre;
      options.sensors = {{middle, {0, 0, 1}}, {middle, glm::normalize(glm::dvec3(1, 2, -3))}};
      const Solution s = solve(device, scene, options);
      for (std::uint32_t b = 0; b < 3; ++b) {
        const double expected = emitted[b] / (1 - rho[b]), allowed = (1e-5 + 2 * converge) / (1 - rho[b]);
        for (std::uint32_t p = 0; p < s.mesh.polygons.size(); ++p)
          for (std::uint32_t k = 0; k < s.mesh.polygons[p].vertices; ++k)
            verdict.relative(s.vertex_radiosity(b, s.mesh.polygons[p].first_vertex + k, p), expected, allowed,
                             fmt::format("polygon {} rho {}", p, rho[b]));
        for (const auto& sensor : s.sensors)
          verdict.relative(sensor.irradiance[b], expected, allowed, "in the middle");
      }
    }
  }
}

// In a sphere every point sees every other alike: H is the same everywhere. On the icosphere of flat triangles, F_ij is
// A_j / A only nearly, by a relative 1 - cos of the triangles' half angle or so; level 2 has edges of 0.3 rad: 1 - cos 0.15
// = 1.1 %, either way for both cosines and the distance: 4 x that. The light that goes round (H's mean) is exact.
TEST(HardEnclosures, Spheres) {
  Device device;
  for (const auto& c : test::cases_of("c_closed_forms.json")) {
    if (c["kind"] != "closed_sphere") continue;
    HardCase verdict(
        fmt::format("Inside of a sphere of 320 triangles: {}",
                    c["description"].get<std::string>().substr(27)),
        "Neighbours at almost 180 degrees: factors between them cancel, and rows sum to less than 1");
    ObjScene scene;
    const double a = c["rho_a"], b = c["rho_b"], cap = c["emission_cap_z_min"], e = c["emission"];
    // The reference's icosphere, facing the centre.
    std::vector<test::Corners> faces;
    {
      const double g = (1 + std::sqrt(5.0)) / 2;
      const std::vector<glm::dvec3> v{{-1, g, 0}, {1, g, 0}, {-1, -g, 0}, {1, -g, 0},
                                      {0, -1, g}, {0, 1, g}, {0, -1, -g}, {0, 1, -g},
                                      {g, 0, -1}, {g, 0, 1}, {-g, 0, -1}, {-g, 0, 1}};
      const int f[20][3] = {{0, 11, 5}, {0, 5, 1},  {0, 1, 7},   {0, 7, 10}, {0, 10, 11},
                            {1, 5, 9},  {5, 11, 4}, {11, 10, 2}, {10, 7, 6}, {7, 1, 8},
                            {3, 9, 4},  {3, 4, 2},  {3, 2, 6},   {3, 6, 8},  {3, 8, 9},
                            {4, 9, 5},  {2, 4, 11}, {6, 2, 10},  {8, 6, 7},  {9, 8, 1}};
      for (const auto& t : f)
        faces.push_back({glm::normalize(v[t[0]]), glm::normalize(v[t[1]]), glm::normalize(v[t[2]])});
      for (int level = 0; level < 2; ++level) {
        std::vector<test::Corners> finer;
        for (const auto& t : faces) {
          const glm::dvec3 ab = glm::normalize(t[0] + t[1]), bc = glm::normalize(t[1] + t[2]),
                           ca = glm::normalize(t[2] + t[0]);
          finer.insert(finer.end(), {{t[0], ab, ca}, {ab, t[1], bc}, {ca, bc, t[2]}, {ab, bc, ca}});
        }
        faces = finer;
      }
    }
    for (const auto& t : faces) {
      const double z = glm::normalize(t[0] + t[1] + t[2]).z;
      scene.face(test::reversed(t), scene.material({a + b * z}, {z > cap ? e : 0.0}));
    }
    SolveOptions options;
    options.mesh = {1, 1};
    options.samples = 1, options.light_samples = 0;
    options.converge = 1e-5;
    const Solution s = solve(device, scene.load(), options);
    const double expected = c["icosphere"]["by_level"]["2"]["H_area_weighted"];
    double power = 0, area = 0, rho_most = 0;
    for (std::size_t p = 0; p < s.mesh.patches.size(); ++p) {
      power += s.patch_irradiance[p] * s.mesh.patches[p].area_m2, area += s.mesh.patches[p].area_m2;
      rho_most = std::max(rho_most, s.scene.materials[s.scene.polygons[p].material].reflectance[0]);
    }
    constexpr double unlike = 4 * 0.011;
    verdict.relative(power / area, expected, unlike, "mean irradiance");
    for (std::size_t p = 0; p < s.mesh.patches.size(); ++p)
      verdict.relative(s.patch_irradiance[p], expected, 2 * unlike, fmt::format("triangle {}", p));
  }
}

// Two plates of side L, 1 m apart, one patch each. Elements of L / 128: factors fall from 1 to 1/2 within about a metre of
// the rim, so that for large L all of the fall is in the outermost vertices. These weigh h / 2 each side: the mean is off by at
// most the fall over a strip h / 2 wide around, 4 (h / 2) / L x 1/2 = h / L, and by no more than the fall's integral, 1 m: what
// is allowed is 1/128 of the mean factor, amplified by what goes to and fro.
TEST(HardEnclosures, ParallelPlates) {
  HardCase verdict(
      "Parallel plates 1 m apart, 10 to 10,000 m wide, one patch each",
      "Element sizes of 80 times the distance: factors above 1, radiosity that grows without end");
  Device device;
  for (const auto& c : test::cases_of("c_closed_forms.json")) {
    if (c["kind"] != "parallel_plates") continue;
    ObjScene scene;
    for (std::size_t p = 0; p < 2; ++p)
      scene.face(corners_of(c["polygons"][p]),
                 scene.material({c["reflectance"][p].get<double>()}, {c["emission"][p].get<double>()}));
    const double side = test::longest_edge(corners_of(c["polygons"][0]));
    SolveOptions options;
    options.mesh = {side, side / 128};
    options.samples = 1, options.light_samples = 0;
    options.converge = 1e-6;
    options.near_field = false;  // the patch's own mean is what is asked for
    const Solution s = solve(device, scene.load(), options);
    const double f = c["F12"], r0 = c["reflectance"][0], r1 = c["reflectance"][1], loop = r0 * r1 * f * f;
    for (std::size_t p = 0; p < 2; ++p)
      verdict.relative(polygon_means(s)[p].radiosity[0], c["constant_patch_B"][p],
                       2 / 128.0 / (1 - loop) + 1e-4, c["id"]);
  }
}

TEST(HardEnclosures, TrivialCasesAreExact) {
  HardCase verdict("Nothing reflects: B is E to the bit; nothing emits: B is 0 and the solve ends",
                   "Division by the emitted power; a loop that waits for a residual of 0 of 0");
  Device device;
  for (const auto& c : test::cases_of("c_closed_forms.json")) {
    if (c["kind"] != "trivial") continue;
    // Through the API: an OBJ's Ke is E / pi.
    Scene scene;
    scene.bands = {"grey"};
    for (std::size_t p = 0; p < c["polygons"].size(); ++p) {
      scene.polygons.push_back(oracle::polygon(c["polygons"][p], std::uint32_t(p), ""));
      scene.materials.push_back({"m", {c["reflectance"][p]}, {c["emission"][p]}, {}});
    }
    for (const Solver solver : {Solver::progressive, Solver::gathering, Solver::gauss_seidel}) {
      SolveOptions options;
      options.mesh = {0.5, 0.25};
      options.solver = solver;
      const Solution s = solve(device, scene, options);
      for (std::uint32_t p = 0; p < 6; ++p)
        for (std::uint32_t k = 0; k < s.mesh.polygons[p].vertices; ++k)
          verdict.near(s.vertex_radiosity(0, s.mesh.polygons[p].first_vertex + k, p), c["B"][p], 0, c["id"]);
    }
  }
}

// A closed cube whose floor is in three pieces: the T-junction changes nothing in a furnace.
TEST(HardEnclosures, FurnaceWithATJunction) {
  HardCase verdict("White furnace with a T-junction in its floor, rho 0.5 and 0.9",
                   "Light leaves through the T, and the room loses power");
  const auto data = oracle::reference("d_hard_cases.json");
  const auto& c = oracle::reference_case(data, "D-tjunction");
  const std::vector<double> rho{0.5, 0.9, 0.1};
  SolveOptions options;
  options.mesh = {0.5, 0.125};
  options.converge = 1e-6;
  options.sensors = {{oracle::vec(c["point"]), oracle::vec(c["normal"])}};
  Device device;
  const Solution s = solve(device, furnace(c["polygons"], rho, {1}).load(), options);
  for (std::uint32_t b = 0; b < 3; ++b) {
    const double expected = 1 / (1 - rho[b]), allowed = (1e-5 + 2e-6) / (1 - rho[b]);
    for (std::uint32_t p = 0; p < s.mesh.polygons.size(); ++p)
      for (std::uint32_t k = 0; k < s.mesh.polygons[p].vertices; ++k)
        verdict.relative(s.vertex_radiosity(b, s.mesh.polygons[p].first_vertex + k, p), expected, allowed,
                         fmt::format("polygon {} rho {}", p, rho[b]));
    verdict.relative(s.sensors[0].irradiance[b], expected, allowed, "sensor");
  }
}

// Mean irradiance of every polygon as the program reports it, against an independent light tracer's with its standard
// errors (4 of them). Dim sides of a block live on what patches of floor next to them reflect, which lie half in the light: an
// error of the patches' size; elements that a block's edge crosses are weighed by their exposed share at one radiosity.
// Both are of first order or better, so the mesh twice as coarse differs by at least what this one errs; allowed polygon by
// polygon. What sampled visibility
// adds is seen by sampling anew: the root mean square over all polygons of the difference that another seed makes, / sqrt(2)
// because both differ, is its standard error, of which four are allowed. Polygons that a block stands on count their
// covered part as dark.
TEST(HardEnclosures, RoomsWithThingsInThemThroughTheCommandLine) {
  for (const auto& c : test::cases_of("c_scenes_with_occlusion.json")) {
    HardCase verdict(
        fmt::format("{}: mean irradiance of every polygon in report.json", c["id"].get<std::string>()),
        "A light shining through the block's foot; covered floor counted as lit");
    double rho = 0;
    const ObjScene scene = scene_of(c["scene"], &rho);
    const double extent = frame_of(scene.load()).metres();  // a power of two below the extent
    enum Run { coarse, fine, anew };
    std::map<std::string, std::vector<double>> got[3];
    for (const Run run : {coarse, fine, anew}) {
      SolveOptions options;
      options.mesh = {extent / (run == fine ? 16 : 8), extent / (run == fine ? 32 : 16)};
      if (run == anew) options.seed += 1;
      const auto report = test::command_line_report(scene, options);
      ASSERT_TRUE(report.contains("polygons"));
      for (const auto& p : report["polygons"])
        got[run][p["name"]] = p["irradiance_W_m2"].get<std::vector<double>>();
    }
    double squares = 0, count = 0;
    for (const auto& [name, values] : got[coarse])
      for (std::size_t b = 0; b < 3; ++b)
        if (values[b] > 0) squares += std::pow(got[anew][name].at(b) / values[b] - 1, 2), ++count;
    ASSERT_GT(count, 0);
    const double sampling = std::sqrt(squares / count / 2);
    for (const auto& mean : c["face_means_forward_tracing"]) {
      const std::string name = mean["surface"];
      ASSERT_TRUE(got[fine].count(name)) << name;
      double differs = 0;
      for (std::size_t b = 0; b < 3; ++b)
        differs = std::max(differs, std::abs(got[coarse][name].at(b) / got[fine][name].at(b) - 1));
      for (std::size_t b = 0; b < 3; ++b) {
        const double expected = mean["H_mean"][b], se = mean["H_mean_se"][b];
        verdict.relative(got[fine][name][b], expected, differs + 4 * sampling, name, 4 * se);
      }
    }
  }
}

}  // namespace
}  // namespace clrad

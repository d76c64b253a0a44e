// Adaptive subdivision in a solve: what it splits, what that costs, and that it arrives where a fine mesh does.
#include "solve/refine.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <random>

#include "clrad/clrad.hpp"
#include "device/divided.hpp"
#include "mesh/around.hpp"
#include "mesh/lattice.hpp"
#include "mesh/locate.hpp"
#include "oracle/reference.hpp"
#include "output/displayed.hpp"
#include "render/support.hpp"
#include "scene/planes.hpp"

namespace clrad {
namespace {

// Few and large patches, so that the tests are quick: 4 m / 4 shoot, 4 m / 16 receive.
SolveOptions coarse() {
  SolveOptions o;
  o.mesh = {1.0, 0.25};
  return o;
}

SolveOptions adaptive(double tolerance, std::uint32_t levels) {
  SolveOptions o = coarse();
  o.adaptive.tolerance = tolerance;
  o.adaptive.max_level = levels;
  return o;
}

struct Place {
  std::uint32_t polygon;
  double u, v;
};

// Displayed radiosity at places, bands one after the other.
std::vector<double> displayed(const Solution& s, const std::vector<Place>& places) {
  const Displayed shown(s);
  std::vector<double> values;
  for (const Place& p : places) {
    const Interpolant at = locate(s.mesh, p.polygon, s.scene.polygons[p.polygon].corners, p.u, p.v);
    for (std::uint32_t b = 0; b < s.bands; ++b) values.push_back(shown.at(b, at));
  }
  return values;
}

// Random by area, where nothing stands within an element of `reference`.
std::vector<Place> visible_places(const Solution& reference, std::size_t count) {
  std::mt19937_64 random(7);
  std::uniform_real_distribution<double> unit(0, 1);
  std::vector<double> area;
  for (const Polygon& p : reference.scene.polygons) area.push_back(p.area_m2());
  std::discrete_distribution<std::uint32_t> by_area(area.begin(), area.end());
  std::vector<Place> places;
  while (places.size() < count) {
    const Place p{by_area(random), unit(random), unit(random)};
    const Interpolant at =
        locate(reference.mesh, p.polygon, reference.scene.polygons[p.polygon].corners, p.u, p.v);
    if (std::none_of(at.vertex.begin(), at.vertex.end(),
                     [&](std::uint32_t v) { return reference.vertex_covered[v]; }))
      places.push_back(p);
  }
  return places;
}

double rms(const std::vector<double>& values, const std::vector<double>& reference) {
  double squares = 0, mean = 0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    squares += (values[i] - reference[i]) * (values[i] - reference[i]);
    mean += reference[i];
  }
  return std::sqrt(squares * double(values.size())) / mean;
}

// The finest level is 4 m / 64. With a fifth of the uniform mesh's elements the error is between that of the uniform mesh
// of the finest level and that of one level coarser, and nearer to the former than any uniform mesh of as many elements.
TEST(Refine, AFewElementsInTheRightPlacesDoTheWorkOfMany) {
  Device device;
  const Scene scene = oracle::block_room();
  SolveOptions options = coarse();
  options.mesh.element_edge_m = 4.0 / 256;
  const Solution reference = solve(device, scene, options);
  const auto places = visible_places(reference, 10000);
  const auto exact = displayed(reference, places);
  options.mesh.element_edge_m = 4.0 / 64;
  const Solution fine = solve(device, scene, options);
  options.mesh.element_edge_m = 4.0 / 32;
  const Solution coarser = solve(device, scene, options);
  const Solution split = solve(device, scene, adaptive(0.04, 2));
  const double fine_error = rms(displayed(fine, places), exact),
               coarser_error = rms(displayed(coarser, places), exact),
               split_error = rms(displayed(split, places), exact);
  EXPECT_LT(split.mesh.elements.size(), coarser.mesh.elements.size() * 5 / 4);
  EXPECT_LT(split_error, 0.6 * coarser_error);
  EXPECT_GT(split_error, 0.9 * fine_error);  // it cannot beat the mesh that it is a part of but by luck
}

// What a vertex surprises by is its difference from what the mesh of the level above displays there, by the host's own code. Values up to
// 1000, in the device's precision: a dozen operations each.
TEST(Refine, SurpriseIsTheDifferenceFromTheDisplayOfTheLevelAbove) {
  Scene scene = test::scene({test::polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}),
                             test::polygon({{0, 0, 2}, {2, 0, 2}, {0, 1.5, 2}})});
  scene.materials[0] = test::material(1, 1);  // what is displayed is irradiance and 1, over pi times the same
  const auto field = [](const glm::dvec3& x) {
    return 500 + 100 * std::sin(5 * x.x + 1) * std::cos(4 * x.y) + (x.x + 0.3 * x.y > 1.1 ? 300 : 0);
  };
  const auto subject = [&](double edge) {
    Solution s = test::solution(scene, edge, [](auto, auto, auto&) { return 0.0; });
    for (std::size_t v = 0; v < s.vertex_count(); ++v) s.vertex_irradiance[v] = field(s.mesh.position_m[v]);
    return s;
  };
  const Solution above = subject(0.26), here = subject(0.13);
  const Displayed shown(above), values(here);
  Device& device = test::device();
  const std::uint32_t vertices = here.vertex_count();
  std::vector<std::uint32_t> parents, around;
  for (const auto& of : here.mesh.parents) parents.insert(parents.end(), of.begin(), of.end());
  const std::vector<std::uint32_t> covered(vertices, 0);
  for (const auto& of : around_parents(here.mesh, std::vector<std::uint8_t>(vertices, 0)))
    around.insert(around.end(), of.begin(), of.end());
  const RealArray irradiance(device, values.radiosity, "values");
  const Array<std::uint32_t> parents_device(device, parents, "parents"),
      around_device(device, around, "around"), covered_device(device, covered, "covered");
  RealArray surprise(device, vertices, "surprise");
  device.run("solve/refine.cl", "expect", vertices, irradiance, parents_device, around_device, covered_device,
             surprise, vertices, 1u);
  const std::vector<double> found = surprise.download();
  std::uint32_t compared = 0;
  double most = 0;
  for (std::uint32_t v = 0; v < vertices; ++v) {
    const std::uint32_t p = here.mesh.receivers[v].surface;
    const PolygonMesh& of = here.mesh.polygons[p];
    const auto units_u = double(std::uint64_t(of.patches_u) << lattice_depth),
               units_v = double(std::uint64_t(of.patches_v) << lattice_depth);
    const auto& at = here.mesh.lattice[v];
    // Vertices that the mesh above has, too, are no surprise to it.
    if (at[0] % (std::uint32_t(units_u) / above.mesh.polygons[p].cells_u) == 0 &&
        at[1] % (std::uint32_t(units_v) / above.mesh.polygons[p].cells_v) == 0)
      continue;
    if (here.mesh.parents[v][0] != here.mesh.parents[v][2])
      continue;  // by the middles of edges, not of this mesh alone
    const Interpolant where =
        locate(above.mesh, p, scene.polygons[p].corners, at[0] / units_u, at[1] / units_v);
    EXPECT_NEAR(found[v], std::abs(values.radiosity[v] - shown.at(0, where)), 1000 * 12 * 1.2e-7) << v;
    most = std::max(most, found[v]);
    ++compared;
  }
  EXPECT_GT(compared, 100u);
  EXPECT_GT(most, 10);
}

// Rays of a re-shoot: for every patch that had shot, the new vertices in front of it x its samples. With refinements
// at the end only, every patch has shot before.
TEST(Refine, RaysAreShotPatchesTimesNewVerticesInFrontTimesSamples) {
  Device device;
  const Scene scene = oracle::block_room();
  SolveOptions options = adaptive(0.05, 1);
  options.adaptive.every = 1u << 30;
  options.light_samples = 0;
  options.samples = 4;
  const Solution s = solve(device, scene, options);
  ASSERT_GE(s.report.refinement.refinements, 1u);
  const std::uint32_t first = s.vertex_count() - std::uint32_t(s.report.refinement.vertices_added);
  std::uint64_t rays = 0;
  for (const Patch& patch : s.mesh.patches) {
    const glm::dvec3 n = scene.polygons[patch.polygon].normal();
    const std::uint32_t plane = s.mesh.receivers[s.mesh.polygons[patch.polygon].first_vertex].plane;
    for (std::uint32_t v = first; v < s.vertex_count(); ++v) {
      const Point& p = s.mesh.receivers[v];
      if (p.plane == plane || s.vertex_covered[v]) continue;
      bool above = false;
      for (std::uint32_t k = 0; k < patch.corners; ++k)
        above = above || glm::dot(p.normal, patch.corner[k] - p.position) > 0;
      if (above && glm::dot(n, p.position - patch.corner[0]) > 0) rays += 4;
    }
  }
  EXPECT_EQ(s.report.refinement.rays, rays);
  EXPECT_GT(rays, 0u);

  options.without = {"occlusion"};
  const Solution open = solve(device, scene, options);
  EXPECT_GT(open.report.refinement.vertices_added, 0u);
  EXPECT_EQ(open.report.refinement.rays, 0u);
  EXPECT_EQ(open.report.rays, 0u);
}

TEST(Refine, EachLimitStopsItAndIsReported) {
  Device device;
  const Scene scene = oracle::block_room();
  const Solution free_one = solve(device, scene, adaptive(0.05, 2));
  EXPECT_GT(free_one.report.refinement.stopped_by_max_level, 0u);
  EXPECT_EQ(free_one.report.refinement.stopped_by_min_area, 0u);

  SolveOptions options = adaptive(0.05, 2);
  options.adaptive.min_area_m2 = 0.02;  // one split of 0.25 x 0.25 m is below it
  const Solution by_area = solve(device, scene, options);
  EXPECT_GT(by_area.report.refinement.stopped_by_min_area, 0u);
  for (const Element& e : by_area.mesh.elements)
    if (e.level > 0) {
      EXPECT_GE(e.area_m2, 0.01);
    }

  options = adaptive(0.05, 2);
  options.adaptive.min_projected_area_px = 40;
  options.adaptive.camera = default_camera(scene);
  options.adaptive.width = options.adaptive.height = 256;
  const Solution by_pixels = solve(device, scene, options);
  EXPECT_GT(by_pixels.report.refinement.stopped_by_min_projected_area, 0u);
  EXPECT_LT(by_pixels.mesh.elements.size(), free_one.mesh.elements.size());

  // Memory for the first mesh and little more.
  DeviceOptions small;
  small.memory_bytes = 6u << 20;
  Device tight(small);
  const Solution by_memory = solve(tight, scene, adaptive(0.01, 3));
  EXPECT_GT(by_memory.report.refinement.stopped_by_memory, 0u);
  EXPECT_LT(by_memory.unshot_relative, 1e-3);
}

// Refining early or late puts vertices in other places. Both are within the tolerance of the same solution, which bounds
// the mean difference between them by twice that.
TEST(Refine, HowOftenItIsDoneMattersLittle) {
  Device device;
  const Scene scene = oracle::block_room();
  SolveOptions options = adaptive(0.05, 2);
  options.adaptive.every = 1;
  const Solution often = solve(device, scene, options);
  options.adaptive.every = 8;
  const Solution seldom = solve(device, scene, options);
  const auto places = visible_places(seldom, 4000);
  EXPECT_LT(rms(displayed(often, places), displayed(seldom, places)), 0.1);
  EXPECT_GT(often.report.refinement.refinements, seldom.report.refinement.refinements);
}

TEST(Refine, SameBitsOnOneCoreAndInSmallBatches) {
  const Scene scene = oracle::block_room();
  SolveOptions options = adaptive(0.05, 2);
  Device device;
  const Solution plain = solve(device, scene, options);
  DeviceOptions one;
  one.cores = test::one_core(), one.work_group_size = 16;
  Device single(one);
  options.engine = "chop";
  options.rays_per_batch = 5000;
  const Solution other = solve(single, scene, options);
  EXPECT_EQ(plain.vertex_irradiance, other.vertex_irradiance);
  EXPECT_EQ(plain.patch_irradiance, other.patch_irradiance);
}

// A flap of 0.2 m hangs 0.05 m above the middle of the floor's only element, which is 1 m large: its corners see the light
// and its middle does not. Interpolated, the new vertex there is lit.
TEST(Refine, InterpolatedVerticesMissAShadowBetweenThem) {
  Scene scene;
  scene.file = "by hand";
  scene.bands = {"grey"};
  scene.materials = {{"floor", {0.5}, {0.0}, {}}, {"light", {0.0}, {1.0}, {}}, {"flap", {0.0}, {0.0}, {}}};
  const auto add = [&](std::vector<glm::dvec3> corner, std::uint32_t material) {
    Polygon p;
    p.corners = std::uint32_t(corner.size());
    std::copy(corner.begin(), corner.end(), p.corner.begin());
    p.material = material;
    scene.polygons.push_back(p);
  };
  add({{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}}, 0);
  add({{0.45, 0.2, 1}, {0.45, 0.3, 1}, {0.55, 0.3, 1}, {0.55, 0.2, 1}}, 1);  // off the middle: corners differ
  add({{0.3, 0.3, 0.05}, {0.7, 0.3, 0.05}, {0.7, 0.7, 0.05}, {0.3, 0.7, 0.05}}, 2);
  SolveOptions options;
  options.mesh = {1.0, 1.0};
  options.adaptive.tolerance = 0.01;
  options.adaptive.max_level = 1;
  Device device;
  const auto middle_of = [&](const Solution& s) {
    for (std::uint32_t v = 0; v < s.vertex_count(); ++v)
      if (s.mesh.receivers[v].surface == 0 &&
          glm::distance(s.mesh.position_m[v], glm::dvec3(0.5, 0.5, 0)) < 1e-9)
        return s.vertex_irradiance[v];
    return -1.0;
  };
  const Solution shot = solve(device, scene, options);
  options.adaptive.interpolate_new = true;
  const Solution interpolated = solve(device, scene, options);
  double corners = 0;
  for (int k = 0; k < 4; ++k) corners += shot.vertex_irradiance[std::size_t(k)] / 4;
  EXPECT_EQ(middle_of(shot), 0);
  EXPECT_NEAR(middle_of(interpolated), corners, 1e-6 * corners);
  EXPECT_GT(corners, 0);
}

TEST(Refine, AmbientIsTheUnshotLightSpreadEvenly) {
  Device device;
  Scene scene = oracle::block_room();
  SolveOptions options = coarse();
  options.progress = [](const Progress& p) { return p.shoots < 3; };
  const Solution early = solve(device, scene, options);
  ASSERT_TRUE(early.stopped);
  options.progress = nullptr;
  const Solution late = solve(device, scene, options);
  for (std::uint32_t b = 0; b < early.bands; ++b) {
    double area = 0, early_mean = 0, late_mean = 0;
    const auto means_early = polygon_means(early), means_late = polygon_means(late);
    for (std::size_t p = 0; p < means_late.size(); ++p) {
      area += means_late[p].area_m2;
      early_mean += means_early[p].area_m2 * means_early[p].irradiance[b];
      late_mean += means_late[p].area_m2 * means_late[p].irradiance[b];
    }
    // An estimate: it brings the mean irradiance to within a quarter of what is missing.
    const double missing = (late_mean - early_mean) / area;
    EXPECT_GT(missing, 0);
    EXPECT_NEAR(early.ambient[b], missing, 0.25 * missing);
  }
  // Display only, and only when asked for.
  const auto without = display_radiosity(early), with = display_radiosity(early, true);
  EXPECT_EQ(without[0], early.vertex_radiosity(0, 0, 0));
  EXPECT_NEAR(with[0] - without[0],
              scene.materials[scene.polygons[0].material].reflectance[0] * early.ambient[0], 1e-12);
}

}  // namespace
}  // namespace clrad

#include <cstring>
#include <random>

#include "clrad/clrad.hpp"
#include "output/adaptive.hpp"
#include "output/archive.hpp"
#include "output/damage.hpp"
#include "output/outline.hpp"
#include "output/support.hpp"

namespace clrad {
namespace {

// Every field holds something that is not its default.
Solution full_solution() {
  Solution s = test::adaptive_solution(3);
  s.scene.file = "scenes/W\xe4nde.obj";  // not UTF-8
  s.scene.quantity = Quantity::photometric;
  std::uint32_t line = 10;
  for (Polygon& p : s.scene.polygons) p.name = "wall", p.where = {"a.obj", ++line, "node \"x\""};
  for (Material& m : s.scene.materials) m.where = {"a.mtl", ++line, "Kd"}, m.reflectance[1] /= 3;
  s.scene.cameras = {{"view", {1, 2, 3}, {0.1, 0.2, 0.3}, {0, 0, 1}, 0.9},
                     {"other", {5, 5, 5}, {1, 1, 1}, {0, 1, 0}, 1}};
  s.scene.diagnostics = {{Diagnostic::Severity::repair, "non-planar", {"a.obj", 3, "item"}, "was split"}};
  s.scene.lights = {{"spot",
                     PunctualLight::Kind::spot,
                     {1, 2, 3},
                     {0, 1, 0},
                     {1, 2, 3},
                     0.1,
                     0.2,
                     {"a.gltf", 0, "node 3"}}};
  s.scene.textures = {{"a.png", 2, 1, {Wrap::clamp, Wrap::mirror}, {0, 0.25f, 0.5f, 0.75f, 0.9f, 0.1f}}};
  s.scene.materials[0].texture = 0;
  s.scene.materials[0].two_sided = true;
  s.scene.polygons[0].uv = {glm::dvec2(0.1, 0.2), glm::dvec2(-3, 4), glm::dvec2(5, 6), glm::dvec2(7, 1e-300)};
  s.scene.polygons.back().back = s.scene.polygons.size() > 1;
  const auto shares = [&](std::size_t count) {
    std::vector<double> values(s.bands * count);
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = double(i % 97) / 97;
    return values;
  };
  s.textured = {shares(s.mesh.elements.size()), shares(s.mesh.patches.size()), shares(s.vertex_count())};
  s.mesh.patch_edge_m = 0.6, s.mesh.element_edge_m = 0.3;
  s.mesh.receivers[5].plane = 77;
  s.vertex_covered[3] = s.vertex_covered[4] = 1;
  s.ambient = {0.1, 0.2, 0.3};
  s.sensors = {{{0.1, 0.2, 0.3}, {0, 0, -1}, {1, 2, 3}, {0.1, std::nan(""), INFINITY}}};
  s.stopped = true;
  s.unshot_relative = 0.037;
  Report& r = s.report;
  r.effects = {{"occlusion", false, false, "convex", 0.0, {}}, {"bands", true, true, "three", -1, {"shoot"}}};
  r.stages = {{"emit", 17, 0.25, 1ull << 40}, {"deliver", 3, 1e-3}};
  r.shoots = 11, r.reshoots = 12, r.rays = ~std::uint64_t(0), r.pieces = 14, r.candidates = 15,
  r.exact_tests = 16;
  r.seconds = {0.1, 0.2, 0.3, 0.4, 1.0};
  r.energy = {true, {1, 2, 3}, {0.5, 0.6, 0.7}, {0.1, 0.1, -0.0}, {0, 1e-300, 5e-324}, 0.01};
  r.error = {0.02,
             0.03,
             {{"convergence", 0.01, true}, {"visibility", 0.017, false}},
             {{"sensor rays", 0.03, false}}};
  r.predicted = {2.5, 1e9};
  r.target = {0.05, 20, true, false, {{0.5, 0.25, 4, 256, 1024, 0.07, 1.5}}};
  r.refinement = {1, 2, 3, 4, 5, 6, 7, 8, 9};
  r.invariants = {{"row sums", 1.01, 1.0, false}};
  r.warnings = {"one", "two"};
  r.device_peak_bytes = 123, r.host_peak_bytes = 456;
  r.device = {1, "cpu", "platform", "1.8", "OpenCL 1.2", true, true, 4, 1u << 30, 1u << 29};
  r.options = {{"samples", "4"}, {"engine", "chop"}, {"samples", "again"}};
  return s;
}

template <class T>
void expect_same_bits(const std::vector<T>& a, const std::vector<T>& b, const char* what) {
  static_assert(std::is_trivially_copyable_v<T>);
  ASSERT_EQ(a.size(), b.size()) << what;
  if (!a.empty()) {
    EXPECT_EQ(std::memcmp(a.data(), b.data(), a.size() * sizeof(T)), 0) << what;
  }
}

bool same(const SourceLocation& a, const SourceLocation& b) {
  return a.file == b.file && a.line == b.line && a.item == b.item;
}

void expect_same_scene(const Scene& a, const Scene& b) {
  EXPECT_EQ(a.file, b.file);
  EXPECT_EQ(a.quantity, b.quantity);
  EXPECT_EQ(a.bands, b.bands);
  ASSERT_EQ(a.materials.size(), b.materials.size());
  for (std::size_t m = 0; m < a.materials.size(); ++m) {
    EXPECT_EQ(a.materials[m].name, b.materials[m].name);
    expect_same_bits(a.materials[m].reflectance, b.materials[m].reflectance, "reflectance");
    expect_same_bits(a.materials[m].emitted_exitance, b.materials[m].emitted_exitance, "exitance");
    EXPECT_TRUE(same(a.materials[m].where, b.materials[m].where));
    EXPECT_EQ(a.materials[m].two_sided, b.materials[m].two_sided);
    EXPECT_EQ(a.materials[m].texture, b.materials[m].texture);
  }
  ASSERT_EQ(a.lights.size(), b.lights.size());
  for (std::size_t l = 0; l < a.lights.size(); ++l) {
    EXPECT_EQ(a.lights[l].name, b.lights[l].name);
    EXPECT_EQ(a.lights[l].kind, b.lights[l].kind);
    EXPECT_EQ(a.lights[l].position_m, b.lights[l].position_m);
    EXPECT_EQ(a.lights[l].direction, b.lights[l].direction);
    expect_same_bits(a.lights[l].intensity, b.lights[l].intensity, "intensity");
    EXPECT_EQ(a.lights[l].inner_cone_rad, b.lights[l].inner_cone_rad);
    EXPECT_EQ(a.lights[l].outer_cone_rad, b.lights[l].outer_cone_rad);
    EXPECT_TRUE(same(a.lights[l].where, b.lights[l].where));
  }
  ASSERT_EQ(a.polygons.size(), b.polygons.size());
  for (std::size_t p = 0; p < a.polygons.size(); ++p) {
    EXPECT_EQ(a.polygons[p].corner, b.polygons[p].corner);
    EXPECT_EQ(a.polygons[p].corners, b.polygons[p].corners);
    EXPECT_EQ(a.polygons[p].material, b.polygons[p].material);
    EXPECT_EQ(a.polygons[p].name, b.polygons[p].name);
    EXPECT_TRUE(same(a.polygons[p].where, b.polygons[p].where));
    EXPECT_EQ(a.polygons[p].back, b.polygons[p].back);
    EXPECT_EQ(a.polygons[p].uv, b.polygons[p].uv);
  }
  ASSERT_EQ(a.textures.size(), b.textures.size());
  for (std::size_t t = 0; t < a.textures.size(); ++t) {
    EXPECT_EQ(a.textures[t].name, b.textures[t].name);
    EXPECT_EQ(std::tie(a.textures[t].width, a.textures[t].height, a.textures[t].wrap),
              std::tie(b.textures[t].width, b.textures[t].height, b.textures[t].wrap));
    expect_same_bits(a.textures[t].texels, b.textures[t].texels, "texels");
  }
  ASSERT_EQ(a.cameras.size(), b.cameras.size());
  for (std::size_t c = 0; c < a.cameras.size(); ++c) {
    EXPECT_EQ(a.cameras[c].name, b.cameras[c].name);
    EXPECT_EQ(a.cameras[c].eye, b.cameras[c].eye);
    EXPECT_EQ(a.cameras[c].target, b.cameras[c].target);
    EXPECT_EQ(a.cameras[c].up, b.cameras[c].up);
    EXPECT_EQ(a.cameras[c].vertical_field_of_view_rad, b.cameras[c].vertical_field_of_view_rad);
  }
  ASSERT_EQ(a.diagnostics.size(), b.diagnostics.size());
  for (std::size_t d = 0; d < a.diagnostics.size(); ++d) {
    EXPECT_EQ(a.diagnostics[d].severity, b.diagnostics[d].severity);
    EXPECT_EQ(a.diagnostics[d].rule, b.diagnostics[d].rule);
    EXPECT_TRUE(same(a.diagnostics[d].where, b.diagnostics[d].where));
    EXPECT_EQ(a.diagnostics[d].message, b.diagnostics[d].message);
  }
}

void expect_same_mesh(const Mesh& a, const Mesh& b) {
  expect_same_bits(a.polygons, b.polygons, "polygon meshes");  // 32-bit numbers throughout
  ASSERT_EQ(a.patches.size(), b.patches.size());
  for (std::size_t i = 0; i < a.patches.size(); ++i) {
    const Patch &p = a.patches[i], &q = b.patches[i];
    EXPECT_EQ(p.corner, q.corner);
    EXPECT_EQ(std::tie(p.polygon, p.corners, p.area_m2, p.first_element, p.elements),
              std::tie(q.polygon, q.corners, q.area_m2, q.first_element, q.elements));
  }
  ASSERT_EQ(a.elements.size(), b.elements.size());
  for (std::size_t i = 0; i < a.elements.size(); ++i) {
    const Element &e = a.elements[i], &f = b.elements[i];
    EXPECT_EQ(std::tie(e.vertex, e.middle, e.patch, e.level, e.code, e.area_m2, e.weight),
              std::tie(f.vertex, f.middle, f.patch, f.level, f.code, f.area_m2, f.weight));
  }
  expect_same_bits(a.receivers, b.receivers, "receivers");  // six doubles, two 32-bit numbers
  expect_same_bits(a.position_m, b.position_m, "positions");
  expect_same_bits(a.lattice, b.lattice, "lattice");
  expect_same_bits(a.parents, b.parents, "parents");
  EXPECT_EQ(a.patch_edge_m, b.patch_edge_m);
  EXPECT_EQ(a.element_edge_m, b.element_edge_m);
}

class SolutionFile : public test::FileTest {};

TEST_F(SolutionFile, RoundTripKeepsEveryBit) {
  const Solution s = full_solution();
  write_solution(in_folder("a.clrad"), s);
  EXPECT_EQ(files(), 1u);
  const Solution t = load_solution(in_folder("a.clrad"));
  expect_same_scene(s.scene, t.scene);
  EXPECT_EQ(s.frame.centre, t.frame.centre);
  EXPECT_EQ(s.frame.exponent, t.frame.exponent);
  expect_same_mesh(s.mesh, t.mesh);
  EXPECT_EQ(s.bands, t.bands);
  expect_same_bits(s.vertex_irradiance, t.vertex_irradiance, "irradiance");
  expect_same_bits(s.vertex_covered, t.vertex_covered, "covered");
  expect_same_bits(s.patch_irradiance, t.patch_irradiance, "patches");
  expect_same_bits(s.ambient, t.ambient, "ambient");
  expect_same_bits(s.textured.element, t.textured.element, "element reflectances");
  expect_same_bits(s.textured.patch, t.textured.patch, "patch reflectances");
  expect_same_bits(s.textured.vertex, t.textured.vertex, "vertex reflectances");
  ASSERT_EQ(t.sensors.size(), 1u);
  EXPECT_EQ(t.sensors[0].position_m, s.sensors[0].position_m);
  EXPECT_EQ(t.sensors[0].normal, s.sensors[0].normal);
  EXPECT_EQ(t.sensors[0].irradiance, s.sensors[0].irradiance);
  EXPECT_TRUE(std::isnan(t.sensors[0].irradiance_error[1]));
  EXPECT_EQ(t.sensors[0].irradiance_error[2], INFINITY);
  EXPECT_EQ(s.stopped, t.stopped);
  EXPECT_EQ(s.unshot_relative, t.unshot_relative);
  EXPECT_EQ(report_json(s), report_json(t));
  const auto refinement = [](const Solution& of) {
    const auto [a, b, c, d, e, f, g, h, i] = of.report.refinement;
    return std::vector<std::uint64_t>{a, b, c, d, e, f, g, h, i};
  };
  EXPECT_EQ(refinement(t), (std::vector<std::uint64_t>{1, 2, 3, 4, 5, 6, 7, 8, 9}));
}

// What comes back says the same when it is written again: nothing of a file is lost, and nothing in it is left to chance.
TEST_F(SolutionFile, WrittenAgainItIsTheSameFile) {
  write_solution(in_folder("a.clrad"), full_solution());
  write_solution(in_folder("b.clrad"), load_solution(in_folder("a.clrad")));
  EXPECT_EQ(bytes(in_folder("a.clrad")), bytes(in_folder("b.clrad")));
}

TEST_F(SolutionFile, ASolvedSceneGivesTheSamePictureReportAndFiles) {
  Device& device = test::device();
  Scene scene = load_scene(CLRAD_SCENES "/block_room.obj");
  SolveOptions options;
  options.mesh = {.patch_edge_m = 1, .element_edge_m = 0.5};
  options.converge = 0.05;
  options.sensors = {{{1, 1, 0.5}, {0, 0, 1}}};
  const Solution s = solve(device, scene, options);
  write_solution(in_folder("a.clrad"), s);
  const Solution t = load_solution(in_folder("a.clrad"));
  EXPECT_EQ(report_json(s), report_json(t));
  const Camera camera = default_camera(s.scene);
  const ImageOptions small{.width = 64, .height = 48, .samples_per_pixel = 4};
  const Image one = render(device, s, camera, small), other = render(device, t, camera, small);
  expect_same_bits(one.radiance, other.radiance, "picture");
  EXPECT_GT(*std::max_element(one.radiance.begin(), one.radiance.end()), 0);
  write_gltf(in_folder("s.glb"), s);
  write_gltf(in_folder("t.glb"), t);
  EXPECT_EQ(bytes(in_folder("s.glb")), bytes(in_folder("t.glb")));
  write_vtu(in_folder("s.vtu"), s);
  write_vtu(in_folder("t.vtu"), t);
  EXPECT_EQ(bytes(in_folder("s.vtu")), bytes(in_folder("t.vtu")));
}

// Every kind of use that a loaded solution has without a device.
void use(const Solution& s) {
  display_radiosity(s, true);
  polygon_means(s);
  report_json(s);
  for (const Element& e : s.mesh.elements)
    for (std::uint32_t k = 0; k < outline(e).vertices; ++k) ASSERT_LT(outline(e).vertex[k], s.vertex_count());
}

bool refused(const std::string& path) {
  try {
    use(load_solution(path));
  } catch (const InputError&) {
    return true;
  }
  return false;
}

// Flips of one bit and cuts are noticed for certain; a run of random bytes slips through once in 2^64 files.
TEST_F(SolutionFile, DamagedFilesAreRefused) {
  const std::string path = in_folder("a.clrad"), damaged = in_folder("b.clrad");
  write_solution(path, full_solution());
  const std::string whole = bytes(path);
  std::mt19937_64 random(1);
  for (int i = 0; i < 300; ++i) {
    const std::size_t at = random() % whole.size();
    std::string other = whole;
    other[at] = char(other[at] ^ 1 << random() % 8);
    test::overwrite(damaged, other);
    EXPECT_TRUE(refused(damaged)) << "byte " << at;
    test::overwrite(damaged, whole.substr(0, at));
    EXPECT_TRUE(refused(damaged)) << "cut to " << at;
    other = whole;
    for (std::size_t k = at; k < std::min(at + 100, other.size()); ++k) other[k] = char(random());
    test::overwrite(damaged, other);
    EXPECT_TRUE(refused(damaged)) << "noise from " << at;
  }
}

// Checksums that hold over numbers that do not: what is accepted can be used, above all no index leads outside.
TEST_F(SolutionFile, ForgedFilesDoNoHarm) {
  const std::string path = in_folder("a.clrad"), forged = in_folder("b.clrad");
  write_solution(path, full_solution());
  const std::string whole = bytes(path);
  std::mt19937_64 random(2);
  int refusals = 0;
  constexpr int tries = 1000;
  for (int i = 0; i < tries; ++i) {
    std::string other = whole;
    other[test::header_bytes + random() % (whole.size() - test::header_bytes)] = char(random());
    test::overwrite(forged, test::with_right_checksums(other));
    refusals += refused(forged);
  }
  EXPECT_GT(refusals, 0);
  EXPECT_LT(refusals, tries);
}

TEST_F(SolutionFile, ForgedIndicesAreRefused) {
  const auto refused_after = [&](auto&& forge) {
    Solution s = full_solution();
    forge(s);
    write_solution(in_folder("a.clrad"), s);
    return refused(in_folder("a.clrad"));
  };
  EXPECT_FALSE(refused_after([](Solution&) {}));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.elements[7].vertex[2] = s.vertex_count(); }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.elements[7].middle[1] = s.vertex_count(); }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.elements[7].patch = 1000000; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.elements[7].level = 16; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.patches[1].polygon = 3; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.patches[1].elements = 0xffffffffu; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.polygons[1].cells_u = 1u << 30; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.polygons[1].patches_v += 1; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.polygons[2].first_patch = 0xffffffffu; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.receivers[9].surface = 3; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.mesh.position_m.pop_back(); }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.scene.polygons[0].material = 3; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.scene.polygons[0].corners = 5; }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.scene.materials[1].reflectance.pop_back(); }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.vertex_irradiance.pop_back(); }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.vertex_covered.push_back(0); }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.patch_irradiance.clear(); }));
  EXPECT_TRUE(refused_after([](Solution& s) { s.bands = 4; }));
}

TEST_F(SolutionFile, RefusesOtherEndingsAndOtherKinds) {
  EXPECT_THROW(write_solution(in_folder("a.bin"), full_solution()), UsageError);
  EXPECT_EQ(files(), 0u);
  ArchiveWriter(in_folder("b.clrad"), "checkpoint").finish();
  try {
    load_solution(in_folder("b.clrad"));
    ADD_FAILURE() << "a checkpoint was accepted";
  } catch (const InputError& e) {
    EXPECT_NE(
        std::string(e.what()).find("is a checkpoint of a running solve, and a finished solution is needed"),
        std::string::npos)
        << e.what();
  }
}

}  // namespace
}  // namespace clrad

#include "solve/krylov.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>

#include "clrad/clrad.hpp"
#include "clrad/frame.hpp"
#include "mesh/build.hpp"
#include "oracle/reference.hpp"
#include "scene/planes.hpp"
#include "solve/balance.hpp"
#include "solve/shoot.hpp"

namespace clrad {
namespace {

// A room whose columns are all traced, and the matrix that the kernels should be applying, from them.
struct Traced {
  explicit Traced(Precision precision, const std::vector<double>& rho, bool closed)
      : device({.precision = precision}),
        scene(oracle::box_scene({2, 1.5, 1}, rho, std::vector<double>(rho.size(), 1.0))) {
    scene.materials.push_back(
        {"other", std::vector<double>(rho.size(), 0.2), std::vector<double>(rho.size(), 3.0), {}});
    scene.polygons[1].material = 1;
    frame = frame_of(scene);
    const auto planes = plane_ids(scene);
    options.mesh = {0.5, 0.25};
    options.samples = 1, options.light_samples = 0;
    mesh = build_mesh(scene, frame, planes, options.mesh);
    covered.assign(mesh.vertex_count(), 0);
    engine = make_engine("serial", device, occluder_triangles(scene, frame, planes));
    state = std::make_unique<SolveState>(device, scene, mesh, std::uint32_t(rho.size()), *engine, options,
                                         covered, frame.metres());
    for (std::uint32_t p = 0; p < state->patches; ++p) trace(*state, p);
    state->balanced = closed;
    set_up_rows(*state);
  }
  Eigen::MatrixXd matrix(std::uint32_t band) const {
    const Eigen::Index n = state->patches;
    Eigen::MatrixXd a = Eigen::MatrixXd::Identity(n, n);
    for (Eigen::Index j = 0; j < n; ++j) {
      const auto column = state->patch_columns.download(std::uint64_t(j) * state->patches, state->patches);
      for (Eigen::Index i = 0; i < n; ++i) {
        const Material& m = scene.materials[scene.polygons[mesh.patches[std::size_t(i)].polygon].material];
        a(i, j) -= m.reflectance[band] * column[std::size_t(i)] /
                   (state->balanced ? state->row_sum[std::size_t(i)] : 1);
      }
    }
    return a;
  }

  Device device;
  Scene scene;
  Frame frame;
  Mesh mesh;
  SolveOptions options;
  std::vector<std::uint8_t> covered;
  std::unique_ptr<VisibilityEngine> engine;
  std::unique_ptr<SolveState> state;
};

// Against a direct solve in double, rows as they are and closed, several bands at once. The residual asked for is relative
// 1e-5 (1e-11): the solution is off by at most that times the condition number, 1 / (1 - 0.9).
void compare(Precision precision, bool closed, double relative) {
  const std::vector<double> rho{0.5, 0.9, 0.0};
  Traced t(precision, rho, closed);
  const std::size_t n = t.state->patches;
  std::vector<double> right(rho.size() * n);
  for (std::size_t i = 0; i < right.size(); ++i) right[i] = std::sin(double(i)) + 0.3;
  std::fill(right.begin() + std::ptrdiff_t(2 * n), right.end(), 0.0);  // a band without light
  RealArray rhs(t.device, right, "right"), solution(t.device, right.size(), "solution");
  const double left = solve_by_gmres(*t.state, rhs, solution, 1, 0, relative, 40);
  EXPECT_LE(left, relative);
  const auto found = solution.download();
  for (std::uint32_t b = 0; b < 2; ++b) {
    Eigen::VectorXd r(n);
    for (std::size_t i = 0; i < n; ++i) r(Eigen::Index(i)) = right[b * n + i];
    const Eigen::VectorXd x = t.matrix(b).partialPivLu().solve(r);
    for (std::size_t i = 0; i < n; ++i)
      EXPECT_NEAR(found[b * n + i], x(Eigen::Index(i)), 50 * relative * x.cwiseAbs().maxCoeff())
          << b << " " << i;
  }
  for (std::size_t i = 0; i < n; ++i) EXPECT_EQ(found[2 * n + i], 0);
}

TEST(Krylov, SolvesLikeADirectMethodInFloat) {
  compare(Precision::float32, false, 1e-5);
  compare(Precision::float32, true, 1e-5);
}
TEST(Krylov, SolvesLikeADirectMethodInDouble) {
  compare(Precision::float64, false, 1e-11);
  compare(Precision::float64, true, 1e-11);
}

// Sizes of light from a firefly in a dust grain to beyond a star: squares would leave the range of float.
TEST(Krylov, ScaleDoesNotMatter) {
  Traced t(Precision::float32, {0.8}, true);
  std::vector<double> right(t.state->patches, 1.0);
  right[3] = 2;
  std::vector<std::vector<double>> found;
  for (const double scale : {std::ldexp(1.0, -90), 1.0, std::ldexp(1.0, 90)}) {
    std::vector<double> scaled = right;
    for (double& x : scaled) x *= scale;
    RealArray rhs(t.device, scaled, "right"), solution(t.device, scaled.size(), "solution");
    solve_by_gmres(*t.state, rhs, solution, scale, 0, 1e-5, 40);
    found.push_back(solution.download());
    for (double& x : found.back()) x /= scale;
  }
  EXPECT_EQ(found[0], found[1]);
  EXPECT_EQ(found[2], found[1]);
}

// After each step the caller hears what is left, which falls; where it says stop, the solution is as good as it was told.
TEST(Krylov, TellsWhatIsLeftAndStops) {
  Traced t(Precision::float64, {0.9}, true);
  const Eigen::Index n = t.state->patches;
  const Eigen::VectorXd right = Eigen::VectorXd::LinSpaced(n, 1, 3);
  RealArray rhs(t.device, std::vector<double>(right.begin(), right.end()), "right"),
      solution(t.device, std::uint64_t(n), "solution");
  std::vector<double> told;
  const double left = solve_by_gmres(*t.state, rhs, solution, 1, 0, 1e-9, 40, [&](double share) {
    told.push_back(share);
    return told.size() < 3;
  });
  ASSERT_EQ(told.size(), 3u);
  EXPECT_TRUE(told[0] < 1 && told[1] < told[0] && told[2] < told[1]);
  EXPECT_EQ(left, told[2]);
  EXPECT_GT(left, 1e-9);
  // In the solver's norm, in which areas are weights.
  const auto found = solution.download();
  const Eigen::VectorXd residual = right - t.matrix(0) * Eigen::Map<const Eigen::VectorXd>(found.data(), n);
  double of_residual = 0, of_right = 0;
  for (Eigen::Index p = 0; p < n; ++p) {
    const double area = t.mesh.patches[std::size_t(p)].area_m2;
    of_residual += area * residual(p) * residual(p), of_right += area * right(p) * right(p);
  }
  EXPECT_NEAR(std::sqrt(of_residual / of_right), left, 1e-9);
}

// rho -> 1 takes no more steps: the one slow direction, all patches alike, is found at once.
TEST(Krylov, StepsDoNotGrowWithReflectance) {
  Traced t(Precision::float64, {0.9, 0.999999}, true);
  RealArray rhs(t.device, std::vector<double>(2 * t.state->patches, 1.0), "right"),
      solution(t.device, 2 * t.state->patches, "solution");
  EXPECT_LT(solve_by_gmres(*t.state, rhs, solution, 1, 0, 1e-9, 16), 1e-9);
}

}  // namespace
}  // namespace clrad

// A solve that goes on from a checkpoint ends with the bits of one that was never stopped.
#include "solve/checkpoint.hpp"

#include <gtest/gtest.h>

#include <unistd.h>

#include <filesystem>

#include "clrad/clrad.hpp"
#include "oracle/reference.hpp"

namespace clrad {
namespace {

std::string temporary(const std::string& name) {
  return (std::filesystem::temp_directory_path() / ("clrad_" + std::to_string(::getpid()) + "_" + name))
      .string();
}

class CheckpointOf : public ::testing::Test {
 protected:
  void TearDown() override { std::filesystem::remove(file_); }

  // Stops after `shoots` calls of the progress function, goes on from what was kept, and compares.
  void stop_and_go_on(const SolveOptions& options, int calls) {
    const Solution whole = solve(device_, scene_, options);
    SolveOptions first = options;
    first.checkpoint = file_;
    first.checkpoint_every_s = 0;
    int left = calls;
    first.progress = [&](const Progress&) { return left-- > 0; };
    const Solution part = solve(device_, scene_, first);
    ASSERT_TRUE(part.stopped);
    SolveOptions rest = options;
    rest.resume = file_;
    const Solution resumed = solve(device_, scene_, rest);
    EXPECT_FALSE(resumed.stopped);
    EXPECT_EQ(resumed.vertex_irradiance, whole.vertex_irradiance);
    EXPECT_EQ(resumed.patch_irradiance, whole.patch_irradiance);
    EXPECT_EQ(resumed.vertex_covered, whole.vertex_covered);
    EXPECT_EQ(resumed.unshot_relative, whole.unshot_relative);
    EXPECT_EQ(resumed.mesh.elements.size(), whole.mesh.elements.size());
    EXPECT_EQ(resumed.report.shoots, whole.report.shoots);
    EXPECT_EQ(resumed.report.refinement.vertices_added, whole.report.refinement.vertices_added);
  }

  SolveOptions options() const {
    SolveOptions o;
    o.mesh = {1.0, 0.25};
    return o;
  }

  Device device_;
  Scene scene_ = oracle::block_room();
  std::string file_ = temporary("checkpoint");
};

TEST_F(CheckpointOf, AFixedMesh) {
  for (const int calls : {0, 1, 20, 70}) stop_and_go_on(options(), calls);
}

TEST_F(CheckpointOf, AnAdaptiveMesh) {
  SolveOptions o = options();
  o.adaptive.tolerance = 0.05;
  o.adaptive.max_level = 2;
  o.adaptive.every = 8;
  for (const int calls : {5, 12, 60, 85}) stop_and_go_on(o, calls);
}

TEST_F(CheckpointOf, TheOtherSolvers) {
  SolveOptions o = options();
  o.shooters = 5;
  stop_and_go_on(o, 7);
  o.shooters = 1;
  o.solver = Solver::gauss_seidel;
  for (const int calls : {30, 75}) stop_and_go_on(o, calls);
}

// Inside a cycle of the linear solver: it tells how far it is, and when stopped it leaves things as they were before the cycle.
TEST_F(CheckpointOf, TheLinearSystem) {
  for (Material& m : scene_.materials) m.reflectance.assign(m.reflectance.size(), 0.99);
  SolveOptions o = options();
  o.closure = Closure::on;
  std::vector<Progress> told;
  SolveOptions watched = o;
  watched.progress = [&](const Progress& p) {
    told.push_back(p);
    return true;
  };
  solve(device_, scene_, watched);
  std::vector<int> inside;  // calls made between two steps
  for (std::size_t k = 1; k < told.size(); ++k)
    if (told[k].shoots == told[k - 1].shoots && told[k].unshot_relative < told[k - 1].unshot_relative)
      inside.push_back(int(k));
  ASSERT_GE(inside.size(), 4u);
  for (const int calls : {inside[0], inside[1], inside[inside.size() / 2], inside.back()})
    stop_and_go_on(o, calls);
}

// Columns past the memory are traced again, in a resumed run the same ones.
TEST_F(CheckpointOf, ColumnsThatWereNotKept) {
  DeviceOptions small;
  small.memory_bytes = 3u << 20;
  Device tight(small);
  SolveOptions o = options();
  const Solution whole = solve(tight, scene_, o);
  o.checkpoint = file_;
  int left = 40;
  o.progress = [&](const Progress&) { return left-- > 0; };
  solve(tight, scene_, o);
  o.checkpoint.clear(), o.progress = nullptr, o.resume = file_;
  EXPECT_EQ(solve(tight, scene_, o).vertex_irradiance, whole.vertex_irradiance);
}

TEST_F(CheckpointOf, SomethingElseIsRefusedWithTheReason) {
  SolveOptions o = options();
  o.checkpoint = file_;
  int left = 3;
  o.progress = [&](const Progress&) { return left-- > 0; };
  solve(device_, scene_, o);
  o.checkpoint.clear(), o.progress = nullptr, o.resume = file_;
  const auto reason = [&](Device& device, const Scene& scene, const SolveOptions& with) -> std::string {
    try {
      solve(device, scene, with);
    } catch (const InputError& e) {
      return e.what();
    }
    return "accepted";
  };
  Scene other = scene_;
  other.materials[0].reflectance[0] += 0.01;
  EXPECT_NE(reason(device_, other, o).find("another scene"), std::string::npos);
  SolveOptions more = o;
  more.samples = 16;
  EXPECT_NE(reason(device_, scene_, more).find("--samples"), std::string::npos);
  DeviceOptions doubles;
  doubles.precision = Precision::float64;
  Device twice(doubles);
  EXPECT_NE(reason(twice, scene_, o).find("precision"), std::string::npos);
  const std::string solution = temporary("solution.clrad");
  write_solution(solution, solve(device_, scene_, options()));
  o.resume = solution;
  EXPECT_NE(reason(device_, scene_, o).find(solution), std::string::npos);
  std::filesystem::remove(solution);
  // Convergence is the one thing that may be asked for anew.
  o.resume.clear(), o.checkpoint = file_;
  const Solution coarse = solve(device_, scene_, o);
  o.checkpoint.clear(), o.resume = file_, o.converge = 1e-5;
  const Solution finer = solve(device_, scene_, o);
  EXPECT_LT(finer.unshot_relative, 1e-5);
  EXPECT_EQ(finer.report.shoots, coarse.report.shoots);
}

}  // namespace
}  // namespace clrad

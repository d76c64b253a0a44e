// `clrad viewfactors` as a user meets it.
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "cli/program.hpp"

namespace {

class CliViewFactors : public clrad::test::Program {};

using clrad::test::furnace;

const std::string room = CLRAD_SCENES "/block_room.obj";

TEST_F(CliViewFactors, WritesMatrixAndReport) {
  const auto r = run({"viewfactors", furnace, "-o", path("cube.mtx")});
  ASSERT_EQ(r.code, 0) << r.error;
  EXPECT_NE(r.out.find("closed scene: row sums are within"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("wrote " + path("cube.mtx")), std::string::npos) << r.out;
  EXPECT_EQ(r.error.find("no-emitter"), std::string::npos) << r.error;
  ASSERT_TRUE(holds("cube.mtx"));
  const auto report = nlohmann::json::parse(text("cube.json"));
  EXPECT_EQ(report["schema"], "clrad-viewfactors-1");
  EXPECT_EQ(report["matrix"]["file"], "cube.mtx");
  EXPECT_EQ(report["matrix"]["entries"], 30);
  EXPECT_TRUE(report["closed"]);
  ASSERT_EQ(report["rows"].size(), 6u);
  for (const auto& row : report["rows"]) {
    EXPECT_NEAR(row["row_sum"].get<double>(), 1, row["row_error"].get<double>());
    EXPECT_LE(row["row_error"], 1e-4);
    EXPECT_EQ(row["area_m2"], 1);
  }
  EXPECT_LE(report["worst_row_defect"], report["worst_row_error"]);
  EXPECT_EQ(report["entries_over_target"], 0);
}

TEST_F(CliViewFactors, RowsOfObjects) {
  const auto r = run(
      {"viewfactors", room, "-o", path("room.vf"), "--rows", "object", "--json", path("r.json"), "--quiet"});
  ASSERT_EQ(r.code, 0) << r.error;
  EXPECT_TRUE(r.out.empty()) << r.out;
  EXPECT_TRUE(holds("room.vf"));
  EXPECT_FALSE(holds("room.json"));
  EXPECT_GT(nlohmann::json::parse(text("r.json"))["rows"].size(), 1u);
}

TEST_F(CliViewFactors, BadUsageAndInputLeaveNothing) {
  EXPECT_EQ(run({"viewfactors", furnace}).code, 2);
  EXPECT_EQ(run({"viewfactors", furnace, "-o", path("f.csv")}).code, 2);
  EXPECT_EQ(run({"viewfactors", furnace, "-o", path("f.mtx"), "--target-error", "0"}).code, 2);
  EXPECT_EQ(run({"viewfactors", furnace, "-o", path("f.mtx"), "--rows", "room"}).code, 2);
  EXPECT_EQ(run({"viewfactors", path("missing.obj"), "-o", path("f.mtx")}).code, 3);
  write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  const auto bad = run({"viewfactors", path("bad.obj"), "-o", path("f.mtx")});
  EXPECT_EQ(bad.code, 3);
  EXPECT_NE(bad.error.find("bad.obj:4:"), std::string::npos) << bad.error;
  EXPECT_FALSE(holds("f.mtx"));
  EXPECT_FALSE(holds("f.json"));
}

TEST_F(CliViewFactors, SinglePrecisionSaysWhatItCannotDo) {
  const auto r =
      run({"viewfactors", furnace, "-o", path("f.npz"), "--precision", "float", "--target-error", "1e-6"});
  ASSERT_EQ(r.code, 0) << r.error;
  EXPECT_NE(r.error.find("single precision"), std::string::npos) << r.error;
}

// Rows of boxes that hide each other, at an accuracy that takes minutes: the interrupt finds it at work.
TEST_F(CliViewFactors, InterruptWritesWhatIsDone) {
  std::ostringstream scene;
  int corners = 0;
  for (int i = 0; i < 40; ++i) {
    const double x = i % 8 + 0.1 * (i % 3), y = i / 8 + 0.07 * (i % 5), h = 0.4 + 0.1 * (i % 7);
    const double box[5][4][3] = {{{x, y, 0}, {x, y, h}, {x, y + .5, h}, {x, y + .5, 0}},
                                 {{x + .5, y, 0}, {x + .5, y + .5, 0}, {x + .5, y + .5, h}, {x + .5, y, h}},
                                 {{x, y, 0}, {x + .5, y, 0}, {x + .5, y, h}, {x, y, h}},
                                 {{x, y + .5, 0}, {x, y + .5, h}, {x + .5, y + .5, h}, {x + .5, y + .5, 0}},
                                 {{x, y, h}, {x + .5, y, h}, {x + .5, y + .5, h}, {x, y + .5, h}}};
    for (const auto& face : box) {
      for (const auto& v : face) scene << "v " << v[0] << ' ' << v[1] << ' ' << v[2] << '\n';
      scene << "f " << corners + 1 << ' ' << corners + 2 << ' ' << corners + 3 << ' ' << corners + 4 << '\n';
      corners += 4;
    }
  }
  write("boxes.obj", scene.str());
  const pid_t child =
      start({"viewfactors", path("boxes.obj"), "-o", path("f.npz"), "--target-error", "1e-7"});
  // It works when it has used a second of processor time, however long that takes on a busy machine.
  const auto used = [child] {
    std::ifstream stat("/proc/" + std::to_string(child) + "/stat");
    std::string field;
    for (int k = 0; k < 14; ++k) stat >> field;  // the 14th: user time in ticks
    return field.empty() ? 0.0 : std::stod(field) / double(sysconf(_SC_CLK_TCK));
  };
  for (int tries = 0; tries < 600 && used() < 1; ++tries)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  kill(child, SIGINT);
  const auto r = finish(child);
  EXPECT_EQ(r.code, 4) << r.error;
  EXPECT_NE(r.error.find("pairs are done"), std::string::npos) << r.error;
  EXPECT_TRUE(holds("f.npz"));
  std::ifstream file(path("f.json"));
  const auto report = nlohmann::json::parse(file);
  EXPECT_EQ(report["stopped"], true);
  EXPECT_LT(report["pairs_done"], report["pairs_asked"]);
  EXPECT_EQ(report["rows"].size(), 200u);
  std::size_t incomplete = 0;
  for (const auto& row : report["rows"]) incomplete += !row["complete"].get<bool>();
  EXPECT_GT(incomplete, 0u);
}

}  // namespace

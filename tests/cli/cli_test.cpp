// The program as a user meets it: exit codes, messages, files.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <sstream>
#include <thread>

#include "cli/program.hpp"

namespace {

namespace fs = std::filesystem;
using clrad::test::furnace;

class Cli : public clrad::test::Program {};

const std::string cornell = CLRAD_SCENES "/cornell.obj";

TEST_F(Cli, SolveWritesPictureModelAndReport) {
  write("points.pts", "# a sensor in the middle\n0.5 0.5 0.5 0 0 1\n");
  const auto r =
      run({"solve", furnace, "-o", path("out"), "--size", "32x24", "--patch-edge", "0.5", "--element-edge",
           "0.25", "--samples", "1", "--converge", "1e-5", "--sensors", path("points.pts")});
  ASSERT_EQ(r.code, 0) << r.error;
  for (const char* file :
       {"out/picture.png", "out/scene.glb", "out/scene.vtu", "out/solution.clrad", "out/report.json"})
    EXPECT_TRUE(holds(file)) << file;
  const auto report = nlohmann::json::parse(text("out/report.json"));
  for (const char* key :
       {"schema", "program", "scene", "device", "options", "effects", "stages", "shoots", "rays",
        "candidates", "seconds", "energy", "error", "invariants", "memory", "polygons", "sensors"})
    EXPECT_TRUE(report.contains(key)) << key;
  EXPECT_EQ(report["scene"]["polygons"], 6);
  EXPECT_TRUE(report["energy"]["closed"]);
  // rho = 1/2, E = 1: B = H = 2.
  for (const auto& p : report["polygons"]) EXPECT_NEAR(p["radiosity_W_m2"][0].get<double>(), 2, 1e-4);
  ASSERT_EQ(report["sensors"].size(), 1u);
  EXPECT_NEAR(report["sensors"][0]["irradiance_W_m2"][0].get<double>(), 2, 1e-3);
  EXPECT_NE(r.out.find("where the time went"), std::string::npos);
}

TEST_F(Cli, WithoutAFolderOnlyWhatIsNamedIsWritten) {
  const auto r = run(
      {"solve", furnace, "--json", path("only.json"), "--quiet", "--patch-edge", "1", "--element-edge", "1"});
  ASSERT_EQ(r.code, 0) << r.error;
  EXPECT_TRUE(r.out.empty()) << r.out;
  EXPECT_TRUE(holds("only.json"));
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 3);  // and stdout, stderr
}

TEST_F(Cli, BadUsageIsExitCodeTwo) {
  EXPECT_EQ(run({}).code, 2);
  EXPECT_EQ(run({"solv", furnace}).code, 2);
  EXPECT_EQ(run({"solve", furnace, "--sample", "4"}).code, 2);
  EXPECT_EQ(run({"solve", furnace, "--size", "big"}).code, 2);
  EXPECT_EQ(run({"solve", furnace, "--converge", "2"}).code, 2);
  EXPECT_EQ(run({"solve", furnace, "--camera", "kitchen"}).code, 2);
  EXPECT_EQ(run({"solve", furnace, "--memory", "lots"}).code, 2);
  EXPECT_EQ(run({"solve", furnace, "--grid", "8x8"}).code, 2);
  const auto device = run({"solve", furnace, "--device", "abacus"});
  EXPECT_EQ(device.code, 2);
  EXPECT_NE(device.error.find("abacus"), std::string::npos);
}

TEST_F(Cli, ATargetIsMetOrExitCodeFourSaysThatItIsNot) {
  const std::string room = CLRAD_SCENES "/block_room.obj";
  const auto met = run({"solve", room, "--target-error", "10%", "--json", path("met.json")});
  ASSERT_EQ(met.code, 0) << met.error;
  EXPECT_NE(met.out.find("estimated error"), std::string::npos) << met.out;
  const auto report = nlohmann::json::parse(text("met.json"));
  EXPECT_TRUE(report["target"]["met"]);
  EXPECT_LE(report["error"]["total_relative"], 0.1);
  EXPECT_EQ(report["target"]["error_relative"], 0.1);
  write("one.pts", "2 1.5 1 0 0 1\n");
  const auto at_worst = run({"solve", room, "--target-error", "10%", "--target-of", "max", "--sensors",
                             path("one.pts"), "--json", path("max.json"), "--quiet"});
  ASSERT_EQ(at_worst.code, 0) << at_worst.error;
  EXPECT_EQ(nlohmann::json::parse(text("max.json"))["target"]["of"], "sensors");
  const auto not_met = run({"solve", room, "--target-error", "0.0001%", "--time-budget", "6s", "--json",
                            path("not.json"), "--quiet"});
  EXPECT_EQ(not_met.code, 4) << not_met.error;
  EXPECT_NE(not_met.error.find("not the"), std::string::npos) << not_met.error;
  const auto other = nlohmann::json::parse(text("not.json"));
  EXPECT_FALSE(other["target"]["met"]);
  EXPECT_EQ(other["target"]["time_budget_s"], 6);
  EXPECT_GT(other["polygons"].size(), 0u);
}

TEST_F(Cli, APlanForATargetSaysItsSettingsErrorAndTime) {
  const std::string room = CLRAD_SCENES "/block_room.obj";
  const auto plan = run({"plan", room, "--target-error", "1.5%", "--json", path("plan.json")});
  ASSERT_EQ(plan.code, 0) << plan.error;
  EXPECT_NE(plan.out.find("for --target-error 1.5%"), std::string::npos) << plan.out;
  const auto target = nlohmann::json::parse(text("plan.json"))["target"];
  EXPECT_TRUE(target["meets"]);
  EXPECT_LE(target["error_relative"], 0.015);
  EXPECT_GT(target["seconds"], 0);
  EXPECT_FALSE(nlohmann::json::parse(text("plan.json"))["predicted"]["patches"].is_null());
}

TEST_F(Cli, BadTargetsAreBadUsage) {
  const std::string room = CLRAD_SCENES "/block_room.obj";
  for (const char* share : {"0", "-1%", "100%", "2", "two", "5 per cent"})
    EXPECT_EQ(run({"solve", room, "--target-error", share}).code, 2) << share;
  for (const char* time : {"0", "-1", "soon", "5 m"})
    EXPECT_EQ(run({"solve", room, "--time-budget", time}).code, 2) << time;
  EXPECT_EQ(run({"solve", room, "--target-error", "5%", "--no-error"}).code, 2);
  EXPECT_EQ(run({"solve", room, "--target-error", "5%", "--target-of", "sensors"}).code, 2);
  EXPECT_EQ(run({"solve", room, "--time-budget", "0.001s"}).code, 2);  // gone before it begins
}

TEST_F(Cli, BadInputIsExitCodeThreeWithFileAndLineAndLeavesNothing) {
  write("bad.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n");
  const auto r = run({"solve", path("bad.obj"), "-o", path("out")});
  EXPECT_EQ(r.code, 3);
  EXPECT_NE(r.error.find("bad.obj:4:"), std::string::npos) << r.error;
  EXPECT_FALSE(holds("out"));
  EXPECT_EQ(run({"solve", path("missing.obj")}).code, 3);

  write("bad.pts", "0 0 0 0 0 1\n0 0 zero 0 0 1\n");
  const auto s = run({"solve", furnace, "--sensors", path("bad.pts")});
  EXPECT_EQ(s.code, 3);
  EXPECT_NE(s.error.find("bad.pts:2:"), std::string::npos) << s.error;
}

TEST_F(Cli, TooLittleMemoryIsSaid) {
  const auto r = run({"solve", cornell, "--memory", "1M"});
  EXPECT_EQ(r.code, 1);
  EXPECT_NE(r.error.find("--memory"), std::string::npos) << r.error;
}

TEST_F(Cli, MemoryIsKept) {
  const auto r = run({"solve", cornell, "--memory", "64M", "--samples", "1", "--light-samples", "64",
                      "--converge", "0.05", "--json", path("r.json")});
  ASSERT_EQ(r.code, 0) << r.error;
  const auto report = nlohmann::json::parse(text("r.json"));
  EXPECT_LE(report["memory"]["device_peak_bytes"].get<double>(), 64.0 * (1 << 20));
}

TEST_F(Cli, InterruptLeavesAValidPartialResultAndExitCodeFour) {
  const pid_t child = start(
      {"solve", cornell, "-o", path("out"), "--size", "32x32", "--patch-edge", "0.03", "--converge", "1e-9"});
  // Long enough to be shooting, and far from done: this solve takes minutes.
  std::this_thread::sleep_for(std::chrono::seconds(6));
  kill(child, SIGINT);
  const auto r = finish(child);
  EXPECT_EQ(r.code, 4) << r.error;
  const auto report = nlohmann::json::parse(text("out/report.json"));
  EXPECT_TRUE(report["stopped"]);
  EXPECT_TRUE(holds("out/picture.png"));
  EXPECT_GT(report["unshot_relative"].get<double>(), 1e-9);
}

TEST_F(Cli, CheckExplainsAndExitsByWhatItFound) {
  EXPECT_EQ(run({"check", furnace}).code, 0);
  write("flat.obj", "v 0 0 0\nv 1 0 0\nv 2 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n");
  const auto r = run({"check", path("flat.obj")});
  EXPECT_NE(r.out.find("flat.obj:5:"), std::string::npos) << r.out;
  write("nan.obj", "v 0 0 nan\nv 1 0 0\nv 0 1 0\nf 1 2 3\n");
  EXPECT_EQ(run({"check", path("nan.obj")}).code, 3);
}

TEST_F(Cli, DevicesAndHelp) {
  const auto devices = run({"devices"});
  EXPECT_EQ(devices.code, 0);
  EXPECT_NE(devices.out.find("compute units"), std::string::npos);
  const auto help = run({"solve", "--help"});
  EXPECT_EQ(help.code, 0);
  for (const char* option : {"--engine", "--samples", "--form-factor", "--converge", "--patch-edge",
                             "--element-edge", "--sensors", "--camera"})
    EXPECT_NE(help.out.find(option), std::string::npos) << option;
}

}  // namespace

// clrad tradeoff as a user meets it.
#include <gtest/gtest.h>
#include <signal.h>

#include <chrono>
#include <cmath>
#include <nlohmann/json.hpp>
#include <thread>

#include "cli/program.hpp"

namespace {

class TradeoffVerb : public clrad::test::Program {};

const std::string block_room_file = CLRAD_SCENES "/block_room.obj";

// The furnace has an exact answer, B = E / (1 - rho), so that no reference is solved.
TEST_F(TradeoffVerb, MeasuresAndWrites) {
  const auto r =
      run({"tradeoff", clrad::test::furnace, "-o", path("out"), "--budget", "5", "--points", "100"});
  ASSERT_EQ(r.code, 0) << r.error;
  for (const char* file : {"out/tradeoff.csv", "out/tradeoff.json", "out/tradeoff.md"})
    EXPECT_TRUE(holds(file)) << file;
  const auto json = nlohmann::json::parse(text("out/tradeoff.json"));
  EXPECT_EQ(json["schema"], "clrad-tradeoff-1");
  ASSERT_GE(json["settings"].size(), 1u);
  for (const auto& s : json["settings"]) {
    EXPECT_GT(s["seconds"].get<double>(), 0);
    // The least converged rung leaves 3 % of the light unshot; the disk estimator is off by some tens of per cent.
    if (s["form_factor"] == "exact" && s["converge"].get<double>() < 0.05) {
      EXPECT_LT(s["rms_relative"].get<double>(), 0.03) << s;
    }
  }
  EXPECT_EQ(json["points"]["count"], 100);
  EXPECT_NEAR(json["mean_irradiance_W_m2"].get<double>(), 2, 1e-12);
  EXPECT_NE(r.out.find("5 % costs"), std::string::npos) << r.out;
  EXPECT_NE(r.out.find("--element-edge"), std::string::npos);
  EXPECT_NE(r.error.find("settings measured"), std::string::npos) << r.error;
}

TEST_F(TradeoffVerb, KnownIrradianceAtSensorsIsTheTruth) {
  write("one.pts", "0.5 0.5 0.5 0 0 1\n");
  write("true.txt", "# H\n4\n");  // twice what it is: every error is one half
  const auto r = run({"tradeoff", clrad::test::furnace, "-o", path("out"), "--budget", "1", "--sensors",
                      path("one.pts"), "--reference", path("true.txt"), "--quiet"});
  ASSERT_EQ(r.code, 0) << r.error;
  EXPECT_TRUE(r.out.empty());
  const auto json = nlohmann::json::parse(text("out/tradeoff.json"));
  ASSERT_GE(json["settings"].size(), 1u);
  EXPECT_NEAR(json["settings"][0]["rms_relative"].get<double>(), 0.5, 0.02);  // 3 % unshot
  EXPECT_TRUE(json["advice"][0]["setting"].is_null());
}

TEST_F(TradeoffVerb, SaysWhatIsWrongWithItsArguments) {
  const std::string out = path("out");
  EXPECT_EQ(run({"tradeoff", clrad::test::furnace}).code, 2);
  EXPECT_EQ(run({"tradeoff", clrad::test::furnace, "-o", out, "--budget", "-1"}).code, 2);
  EXPECT_EQ(run({"tradeoff", path("missing.obj"), "-o", out}).code, 3);
  write("true.txt", "1\n");
  EXPECT_EQ(run({"tradeoff", clrad::test::furnace, "-o", out, "--reference", path("true.txt")}).code, 2);
  write("two.pts", "0.5 0.5 0.5 0 0 1\n0.5 0.5 0.4 0 0 1\n");
  EXPECT_EQ(run({"tradeoff", clrad::test::furnace, "-o", out, "--sensors", path("two.pts"), "--reference",
                 path("true.txt")})
                .code,
            3);
  write("bad.txt", "1\none\n");
  const auto bad = run({"tradeoff", clrad::test::furnace, "-o", out, "--sensors", path("two.pts"),
                        "--reference", path("bad.txt")});
  EXPECT_EQ(bad.code, 3);
  EXPECT_NE(bad.error.find("bad.txt:2:"), std::string::npos) << bad.error;
  EXPECT_FALSE(holds("out"));
}

TEST_F(TradeoffVerb, InterruptWritesWhatThereIs) {
  const pid_t child =
      start({"tradeoff", block_room_file, "-o", path("out"), "--budget", "3600", "--points", "100"});
  // An hour's budget: once settings are measured, there are many to come.
  for (int k = 0; k < 1200 && text("stderr").find("] 3 settings measured") == std::string::npos; ++k)
    std::this_thread::sleep_for(std::chrono::milliseconds(100));
  kill(child, SIGINT);
  const auto r = finish(child);
  EXPECT_EQ(r.code, 4) << r.error;
  const auto json = nlohmann::json::parse(text("out/tradeoff.json"));
  EXPECT_TRUE(json["stopped"]);
  EXPECT_GE(json["settings"].size(), 3u);
  EXPECT_FALSE(json["front"].empty());
}

}  // namespace

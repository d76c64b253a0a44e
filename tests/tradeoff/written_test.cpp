// What is written of a measurement.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>
#include <sstream>

#include "clrad/tradeoff.hpp"
#include "output/gnuplot.hpp"
#include "tradeoff/settings.hpp"

namespace clrad {
namespace {

Tradeoff of_three() {
  Tradeoff t;
  t.scene = "rooms/it's \"one\".obj", t.device = "device", t.points = 10, t.mean_irradiance = 2;
  for (const double seconds : {0.1, 1.0, 10.0}) {
    TradeoffRun r{ladder_settings(1, {})[0]};
    r.setting.name = "a \"name\", with a comma";
    r.seconds = seconds, r.rms_relative = 0.01 / seconds;
    if (seconds == 1) r.estimate_relative = 0.02;
    t.runs.push_back(r);
  }
  t.runs[2].rms_relative = 0.5;
  t.front = pareto_front(t.runs);
  for (const std::size_t i : t.front) t.runs[i].on_front = true;
  for (const double target : {0.05, 0.01, 0.001}) t.advice.push_back(cheapest_within(t.runs, target));
  return t;
}

// Fields of a line, quotes read as spreadsheets do.
std::vector<std::string> fields_of(const std::string& line) {
  std::vector<std::string> fields(1);
  bool quoted = false;
  for (std::size_t i = 0; i < line.size(); ++i) {
    if (line[i] == '"' && quoted && i + 1 < line.size() && line[i + 1] == '"')
      fields.back() += line[i++];
    else if (line[i] == '"')
      quoted = !quoted;
    else if (line[i] == ',' && !quoted)
      fields.emplace_back();
    else
      fields.back() += line[i];
  }
  return fields;
}

TEST(TradeoffWritten, CsvHasARowASettingAndAFieldAColumn) {
  std::istringstream csv(tradeoff_csv(of_three()));
  std::string line;
  std::getline(csv, line);
  const auto head = fields_of(line);
  const auto column = [&](const std::string& name) {
    return std::size_t(std::find(head.begin(), head.end(), name) - head.begin());
  };
  std::vector<std::vector<std::string>> rows;
  while (std::getline(csv, line)) rows.push_back(fields_of(line));
  ASSERT_EQ(rows.size(), 3u);
  for (const auto& row : rows) ASSERT_EQ(row.size(), head.size());
  EXPECT_EQ(rows[0][column("setting")], "a \"name\", with a comma");
  EXPECT_EQ(std::stod(rows[0][column("rms_relative")]), 0.1);
  EXPECT_EQ(std::stod(rows[1][column("seconds")]), 1);
  EXPECT_EQ(rows[0][column("estimate_relative")], "");  // NaN
  EXPECT_EQ(rows[1][column("estimate_relative")], "0.02");
  EXPECT_EQ(rows[1][column("on_front")], "1");
  EXPECT_EQ(rows[2][column("on_front")], "0");
}

TEST(TradeoffWritten, JsonSaysFrontAndAdvice) {
  const auto json = nlohmann::json::parse(tradeoff_json(of_three()));
  EXPECT_EQ(json["schema"], "clrad-tradeoff-1");
  ASSERT_EQ(json["settings"].size(), 3u);
  EXPECT_TRUE(json["settings"][0]["estimate_relative"].is_null());
  EXPECT_EQ(json["front"], nlohmann::json({0, 1}));
  EXPECT_EQ(json["advice"][0]["setting"], 1);
  EXPECT_TRUE(json["advice"][2]["setting"].is_null());
  EXPECT_NE(json["advice"][1]["arguments"].get<std::string>().find("--patch-edge"), std::string::npos);
}

TEST(TradeoffWritten, TicksArePlainNumbersDownToAThousandth) {
  EXPECT_EQ(log_ticks(0.1, 2, " %"),
            "(\"0.1 %%\" 0.1, \"0.2 %%\" 0.2, \"0.5 %%\" 0.5, \"1 %%\" 1, \"2 %%\" 2)");
  EXPECT_EQ(log_ticks(0.001, 10, " s"),
            "(\"0.001 s\" 0.001, \"0.01 s\" 0.01, \"0.1 s\" 0.1, \"1 s\" 1, \"10 s\" 10)");
  EXPECT_EQ(log_ticks(1e-5, 0.1, " %"),
            "(\"1e-5 %%\" 1e-05, \"1e-4 %%\" 0.0001, \"0.001 %%\" 0.001, \"0.01 %%\" 0.01, \"0.1 %%\" 0.1)");
}

TEST(TradeoffWritten, TextInScriptsCannotLeaveItsQuotes) {
  EXPECT_EQ(gnuplot_text("it's\n'; system 'x"), "it''s''; system ''x");
}

}  // namespace
}  // namespace clrad

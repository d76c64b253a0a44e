#include "hard/table.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <sstream>
#include <vector>

namespace clrad::test {
namespace {

struct Row {
  std::string suite, text;
};
std::vector<Row>& rows() {
  static std::vector<Row> all;
  return all;
}

// 1234567 -> 1,234,567
std::string grouped(std::uint64_t n) {
  std::string text = std::to_string(n);
  for (std::size_t at = text.size(); at > 3; at -= 3) text.insert(at - 3, ",");
  return text;
}

// Writes the tables when all tests have run. The file is replaced in one step.
class TableWriter : public testing::Environment {
 public:
  void TearDown() override {
    const char* file = std::getenv("CLRAD_HARD_TABLE");
    if (file == nullptr || *file == '\0' || rows().empty()) return;
    std::string text;
    {
      std::ifstream old(file);
      std::ostringstream all;
      all << old.rdbuf();
      const auto at = all.str().find(hard_table_marker);
      if (at != std::string::npos) text = all.str().substr(0, at);
    }
    text += fmt::format("{}\n", hard_table_marker);
    std::string suite;
    for (const Row& row : rows()) {
      if (row.suite != suite) {
        suite = row.suite;
        text += fmt::format(
            "\n### {}\n\n| case | what goes wrong elsewhere | measured | verdict |\n|---|---|---|---|\n",
            suite);
      }
      text += row.text;
    }
    const std::string temporary = std::string(file) + ".part";
    std::ofstream(temporary) << text;
    std::filesystem::rename(temporary, file);
  }
};
[[maybe_unused]] const testing::Environment* const writer =
    testing::AddGlobalTestEnvironment(new TableWriter);

}  // namespace

bool long_tests() {
  const char* value = std::getenv("CLRAD_LONG_TESTS");
  return value != nullptr && std::string(value) == "1";
}

HardCase::HardCase(std::string what, std::string elsewhere)
    : what_(std::move(what)), elsewhere_(std::move(elsewhere)) {}

HardCase::~HardCase() {
  if (numbers_ + answers_ == 0) fail("nothing was measured");
  const std::string result = measured(), verdict = failures_ == 0 ? "holds" : "FAILS";
  fmt::print("{:5}  {}: {}\n", verdict, what_, result);
  rows().push_back({testing::UnitTest::GetInstance()->current_test_info()->test_suite_name(),
                    fmt::format("| {} | {} | {} | {} |\n", what_, elsewhere_, result, verdict)});
}

void HardCase::near(double got, double expected, double allowed, const std::string& where) {
  ++numbers_;
  const double error = std::abs(got - expected);
  // NaN makes the comparison false, and the share infinite; an infinite tolerance is a mistake of the test.
  const bool fine = error <= allowed && std::isfinite(allowed);
  const double share = error == 0 ? 0 : allowed > 0 && std::isfinite(error) ? error / allowed : INFINITY;
  if (share > worst_)
    worst_ = share, worst_error_ = error, worst_allowed_ = allowed, worst_where_ = where,
    worst_relative_ = false;
  if (!fine)
    fail(fmt::format("{}: {} instead of {}, off by {} where {} is allowed", where, got, expected, error,
                     allowed));
}

void HardCase::relative(double got, double expected, double allowed, const std::string& where, double floor) {
  const double before = worst_, size = std::abs(expected);
  near(got, expected, allowed * size + floor, where);
  if (worst_ > before && size > 0) worst_error_ /= size, worst_allowed_ /= size, worst_relative_ = true;
}

void HardCase::right(bool is, const std::string& where) {
  count(1, is ? 0 : 1, where);
}

void HardCase::count(std::uint64_t asked, std::uint64_t wrong, const std::string& where) {
  answers_ += asked;
  wrong_ += wrong;
  if (wrong > 0) fail(fmt::format("{}: {} of {} wrong", where, wrong, asked));
}

void HardCase::note(const std::string& text) {
  notes_ += (notes_.empty() ? "" : "; ") + text;
}

void HardCase::fail(const std::string& text) {
  constexpr std::uint64_t shown = 5;
  if (failures_++ < shown) ADD_FAILURE() << what_ << ": " << text;
}

std::string HardCase::measured() const {
  std::string text;
  if (numbers_ > 0)
    text = fmt::format("{} number{}, worst {}error {:.2g} of {:.2g} allowed", grouped(numbers_),
                       numbers_ == 1 ? "" : "s", worst_relative_ ? "relative " : "", worst_error_,
                       worst_allowed_);
  if (answers_ > 0)
    text += fmt::format("{}{} of {} wrong", text.empty() ? "" : "; ", grouped(wrong_), grouped(answers_));
  return notes_.empty() ? text : text + "; " + notes_;
}

}  // namespace clrad::test

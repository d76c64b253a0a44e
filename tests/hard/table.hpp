/// The table of hard cases: each test states what goes wrong elsewhere, measures itself against a derived tolerance, and
/// prints one line of verdict. With CLRAD_HARD_TABLE=FILE the lines are written as Markdown tables, one per test suite,
/// below the line that hard_table_marker names if FILE has it already (docs/hard.md does).
#pragma once
#include <cstdint>
#include <string>

namespace clrad::test {

inline constexpr const char* hard_table_marker = "<!-- measured: CLRAD_HARD_TABLE -->";

/// CLRAD_LONG_TESTS=1: sizes for the long test run.
bool long_tests();

/// One line of the table, alive as long as its test measures. Whatever is wrong is a failure of the running test.
class HardCase {
 public:
  /// `what`: the case. `elsewhere`: what goes wrong where it is not taken care of.
  HardCase(std::string what, std::string elsewhere);
  ~HardCase();
  HardCase(const HardCase&) = delete;
  HardCase& operator=(const HardCase&) = delete;

  /// |got - expected| <= allowed, NaN refused. The worst share of what is allowed is what the table shows.
  void near(double got, double expected, double allowed, const std::string& where);
  /// The same, with `allowed` and the error that is shown relative to |expected|, plus an absolute `floor`.
  void relative(double got, double expected, double allowed, const std::string& where, double floor = 0);
  /// A yes-or-no answer, counted; nothing wrong is allowed.
  void right(bool is, const std::string& where);
  /// `wrong` of `asked` answers at once, all of which have to be right.
  void count(std::uint64_t asked, std::uint64_t wrong, const std::string& where);
  /// More to show in the table.
  void note(const std::string& text);

 private:
  void fail(const std::string& text);
  std::string measured() const;

  std::string what_, elsewhere_, notes_, worst_where_;
  double worst_ = -1, worst_error_ = 0, worst_allowed_ = 0;  // worst: error / allowed
  bool worst_relative_ = false;
  std::uint64_t numbers_ = 0, answers_ = 0, wrong_ = 0, failures_ = 0;
};

}  // namespace clrad::test

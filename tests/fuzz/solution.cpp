#include <cmath>

#include "clrad/output.hpp"
#include "fuzz/archive_case.hpp"
#include "output/displayed.hpp"

namespace clrad::fuzz {

void solution(Bytes bytes) {
  const std::string path = write_archive("a.clrad", bytes);
  Solution s;
  try {
    s = load_solution(path);
  } catch (const InputError& e) {
    return require_message(e.what(), path);
  }
  // What writers and pictures take from it.
  for (const double b : display_radiosity(s, true)) require(!std::isnan(b), "a radiosity that is no number");
  for (const double b : Displayed(s, true).bend) require(!std::isnan(b), "a bend that is no number");
  polygon_means(s);
  report_json(s);
}

}  // namespace clrad::fuzz

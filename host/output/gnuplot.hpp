// Plots drawn by gnuplot, where it is there.
#pragma once
#include <string>
#include <utility>
#include <vector>

namespace clrad {

/// Text between single quotes of a gnuplot script, on one line.
std::string gnuplot_text(const std::string& text);

/// Major ticks of a logarithmic axis from `low` to `high` as gnuplot's `set xtics` takes them: ("0.1 s" 0.1, "0.2 s" 0.2, ...);
/// 1, 2 and 5 of each decade where there are few of them, else each decade alone. Values are written plainly, `unit` behind.
std::string log_ticks(double low, double high, const std::string& unit);

/// Writes the files {name, text}, runs the one called `script` with gnuplot beside the others, and gives the files that it is to
/// draw, `pictures`, their names in `folder`. False, and nothing is written, when gnuplot is not there or fails.
bool draw_with_gnuplot(const std::string& folder,
                       const std::vector<std::pair<std::string, std::string>>& files,
                       const std::string& script, const std::vector<std::string>& pictures);

}  // namespace clrad

// Curves as data, gnuplot script and, where gnuplot is there, PNG.
#pragma once
#include <fmt/format.h>

#include <string>
#include <vector>

#include "clrad/output.hpp"
#include "output/gnuplot.hpp"

namespace clrad::bench {

struct Curve {
  std::string title, style;  ///< style: what gnuplot's `with` takes
  std::vector<std::pair<double, double>> points;
};

struct Plot {
  std::string name, title, x, y;  ///< name: of the files
  std::vector<Curve> curves;
  std::string extra = {};  ///< lines of gnuplot before the plot

  /// FOLDER/NAME.dat (one block a curve), NAME.gnuplot and, with gnuplot, NAME.png. Both axes logarithmic.
  void write(const std::string& folder) const {
    std::string data, script;
    for (const Curve& c : curves) {
      data += fmt::format("# {}\n# {}, {}\n", c.title, x, y);
      for (const auto& [a, b] : c.points) data += fmt::format("{:.8g} {:.8g}\n", a, b);
      data += "\n\n";
    }
    script = "# gnuplot " + name + ".gnuplot, in this folder, draws " + name + ".png\n" +
             "set terminal pngcairo size 1200,800 font 'DejaVu Sans,15' linewidth 1.4\n" + "set output '" +
             name + ".png'\n" + "set title '" + title + "' font ',17'\n" +
             "set logscale xy\nset format xy '10^{%L}'\nset grid xtics ytics lc rgb '#b0b0b0' lt 1 lw 0.6\n" +
             "set border lc rgb '#404040'\nset key outside bottom center horizontal spacing 1.3 samplen 2.5 "
             "width 2\n" +
             "set xlabel '" + x + "'\nset ylabel '" + y + "'\nset mxtics 10\nset mytics 10\n" + extra +
             "plot ";
    for (std::size_t i = 0; i < curves.size(); ++i)
      script += (i ? ", \\\n     " : "") + fmt::format("'{}.dat' index {} with {} title '{}'", name, i,
                                                       curves[i].style, curves[i].title);
    script += "\n";
    write_file(folder + "/" + name + ".dat", data);
    write_file(folder + "/" + name + ".gnuplot", script);
    drawn = draw_with_gnuplot(folder, {{name + ".dat", data}, {name + ".gnuplot", script}}, name + ".gnuplot",
                              {name + ".png"});
  }
  mutable bool drawn = false;
};

inline std::string points_style(int color, int shape, bool lines = true) {
  constexpr const char* colors[] = {"#1b6ca8", "#c8553d", "#4a8c3f", "#8d5a97", "#b58900", "#333333"};
  return fmt::format("{} lc rgb '{}' pt {} ps 1.3 lw 1.6", lines ? "linespoints" : "points",
                     colors[color % 6], shape);
}
inline std::string line_style(int color, const char* dash = "2") {
  constexpr const char* colors[] = {"#1b6ca8", "#c8553d", "#4a8c3f", "#8d5a97", "#b58900", "#333333"};
  return fmt::format("lines lc rgb '{}' dt {} lw 1.6", colors[color % 6], dash);
}

}  // namespace clrad::bench

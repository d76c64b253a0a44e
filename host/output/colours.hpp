// The mesh's vertices as a picture would show them, for files that carry colours.
#pragma once
#include <vector>

#include "clrad/solution.hpp"

namespace clrad {

struct DisplayColours {
  std::vector<double> radiosity;  ///< display_radiosity(), [band][vertex] [W/m^2 or lm/m^2]
  std::vector<double> luminance;  ///< of that radiosity, per vertex: Rec.709 of three bands, else their mean
  std::vector<double>
      rgb;  ///< [vertex][3], linear in [0, 1]: under the picture's automatic exposure, over the vertices
};
DisplayColours display_colours(const Solution& solution);

}  // namespace clrad

// Points of the surfaces at which a solution's irradiance is checked.
#pragma once
#include <cstdint>
#include <vector>

#include "clrad/solution.hpp"
#include "mesh/locate.hpp"
#include "mesh/random.hpp"

namespace clrad {

struct CheckPoint {
  Point point;  ///< frame
  Interpolant where;
  std::uint32_t polygon = 0;
  double u = 0, v = 0;  ///< the polygon's parameters there, as locate() takes them
  double weight = 0;    ///< share of the surfaces' area that it stands for; all sum to 1
};

/// `count` points inside elements that are not covered altogether, more of them where irradiance varies over an element: there it
/// is wrong, and a few such places make up most of an RMS error. The mean over the surfaces of any value is the sum of weight x value.
std::vector<CheckPoint> points_in_elements(const Solution& solution, std::uint32_t count, Random& random);

/// Area of the elements that are not covered altogether.
double exposed_area_m2(const Solution& solution);

/// How many points_in_elements() draws on a share of an element's area that is 1 in all of the surfaces that are not covered, per element.
std::vector<double> density_of_points(const Solution& solution, std::uint32_t count);

/// `count` vertices, drawn likewise from all that nothing covers, and the shares of the area that they stand for.
struct CheckVertices {
  std::vector<std::uint32_t> vertex;
  std::vector<double> weight;
};
CheckVertices check_vertices(const Solution& solution, std::uint32_t count, Random& random);

}  // namespace clrad

// What sensors see most of: there light is gathered anew with more rays (host/solve/vertex_gather.cpp).
#pragma once
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/bend.hpp"

namespace clrad {

/// Places where light is gathered anew: vertices, and behind them the middles of edges.
struct PlaceNumbers {
  std::size_t count = 0;
  std::vector<std::uint32_t> of_vertex, of_edge;  ///< 0xffffffff: none
};

/// Ends of rays from sensors, a sensor's together. What irradiance between vertices is at an end is the sum of weight x
/// value over 8 vertices, and after them over the bends of 8 edges, as kernels/shared/leaf.cl has them.
struct RayEnds {
  std::vector<std::uint32_t> sensor, element;  ///< element 0xffffffff: the ray is blocked
  std::vector<std::uint32_t> vertex;           ///< [8 ray + k]
  std::vector<double> weight;                  ///< [16 ray + k]
  std::vector<double> share;  ///< the sensor's irradiance for a radiosity of 1 at the ray's end
};

/// How much of the light of each place comes to each sensor.
class SeenPlaces {
 public:
  /// reflectance [element * bands + band]. All are kept by reference.
  SeenPlaces(const Edges& edges, const PlaceNumbers& places, std::span<const double> reflectance,
             std::uint32_t bands)
      : edges_(edges), places_(places), reflectance_(reflectance), bands_(bands) {}

  /// Rays of further sensors.
  void add(const RayEnds& ends);

  /// Rays for each place, `rays` x a power of two and at most `most`, and no more than 2 x `rays` on average: by what an error of
  /// irradiance[place] there adds to the RMS error of sensors (Neyman 1934).
  std::vector<std::uint32_t> rays_for(std::span<const double> irradiance, std::uint32_t rays,
                                      std::uint32_t most) const;

  /// Square of the error of sensors [sensor * bands + band] for independent errors [place * bands + band] of places. Too low where most
  /// places are met by one ray each, which tells nothing.
  std::vector<double> error_square(std::span<const double> error, std::size_t sensors) const;

 private:
  const Edges& edges_;
  const PlaceNumbers& places_;
  std::span<const double> reflectance_;
  std::uint32_t bands_;
  /// The squares of what a sensor has of a place, [i * bands + band], from different rays of the sensor: the squares of single rays would
  /// overrate it, the more the fewer they are.
  struct Pair {
    std::uint32_t sensor, place;
  };
  std::vector<Pair> pairs_;
  std::vector<float> squares_;
};

}  // namespace clrad

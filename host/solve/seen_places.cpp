#include "solve/seen_places.hpp"

#include <algorithm>
#include <cmath>

namespace clrad {
namespace {

constexpr std::uint32_t none = 0xffffffffu;

// What one sensor has of each place, ray by ray.
class OneSensor {
 public:
  explicit OneSensor(std::size_t places) : sum_(places, 0), squares_(places, 0), of_ray_(places, 0) {}

  void add(std::uint32_t place, double weight) {
    if (place == none || weight == 0) return;
    if (of_ray_[place] == 0) touched_by_ray_.push_back(place);
    of_ray_[place] += weight;
  }
  void end_ray() {
    for (const std::uint32_t place : touched_by_ray_) {
      const double w = of_ray_[place];
      of_ray_[place] = 0;
      if (squares_[place] == 0) touched_.push_back(place);
      sum_[place] += w, squares_[place] += w * w;
    }
    touched_by_ray_.clear();
  }
  template <class Take>
  void end_sensor(Take take) {
    for (const std::uint32_t place : touched_) {
      const double square = sum_[place] * sum_[place] - squares_[place];
      sum_[place] = squares_[place] = 0;
      if (square > 0) take(place, square);
    }
    touched_.clear();
  }

 private:
  std::vector<double> sum_, squares_, of_ray_;
  std::vector<std::uint32_t> touched_, touched_by_ray_;
};

}  // namespace

SeenPlaces::SeenPlaces(const RayEnds& ends, const Edges& edges, const PlaceNumbers& places,
                       std::span<const double> reflectance) {
  OneSensor one(places.count);
  for (std::size_t ray = 0; ray < ends.sensor.size(); ++ray) {
    const std::uint32_t element = ends.element[ray];
    if (element != none) {
      const double share = ends.share[ray] * reflectance[element];
      for (std::size_t k = 0; k < 8; ++k)
        one.add(places.of_vertex[ends.vertex[8 * ray + k]], share * ends.weight[16 * ray + k]);
      for (std::size_t k = 0; k < 8; ++k) {
        const std::uint32_t edge = edges.of_element[element][k];
        if (edge == none || places.of_edge[edge] == none) continue;
        // A bend is four times the middle less twice the ends.
        const double bend = share * ends.weight[16 * ray + 8 + k];
        one.add(places.of_edge[edge], 4 * bend);
        for (const std::uint32_t v : edges.ends[edge]) one.add(places.of_vertex[v], -2 * bend);
      }
      one.end_ray();
    }
    const std::uint32_t sensor = ends.sensor[ray];
    if (ray + 1 == ends.sensor.size() || ends.sensor[ray + 1] != sensor)
      one.end_sensor([&](std::uint32_t place, double square) {
        squares_.push_back({sensor, place, square});
      });
  }
}

std::vector<std::uint32_t> SeenPlaces::rays_for(std::span<const double> irradiance, std::uint32_t rays,
                                                std::uint32_t most) const {
  std::vector<double> weight(irradiance.size(), 0);
  for (const Square& s : squares_) weight[s.place] += s.square;
  double all = 0;
  for (std::size_t p = 0; p < weight.size(); ++p)
    weight[p] = std::abs(irradiance[p]) * std::sqrt(weight[p]), all += weight[p];
  std::vector<std::uint32_t> result(irradiance.size(), rays);
  for (std::size_t p = 0; p < weight.size() && all > 0; ++p) {
    double wanted = weight[p] / all * double(weight.size());  // times `rays`
    for (; wanted >= 2 && result[p] <= most / 2; wanted /= 2) result[p] *= 2;
  }
  return result;
}

std::vector<double> SeenPlaces::error_square(std::span<const double> error, std::size_t stride,
                                             std::size_t first, std::size_t sensors) const {
  std::vector<double> result(sensors, 0);
  for (const Square& s : squares_) {
    const double e = error[s.place * stride + first];
    result[s.sensor] += s.square * e * e;
  }
  return result;
}

}  // namespace clrad

#include "solve/seen_places.hpp"

#include <algorithm>
#include <cmath>

namespace clrad {
namespace {

constexpr std::uint32_t none = 0xffffffffu;

// What one sensor has of each place, ray by ray.
class OneSensor {
 public:
  OneSensor(std::size_t places, std::uint32_t bands)
      : bands_(bands),
        sum_(places * bands, 0),
        squares_(places * bands, 0),
        of_ray_(places, 0),
        met_(places, 0) {}

  void add(std::uint32_t place, double weight) {
    if (place == none || weight == 0) return;
    if (of_ray_[place] == 0) touched_by_ray_.push_back(place);
    of_ray_[place] += weight;
  }
  /// All places of a ray are of one element.
  void end_ray(const double* reflectance) {
    for (const std::uint32_t place : touched_by_ray_) {
      if (!met_[place]) touched_.push_back(place), met_[place] = 1;
      for (std::uint32_t b = 0; b < bands_; ++b) {
        const double w = of_ray_[place] * reflectance[b];
        sum_[std::size_t(place) * bands_ + b] += w, squares_[std::size_t(place) * bands_ + b] += w * w;
      }
      of_ray_[place] = 0;
    }
    touched_by_ray_.clear();
  }
  /// take(place, squares of the bands)
  template <class Take>
  void end_sensor(Take take) {
    std::vector<double> square(bands_);
    for (const std::uint32_t place : touched_) {
      for (std::uint32_t b = 0; b < bands_; ++b) {
        double &sum = sum_[std::size_t(place) * bands_ + b],
               &squares = squares_[std::size_t(place) * bands_ + b];
        square[b] = std::max(0.0, sum * sum - squares);
        sum = squares = 0;
      }
      met_[place] = 0;
      take(place, square);
    }
    touched_.clear();
  }

 private:
  std::uint32_t bands_;
  std::vector<double> sum_, squares_, of_ray_;
  std::vector<std::uint8_t> met_;
  std::vector<std::uint32_t> touched_, touched_by_ray_;
};

}  // namespace

void SeenPlaces::add(const RayEnds& ends) {
  OneSensor one(places_.count, bands_);
  for (std::size_t ray = 0; ray < ends.sensor.size(); ++ray) {
    const std::uint32_t element = ends.element[ray];
    if (element != none) {
      const double share = ends.share[ray];
      for (std::size_t k = 0; k < 8; ++k)
        one.add(places_.of_vertex[ends.vertex[8 * ray + k]], share * ends.weight[16 * ray + k]);
      for (std::size_t k = 0; k < 8; ++k) {
        const std::uint32_t edge = edges_.of_element[element][k];
        if (edge == none || places_.of_edge[edge] == none) continue;
        // A bend is four times the middle less twice the ends.
        const double bend = share * ends.weight[16 * ray + 8 + k];
        one.add(places_.of_edge[edge], 4 * bend);
        for (const std::uint32_t v : edges_.ends[edge]) one.add(places_.of_vertex[v], -2 * bend);
      }
      one.end_ray(reflectance_.data() + std::size_t(element) * bands_);
    }
    const std::uint32_t sensor = ends.sensor[ray];
    if (ray + 1 < ends.sensor.size() && ends.sensor[ray + 1] == sensor) continue;
    one.end_sensor([&](std::uint32_t place, const std::vector<double>& square) {
      if (std::all_of(square.begin(), square.end(), [](double x) { return x == 0; })) return;
      pairs_.push_back({sensor, place});
      squares_.insert(squares_.end(), square.begin(), square.end());
    });
  }
}

std::vector<std::uint32_t> SeenPlaces::rays_for(std::span<const double> irradiance, std::uint32_t rays,
                                                std::uint32_t most) const {
  std::vector<double> weight(irradiance.size(), 0);
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    for (std::uint32_t b = 0; b < bands_; ++b)
      weight[pairs_[i].place] += double(squares_[i * bands_ + b]) / bands_;
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

std::vector<double> SeenPlaces::error_square(std::span<const double> error, std::size_t sensors) const {
  std::vector<double> result(sensors * bands_, 0);
  for (std::size_t i = 0; i < pairs_.size(); ++i)
    for (std::uint32_t b = 0; b < bands_; ++b) {
      const double e = error[std::size_t(pairs_[i].place) * bands_ + b];
      result[std::size_t(pairs_[i].sensor) * bands_ + b] += double(squares_[i * bands_ + b]) * e * e;
    }
  return result;
}

}  // namespace clrad

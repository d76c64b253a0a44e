#include "output/tone.hpp"

#include <algorithm>
#include <cmath>

namespace clrad {

double luminance(const float* bands, unsigned count) {
  if (count == 3) return 0.2126 * bands[0] + 0.7152 * bands[1] + 0.0722 * bands[2];
  double sum = 0;
  for (unsigned b = 0; b < count; ++b) sum += bands[b];
  return count ? sum / count : 0;
}

double automatic_exposure(std::vector<double> luminances) {
  constexpr double percentile = 0.9, becomes = 0.5;
  std::erase_if(luminances, [](double l) { return !(l > 0) || !std::isfinite(l); });
  if (luminances.empty()) return 1;
  const auto nth = luminances.begin() + std::ptrdiff_t(percentile * double(luminances.size() - 1));
  std::nth_element(luminances.begin(), nth, luminances.end());
  return becomes / *nth;
}

double shoulder(double x) {
  constexpr double knee = 0.6;
  return x <= knee ? x : 1 - (1 - knee) * std::exp(-(x - knee) / (1 - knee));
}

void expose(std::span<double> colour, double exposure, bool with_shoulder) {
  double largest = 0;
  for (double& c : colour) {
    c = c > 0 ? c * exposure : 0;
    largest = std::max(largest, c);
  }
  for (double& c : colour) {
    if (with_shoulder && largest > 0) c *= shoulder(largest) / largest;
    c = std::min(c, 1.0);
  }
}

double srgb_encoded(double linear) {
  return linear <= 0.0031308 ? 12.92 * linear : 1.055 * std::pow(linear, 1 / 2.4) - 0.055;
}

}  // namespace clrad

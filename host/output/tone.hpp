// From linear radiance to what a screen shows: one rule for pictures and for vertex colours.
#pragma once
#include <cstddef>
#include <span>
#include <vector>

namespace clrad {

/// Rec.709 luminance of three bands [as the bands]; otherwise the mean of the bands.
double luminance(const float* bands, unsigned count);

/// The factor of the automatic exposure: the 90th percentile of the luminances above 0 becomes 0.5 (sRGB 188
/// of 255). 1 when there is none. Lights fill few pixels and lie above the percentile; they may end up white.
double automatic_exposure(std::vector<double> luminances);

/// Shoulder of the automatic exposure: x up to 0.6, from there 1 - 0.4 exp(-(x - 0.6) / 0.4): continuous with
/// its slope, rising, below 1. A colour is scaled by shoulder(m) / m of its largest band m, which keeps its
/// hue.
double shoulder(double x);

/// Scales one colour in place, by `exposure` and then by the shoulder of its largest band; without the
/// shoulder every band is cut at 1.
void expose(std::span<double> colour, double exposure, bool with_shoulder);

/// IEC 61966-2-1: linear [0, 1] to encoded [0, 1].
double srgb_encoded(double linear);

}  // namespace clrad

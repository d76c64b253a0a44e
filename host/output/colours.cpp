#include "output/colours.hpp"

#include "output/tone.hpp"

namespace clrad {

DisplayColours display_colours(const Solution& solution) {
  const std::size_t vertices = solution.vertex_count();
  DisplayColours display;
  display.radiosity = display_radiosity(solution);
  std::vector<float> bands(solution.bands);
  display.luminance.reserve(vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    for (std::uint32_t b = 0; b < solution.bands; ++b) bands[b] = float(display.radiosity[b * vertices + v]);
    display.luminance.push_back(luminance(bands.data(), solution.bands));
  }
  const double exposure = automatic_exposure(display.luminance);
  display.rgb.reserve(3 * vertices);
  for (std::size_t v = 0; v < vertices; ++v) {
    double colour[3];
    for (std::size_t c = 0; c < 3; ++c)
      colour[c] = solution.bands == 3 ? display.radiosity[c * vertices + v] : display.luminance[v];
    expose(colour, exposure, true);
    display.rgb.insert(display.rgb.end(), colour, colour + 3);
  }
  return display;
}

}  // namespace clrad

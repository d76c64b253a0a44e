// Diffuse reflectance textures: their means over elements, and textures on the device.
#pragma once
#include <span>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/mesh.hpp"
#include "clrad/scene.hpp"
#include "clrad/solution.hpp"

namespace clrad {

/// Means of the texture over each element, and from these over patches (of what nothing covers, by `covered`, a byte a vertex)
/// and around vertices. On polygons without a texture, the material's reflectance to the bit.
///
/// Of an element: the midpoint rule on the bilinear interpolant, two points a texel; an element of more than 16 texels along
/// a side takes them from the texture halved as often as needed, so that its rim is blurred by at most 1/16 of the side. The
/// mean of a constant is exact to rounding.
Reflectances average_textures(Device& device, const Scene& scene, const Mesh& mesh,
                              const std::vector<std::uint8_t>& covered);

/// What putting each patch's mean reflectance for the texture itself leaves out: the power that it reflects more or less
/// because bright texels get other light than dark ones. RMS over the area of |sum share (rho_e - rho) H_e| relative to the mean
/// irradiance: an estimate of the error of radiosity, and more than that of irradiance.
double texture_correlation(const Solution& solution);

/// As kernels/shared/texture.cl reads them; texels [texture][row][column][band].
struct DeviceTextures {
  Array<std::uint32_t> textures;
  Array<float> texels;
};
DeviceTextures textures_on_device(Device& device, std::span<const Texture* const> textures,
                                  std::uint32_t bands);

/// Half as many texels along each axis (rounded up, at least 1): each the mean of what it takes the place of, so that the mean
/// of all stays.
Texture halved(const Texture& texture, std::uint32_t bands);

}  // namespace clrad

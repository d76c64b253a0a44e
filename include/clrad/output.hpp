/// Files and pictures from a solution. Every file is written under a temporary name and then renamed.
#pragma once
#include <string>
#include <vector>

#include "clrad/device.hpp"
#include "clrad/solution.hpp"

namespace clrad {

/// Linear radiance per pixel, rows from the top, [pixel][band].
struct Image {
  unsigned width = 0, height = 0, bands = 0;
  std::vector<float> radiance;  ///< L = B / pi [W/(sr m^2) or nit]; 0 where nothing is seen
};

struct ImageOptions {
  unsigned width = 640, height = 640;
  unsigned samples_per_pixel = 16;  ///< stratified, averaged in linear light
  double exposure_stops = 0;        ///< added to the automatic exposure
  bool automatic_exposure =
      true;  ///< a fixed rule on the image's luminance percentiles; false: radiance 1 is white
};

/// A picture through the intersection kernels, radiosity interpolated bilinearly (Gouraud; section 1.5).
Image render(Device& device, const Solution& solution, const Camera& camera,
             const ImageOptions& options = {});

/// A camera that shows the scene when it has none of its own.
Camera default_camera(const Scene& scene);

/// PNG (8 bits, sRGB, exposed) or EXR (linear, half or float), by the ending of `path`. One-band images are
/// grey.
void write_image(const std::string& path, const Image& image, const ImageOptions& options = {});

/// glTF or GLB by the ending: positions, display vertex colours (COLOR_0) and the float radiosity as
/// attribute _RADIOSITY (VEC3 or SCALAR) and _IRRADIANCE, indexed triangles.
void write_gltf(const std::string& path, const Solution& solution);

/// The JSON report (schema in the README).
std::string report_json(const Solution& solution);
void write_report(const std::string& path, const Solution& solution);

/// Writes `bytes` to `path` by way of a temporary file in the same folder. Throws DeviceError naming the
/// path.
void write_file(const std::string& path, const std::string& bytes);

}  // namespace clrad

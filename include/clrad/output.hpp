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
  std::vector<float> radiance;          ///< L = B / pi [W/(sr m^2) or nit]; 0 where nothing is seen
  std::string unit;                     ///< of radiance, for the file's metadata
  std::vector<std::string> band_names;  ///< as Scene::bands; empty: numbered
};

struct ImageOptions {
  unsigned width = 640, height = 640;
  unsigned samples_per_pixel = 16;  ///< stratified, averaged in linear light
  unsigned depth = 8;               ///< mirrors and sides of glass that a ray is followed by; at most 64
  bool whitted = false;             ///< direct light only, found anew at every point; see render_whitted()
  unsigned light_samples = 64;      ///< of that, rays from a point to each light
  double exposure_stops = 0;        ///< added to the automatic exposure
  bool ambient = false;             ///< add the estimate of the light not yet shot (Solution::ambient)
  bool automatic_exposure =
      true;  ///< a fixed rule on the image's luminance percentiles; false: radiance 1 is white
};

/// A picture through the intersection kernels, radiosity interpolated (section 1.5; quadratic where it is smooth). Rays that
/// meet mirrors and glass are followed until they end on a diffuse surface, `depth` surfaces have been passed, or
/// what is left is below 1/4096 of the ray in every band; a scene without such polygons pays nothing for it.
Image render(Device& device, const Solution& solution, const Camera& camera,
             const ImageOptions& options = {});

/// The ray tracer that section 1.5 compares with: the same pass, but a diffuse point shows its own emission and what
/// it reflects of the light that comes straight from emitting polygons: exact form factor of each (clipped at the
/// point's horizon) times the share of `light_samples` rays to it that are free. Nothing is solved. Throws as
/// render().
Image render_whitted(Device& device, const Scene& scene, const Camera& camera,
                     const ImageOptions& options = {});

/// A camera that shows the scene when it has none of its own. From outside through an open side
/// (one on which polygons that turn their backs cover less than half): of -z, +z, -x, +x as viewing direction (y up)
/// the one that sees most area of fronts, ties in that order; straight down where that shows over four times
/// as much. Where every side is closed: from inside, near the corner from which the view of the middle is
/// free the farthest. Up is y, or z in an OBJ scene that is no longer along z
/// than along y and whose lamps shine down along z.
Camera default_camera(const Scene& scene);

/// PNG (8 bits, sRGB, exposed) or EXR (linear radiance in float, never exposed), by the ending of `path`.
/// One-band images are grey; a PNG of other than 1 or 3 bands is a UsageError, an EXR has a channel per band.
/// Automatic exposure: the 90th percentile of the luminances above 0 is shown as 0.5, and a shoulder keeps
/// brighter parts below white (host/output/tone.hpp).
void write_image(const std::string& path, const Image& image, const ImageOptions& options = {});

/// glTF or GLB by the ending: positions, display vertex colours (COLOR_0, exposed as in a PNG, linear) and,
/// in float, vertex_radiosity() and irradiance [W/m^2 or lm/m^2] as attributes _RADIOSITY and _IRRADIANCE
/// (VEC3 or SCALAR; other than 1 or 3 bands: _RADIOSITY_0, _RADIOSITY_1, ...). Vertices in the mesh's order,
/// triangles per material, unlit. Positions are relative to the frame's centre, which is the node's
/// translation.
void write_gltf(const std::string& path, const Solution& solution);

/// VTK XML unstructured grid (.vtu; binary, appended), as ParaView and VTK read it: points in metres, a cell per element,
/// as a polygon where a finer neighbour's vertex lies on its edge, so that there is no crack. Point data: radiosity and
/// irradiance as solved [W/m^2 or lm/m^2] and covered; luminance, the active scalar, and display_colour (sRGB) as a
/// picture shows them [cd/m^2 or W/(sr m^2)]. Cell data: polygon, patch, material, level, area_m2 and mean_radiosity.
/// Field data: quantity, units and bands.
void write_vtu(const std::string& path, const Solution& solution);

/// The whole solution as a file that load_solution() reads back to the bit; the ending is .clrad.
void write_solution(const std::string& path, const Solution& solution);
/// Throws InputError "path: ..." with the reason: not a file of clrad's, another kind, another version of the format, cut
/// short, damaged.
Solution load_solution(const std::string& path);

/// The JSON report (schema in the README).
std::string report_json(const Solution& solution);
void write_report(const std::string& path, const Solution& solution);

/// Writes `bytes` to `path` by way of a temporary file in the same folder. Throws DeviceError naming the
/// path.
void write_file(const std::string& path, const std::string& bytes);

}  // namespace clrad

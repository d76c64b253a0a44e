/// The scene as the user gave it: polygons, materials, cameras, in double precision and SI units. Nothing
/// here knows about the device.
#pragma once
#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <string>
#include <vector>

namespace clrad {

/// Where something stands in the input, for messages: `file:line`, or `file: node "x", primitive 2`.
struct SourceLocation {
  std::string file;
  std::uint32_t line = 0;  ///< 1-based; 0 where the format has no lines
  std::string item;        ///< "node \"Box\", primitive 0" where it has none

  std::string text() const;
};

/// How a texture goes on past its edges.
enum class Wrap { repeat, mirror, clamp };

/// A picture on surfaces. At coordinates (u, v) its value is interpolated bilinearly between the middles of the four
/// texels around (u width, v height); (0, 0) is the corner of its first texel, and v runs with the rows.
struct Texture {
  std::string name;  ///< its file, or where it is embedded
  std::uint32_t width = 0, height = 0;
  std::array<Wrap, 2> wrap{};  ///< along u and v
  std::vector<float> texels;   ///< [row][column][band], linear (sRGB decoded), dimensionless, in [0, 1)
};
constexpr std::uint32_t no_texture = 0xffffffffu;

/// What a surface does with light, per band. Sizes: bands of the scene; `specular` and `transmission` may be
/// empty where there is none. In a solve the diffuse part shoots and receives, and glass in the way of light
/// passes its share straight on; when a picture is drawn, mirrors and glass are followed. Glass reflects by
/// Fresnel's equations what is neither diffuse nor mirrored, and passes `transmission` of the rest at each
/// surface: a closed surface all of glass is a solid that refracts (fronts face the air), any other polygon of
/// glass a thin sheet.
struct Material {
  std::string name;
  /// rho, dimensionless, in [0, 1); with a texture what that is multiplied by, in [0, 1], and the product is in [0, 1).
  std::vector<double> reflectance;
  std::vector<double> emitted_exitance;  ///< E = pi x the file's radiance [W/m^2 or lm/m^2], >= 0
  SourceLocation where;
  std::vector<double> specular{};      ///< share reflected as by a mirror; rho + specular + transmission <= 1
  std::vector<double> transmission{};  ///< share that passes; above 0 in a band: glass
  double ior = 1.5;                    ///< index of refraction of glass, >= 1
  /// Polygons reflect and emit on both sides: with_backs() gives them a back. Glass does without: rays pass it from both
  /// sides, and only its front reflects diffusely.
  bool two_sided = false;
  std::uint32_t texture = no_texture;  ///< of the diffuse reflectance: index into Scene::textures

  bool is_glass() const;   ///< some band is transmitted
  bool is_mirror() const;  ///< some band is mirrored, and it is not glass
};

/// A planar convex polygon of 3 or 4 corners, counter-clockwise seen from its front; it reflects and emits on
/// that side only, and occludes from both. A two-sided surface is two polygons back to back.
struct Polygon {
  std::array<glm::dvec3, 4> corner{};  ///< [m]; the last is unused in a triangle
  std::uint32_t corners = 0;           ///< 3 or 4
  std::uint32_t material = 0;          ///< index into Scene::materials
  std::string name;                    ///< object or group name of the file; may repeat
  SourceLocation where;
  /// This is the back of the polygon before it in Scene::polygons: the same corners the other way round. It lies in the
  /// same plane and occludes nothing that its front does not.
  bool back = false;
  std::array<glm::dvec2, 4> uv{};  ///< texture coordinates of the corners, where the material has a texture

  double area_m2() const;
  glm::dvec3 normal() const;  ///< unit length, by the right-hand rule
};

/// A light without extent, after glTF's KHR_lights_punctual. It casts sharp shadows, and the eye does not see it.
struct PunctualLight {
  enum class Kind { point, spot, directional };
  std::string name;
  Kind kind = Kind::point;
  glm::dvec3 position_m{0, 0, 0};  ///< [m]; of no meaning for a directional light
  glm::dvec3 direction{0, 0,
                       -1};  ///< the way its light travels, unit length; of no meaning for a point light
  /// Per band: luminous intensity [cd = lm/sr; W/sr in a radiometric scene], of a spot within its inner cone; of a directional
  /// light the irradiance of a surface that faces it [lm/m^2 or W/m^2].
  std::vector<double> intensity;
  /// Of a spot, angles from its axis: full intensity up to the inner one, none from the outer one on, and in between
  /// ((cos a - cos outer) / (cos inner - cos outer))^2 of it. 0 <= inner <= outer <= pi/2; a sharp edge where they are equal.
  double inner_cone_rad = 0, outer_cone_rad = 0.78539816339744831;
  SourceLocation where;

  /// Of one candela: 4 pi of a point light, of a spot the integral over its cone [sr]. 0 of a directional light, whose power
  /// depends on what it falls on.
  double solid_angle_sr() const;
};

struct Camera {
  std::string name;
  glm::dvec3 eye{0, 0, 0};      ///< [m]
  glm::dvec3 target{0, 0, -1};  ///< [m], what the middle of the picture shows
  glm::dvec3 up{0, 1, 0};
  double vertical_field_of_view_rad = 0.7;
};

/// Radiometric scenes count watts, photometric ones lumens; a scene is one of the two, never both.
enum class Quantity { radiometric, photometric };

/// One finding of the reader or of `check`: an error stops a solve, a repair was made by the printed rule, a
/// warning is for the user to judge.
struct Diagnostic {
  enum class Severity { warning, repair, error };
  Severity severity = Severity::warning;
  std::string rule;  ///< short stable name, e.g. "degenerate-face"
  SourceLocation where;
  std::string message;
};

struct Scene {
  std::string file;
  Quantity quantity = Quantity::radiometric;
  std::vector<std::string> bands;  ///< {"grey"}, {"red","green","blue"} (linear Rec.709) or N names
  std::vector<Material> materials;
  std::vector<Polygon> polygons;  ///< file order
  std::vector<Camera> cameras;
  std::vector<Diagnostic> diagnostics;  ///< repairs and warnings met while reading
  std::vector<PunctualLight>
      lights;                     ///< in the quantity's unit; glTF has them in candela and lux, OBJ has none
  std::vector<Texture> textures;  ///< those that materials name
};

/// Which materials are two-sided.
enum class Sides {
  as_file,  ///< those that the file says are (glTF's doubleSided; OBJ has no such word)
  two,      ///< all
  one,      ///< none
};

struct LoadOptions {
  double unit_m = 1.0;  ///< length of one unit of the file [m]
  Sides sides = Sides::as_file;
};

/// Reads an OBJ (with MTL), glTF or GLB file, by the ending of its name, validates it and repairs by printed
/// rules (Scene::diagnostics). Throws InputError with file and line (or node and primitive) when it cannot be
/// used.
Scene load_scene(const std::string& path, const LoadOptions& options = {});

/// All that `clrad check` reports about a file: nothing thrown for bad content, each finding listed, file
/// order. Degenerate, non-planar and duplicate faces, open edges, orientation, reflectance and emission out
/// of range.
std::vector<Diagnostic> check_scene(const std::string& path, const LoadOptions& options = {});

/// The scene with a back right behind each polygon that has two sides: named as its front with " (back)" added, the first
/// corner the same. No back is added where there is one, so doing it twice changes nothing, and none where it can be
/// proven that no light comes: inside a closed convex solid that nothing else reaches into.
Scene with_backs(Scene scene);

/// True when some polygon is a mirror or glass.
bool has_specular(const Scene& scene);

/// True when some polygon's reflectance is a texture's.
bool has_textures(const Scene& scene);

/// True when the polygons form watertight surfaces that all face inward or outward consistently: every edge
/// is shared by exactly two polygons, in opposite directions. T-junctions make it false. Backs do not count.
bool is_watertight(const Scene& scene);

}  // namespace clrad

/// What a reader hands to validation: faces as the file has them, materials in physical units, findings so
/// far.
#pragma once
#include <clrad/scene.hpp>
#include <cstdint>
#include <string>
#include <vector>

namespace clrad {

/// A face of any number of corners.
struct RawFace {
  std::uint32_t first = 0;     ///< of its corners in RawScene::corners
  std::uint32_t corners = 0;   ///< how many
  std::uint32_t material = 0;  ///< index into RawScene::materials
  std::string name;
  SourceLocation where;
  bool has_uv = false;  ///< RawScene::uv says where its corners are in the material's texture
};

struct RawScene {
  std::string file;
  Quantity quantity = Quantity::radiometric;
  std::vector<Material> materials;  ///< three bands: red, green, blue
  std::vector<Camera> cameras;      ///< in file units
  std::vector<glm::dvec3> corners;  ///< in file units
  std::vector<RawFace> faces;       ///< file order
  std::vector<Texture> textures;    ///< three bands; those that materials name
  /// Texture coordinates, as many as corners in a scene with textures, else none.
  std::vector<glm::dvec2> uv;
  std::vector<Diagnostic> diagnostics;
  std::vector<PunctualLight> lights;  ///< three bands; positions in file units

  void add(Diagnostic::Severity severity, std::string rule, SourceLocation where, std::string message) {
    diagnostics.push_back({severity, std::move(rule), std::move(where), std::move(message)});
  }
};

/// Reflectance of a face whose file names no material; the reader warns.
inline constexpr double kDefaultReflectance = 0.5;

}  // namespace clrad

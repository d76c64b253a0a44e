#include "scene/validate.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <clrad/error.hpp>
#include <cmath>
#include <glm/geometric.hpp>
#include <limits>
#include <optional>
#include <span>
#include <tuple>
#include <unordered_map>

#include "scene/faces.hpp"
#include "scene/texture.hpp"
#include "scene/topology.hpp"

namespace clrad {
namespace {

using Severity = Diagnostic::Severity;

constexpr double kLargestCoordinate_m = 1e100;  // squares and products of three of them stay finite
constexpr std::array<const char*, 3> kBand = {"red", "green", "blue"};

void check_materials(const Scene& scene, std::vector<Diagnostic>& findings) {
  for (const Material& material : scene.materials) {
    for (std::size_t b = 0; b < material.reflectance.size(); ++b) {
      const double rho = material.reflectance[b];
      if (rho >= 0 && (rho < 1 || (rho == 1 && material.texture != no_texture))) continue;
      findings.push_back({Severity::error, "reflectance", material.where,
                          fmt::format("material \"{}\" reflects {} of {} light; a reflectance lies in [0, 1)",
                                      material.name, rho, kBand[b])});
      break;
    }
    for (std::size_t b = 0; b < material.emitted_exitance.size(); ++b) {
      const double exitance = material.emitted_exitance[b];
      if (exitance >= 0 && std::isfinite(exitance)) continue;
      findings.push_back(
          {Severity::error, "emission", material.where,
           fmt::format("material \"{}\" emits {} in {}; an emission is finite and not negative",
                       material.name, exitance, kBand[b])});
      break;
    }
  }
}

double share(const std::vector<double>& values, std::size_t band) {
  return band < values.size() ? values[band] : 0;
}

// Shares of mirrors and glass, after check_materials: finite, not negative, and with the diffuse one no more
// than 1.
void repair_specular(Material& material, std::vector<Diagnostic>& findings) {
  const auto add = [&](Severity severity, const char* rule, std::string message) {
    findings.push_back({severity, rule, material.where,
                        fmt::format("material \"{}\" {}", material.name, std::move(message))});
  };
  const auto bad = [](double v) { return !(v >= 0 && std::isfinite(v)); };
  for (const auto* values : {&material.specular, &material.transmission}) {
    const auto found = std::find_if(values->begin(), values->end(), bad);
    if (found == values->end()) continue;
    return add(Severity::error, "specular",
               fmt::format("{} {} of {} light; a share is a number from 0 to 1",
                           values == &material.specular ? "mirrors" : "transmits", *found,
                           kBand[std::size_t(found - values->begin())]));
  }
  bool scaled = false;
  for (std::size_t b = 0; b < material.reflectance.size(); ++b) {
    const double sum = share(material.specular, b) + share(material.transmission, b);
    const double room = 1 - material.reflectance[b];
    // Shares that sum to 1 in decimals may pass it by an ulp.
    constexpr double kRounding = 4 * std::numeric_limits<double>::epsilon();
    if (!(room >= 0) || sum <= room) continue;
    scaled = scaled || sum > room + kRounding;
    if (b < material.specular.size()) material.specular[b] *= room / sum;
    if (b < material.transmission.size()) material.transmission[b] *= room / sum;
  }
  if (scaled)
    add(Severity::repair, "specular-share",
        "reflects and transmits more light than arrives; the mirrored and transmitted shares are scaled down "
        "to what the diffuse one leaves");
  if (material.is_glass() && !(material.ior >= 1 && std::isfinite(material.ior))) {
    constexpr double kIor = 1.5;
    add(Severity::repair, "ior",
        fmt::format("has index of refraction {}, which is not a number from 1 up; {} is used", material.ior,
                    kIor));
    material.ior = kIor;
  }
}

// One band is enough where no material and no light tells the three apart.
void choose_bands(Scene& scene) {
  const auto grey = [](const std::vector<double>& v) { return v.empty() || (v[0] == v[1] && v[1] == v[2]); };
  const bool all_grey = std::all_of(scene.materials.begin(), scene.materials.end(), [&](const Material& m) {
    return grey(m.reflectance) && grey(m.emitted_exitance) && grey(m.specular) && grey(m.transmission);
  });
  const bool all_lights_grey = std::all_of(scene.lights.begin(), scene.lights.end(),
                                           [&](const PunctualLight& l) { return grey(l.intensity); });
  const bool grey_textures = std::all_of(scene.textures.begin(), scene.textures.end(), [](const Texture& t) {
    for (std::size_t i = 0; i < t.texels.size(); i += 3)
      if (t.texels[i] != t.texels[i + 1] || t.texels[i] != t.texels[i + 2]) return false;
    return true;
  });
  scene.bands = {"red", "green", "blue"};
  if (!all_grey || !all_lights_grey || !grey_textures) return;
  scene.bands = {"grey"};
  for (PunctualLight& light : scene.lights) light.intensity.resize(1);
  for (Texture& t : scene.textures) {
    for (std::size_t i = 0; 3 * i < t.texels.size(); ++i) t.texels[i] = t.texels[3 * i];
    t.texels.resize(t.texels.size() / 3);
    t.texels.shrink_to_fit();
  }
  for (Material& material : scene.materials) {
    material.reflectance.resize(1);
    material.emitted_exitance.resize(1);
    if (!material.specular.empty()) material.specular.resize(1);
    if (!material.transmission.empty()) material.transmission.resize(1);
  }
}

struct Report {
  Severity severity;
  const char* rule;
  std::string message;
};

Report report_of(FaceRule rule, const RawFace& face, const CutFace& cut) {
  switch (rule) {
    case FaceRule::repeated_corner:
      return {Severity::repair, "repeated-corner", "a corner is repeated; it is left out"};
    case FaceRule::degenerate:
      return {Severity::repair, "degenerate-face", "all corners lie on one line; the face is dropped"};
    case FaceRule::non_planar:
      return {
          Severity::repair, "non-planar",
          fmt::format(
              "the quad is out of plane by {:.2g} of its longer diagonal (allowed {:.0e}); it is cut into "
              "two triangles",
              cut.non_planarity, kPlanarTolerance)};
    case FaceRule::concave:
      return {Severity::repair, "concave", "the quad has a reflex corner; it is cut into two triangles"};
    case FaceRule::straight_corner:
      return {Severity::repair, "straight-corner",
              "the quad has a corner of 180 degrees; it is cut into two triangles"};
    case FaceRule::many_corners:
      return {Severity::repair, "many-corners",
              fmt::format("the face has {} corners; it is cut into {} triangles", face.corners,
                          cut.pieces.size())};
    case FaceRule::self_intersecting:
      return {Severity::error, "self-intersecting",
              "the sides of the face cross each other; list its corners in order around it"};
    case FaceRule::as_it_is:
      break;
  }
  return {Severity::repair, "", ""};
}

// The first coordinate of the face that cannot be used, in words.
std::optional<std::string> bad_coordinate(std::span<const glm::dvec3> corners) {
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (int k = 0; k < 3; ++k) {
      if (std::abs(corners[i][k]) <= kLargestCoordinate_m) continue;
      return fmt::format("coordinate {} of corner {} is {}; coordinates are finite and at most {:.0e} m",
                         "xyz"[k], i + 1, corners[i][k], kLargestCoordinate_m);
    }
  }
  return std::nullopt;
}

void add_face(const RawFace& face, std::span<const glm::dvec3> corners, std::span<const glm::dvec2> uv,
              Scene& scene) {
  const auto report = [&](Severity severity, const char* rule, std::string message) {
    scene.diagnostics.push_back({severity, rule, face.where, std::move(message)});
  };
  if (corners.size() < 3) {
    return report(
        Severity::error, "too-few-corners",
        fmt::format("a face needs three corners, this one has {}; complete or remove it", corners.size()));
  }
  if (const auto bad = bad_coordinate(corners)) return report(Severity::error, "coordinate", *bad);
  for (std::size_t i = 0; i < uv.size(); ++i)
    if (!std::isfinite(uv[i].x) || !std::isfinite(uv[i].y))
      return report(Severity::error, "texture-coordinate",
                    fmt::format("the texture coordinates of corner {} are ({}, {}); they are finite numbers",
                                i + 1, uv[i].x, uv[i].y));

  const CutFace cut = cut_face(corners);
  for (const FaceRule rule : cut.rules) {
    Report r = report_of(rule, face, cut);
    report(r.severity, r.rule, std::move(r.message));
  }
  for (const FacePiece& piece : cut.pieces) {
    Polygon polygon;
    polygon.corners = piece.corners;
    for (std::uint32_t i = 0; i < piece.corners; ++i) polygon.corner[i] = corners[piece.corner[i]];
    for (std::uint32_t i = 0; i < piece.corners && !uv.empty(); ++i) polygon.uv[i] = uv[piece.corner[i]];
    polygon.material = face.material;
    polygon.name = face.name;
    polygon.where = face.where;
    scene.polygons.push_back(std::move(polygon));
  }
}

// The corners in an order that does not depend on where the loop starts, but does on which way it runs.
std::array<double, 12> loop_key(const Polygon& polygon) {
  std::uint32_t first = 0;
  const auto less = [](const glm::dvec3& a, const glm::dvec3& b) {
    return std::tie(a.x, a.y, a.z) < std::tie(b.x, b.y, b.z);
  };
  for (std::uint32_t i = 1; i < polygon.corners; ++i) {
    if (less(polygon.corner[i], polygon.corner[first])) first = i;
  }
  std::array<double, 12> key{};
  for (std::uint32_t i = 0; i < 4; ++i) {
    // A triangle is padded with its first corner, which no quad has twice.
    const glm::dvec3& c = polygon.corner[i < polygon.corners ? (first + i) % polygon.corners : first];
    for (int k = 0; k < 3; ++k) key[3 * i + k] = c[k];
  }
  return key;
}

void check_duplicates(Scene& scene) {
  const auto hash = [](const std::array<double, 12>& key) {
    std::uint64_t h = 0;
    for (const double x : key) {
      h = (h ^ std::bit_cast<std::uint64_t>(x)) * 0x9fb21c651e98df25ull;
      h ^= h >> 32;
    }
    return static_cast<std::size_t>(h);
  };
  std::unordered_map<std::array<double, 12>, std::size_t, decltype(hash)> seen(scene.polygons.size(), hash);
  for (std::size_t p = 0; p < scene.polygons.size(); ++p) {
    const auto [earlier, is_new] = seen.emplace(loop_key(scene.polygons[p]), p);
    if (is_new) continue;
    const Polygon& first = scene.polygons[earlier->second];
    scene.diagnostics.push_back({Severity::warning, "duplicate-face", scene.polygons[p].where,
                                 fmt::format("the same corners as \"{}\" at {}; the later one lies on top",
                                             first.name, first.where.text())});
  }
}

void check_emitters(Scene& scene) {
  const bool any = std::any_of(scene.polygons.begin(), scene.polygons.end(), [&](const Polygon& polygon) {
    const auto& exitance = scene.materials[polygon.material].emitted_exitance;
    return std::any_of(exitance.begin(), exitance.end(), [](double e) { return e > 0; });
  });
  const bool any_light = std::any_of(scene.lights.begin(), scene.lights.end(), [](const PunctualLight& l) {
    return std::any_of(l.intensity.begin(), l.intensity.end(), [](double i) { return i > 0; });
  });
  if (any || any_light || scene.polygons.empty()) return;
  scene.diagnostics.push_back({Severity::warning,
                               "no-emitter",
                               {scene.file, 0, ""},
                               "no polygon emits light and there is no other light: the scene is black; give "
                               "a material an emission"});
}

// Lengths are scaled; candela and lux are what they are whatever the unit of length.
void place_lights(Scene& scene, double unit_m) {
  for (PunctualLight& light : scene.lights) {
    light.position_m = light.position_m * unit_m + 0.0;  // + 0: no negative zero
    const bool anywhere = light.kind == PunctualLight::Kind::directional;
    for (int k = 0; k < 3 && !anywhere; ++k)
      if (!(std::abs(light.position_m[k]) <= kLargestCoordinate_m)) {
        scene.diagnostics.push_back(
            {Severity::error, "coordinate", light.where,
             fmt::format("coordinate {} of its light is {}; coordinates are finite and at most {:.0e} m",
                         "xyz"[k], light.position_m[k], kLargestCoordinate_m)});
        break;
      }
  }
}

}  // namespace

void sort_findings(Scene& scene) {
  const auto position = [&](const Diagnostic& d) {
    const bool whole_file = d.where.line == 0 && d.where.item.empty();
    return std::pair(whole_file, d.where.file == scene.file ? d.where.line : 0u);
  };
  std::stable_sort(scene.diagnostics.begin(), scene.diagnostics.end(),
                   [&](const Diagnostic& a, const Diagnostic& b) { return position(a) < position(b); });
}

Scene validate(RawScene raw, double unit_m) {
  if (!(unit_m > 0) || !std::isfinite(unit_m)) {
    throw UsageError(fmt::format("the unit of length is {} m; it is a finite positive number", unit_m));
  }
  settle_textures(raw);
  Scene scene;
  scene.textures = std::move(raw.textures);
  scene.file = std::move(raw.file);
  scene.quantity = raw.quantity;
  scene.materials = std::move(raw.materials);
  scene.cameras = std::move(raw.cameras);
  scene.diagnostics = std::move(raw.diagnostics);
  scene.lights = std::move(raw.lights);
  check_materials(scene, scene.diagnostics);
  for (Material& material : scene.materials) repair_specular(material, scene.diagnostics);
  choose_bands(scene);
  for (Camera& camera : scene.cameras) {
    camera.eye *= unit_m;
    camera.target *= unit_m;
  }
  place_lights(scene, unit_m);
  for (glm::dvec3& corner : raw.corners) corner = corner * unit_m + 0.0;  // + 0: no negative zero
  scene.polygons.reserve(raw.faces.size());
  for (const RawFace& face : raw.faces) {
    const bool textured = scene.materials[face.material].texture != no_texture;
    add_face(face, std::span(raw.corners).subspan(face.first, face.corners),
             textured ? std::span<const glm::dvec2>(raw.uv).subspan(face.first, face.corners)
                      : std::span<const glm::dvec2>(),
             scene);
  }
  check_duplicates(scene);
  check_orientation(scene, scene.diagnostics);
  check_emitters(scene);
  const bool failed = std::any_of(scene.diagnostics.begin(), scene.diagnostics.end(),
                                  [](const Diagnostic& d) { return d.severity == Severity::error; });
  if (scene.polygons.empty() && !failed) {
    const auto dropped = std::find_if(scene.diagnostics.begin(), scene.diagnostics.end(),
                                      [](const Diagnostic& d) { return d.rule == "degenerate-face"; });
    if (dropped == scene.diagnostics.end()) {
      scene.diagnostics.push_back({Severity::error,
                                   "no-polygons",
                                   {scene.file, 0, ""},
                                   "there is no polygon to light; the file needs at least one face"});
    } else {
      scene.diagnostics.push_back(
          {Severity::error, "no-polygons", dropped->where,
           "there is no polygon to light: all corners of this face, and of any other, "
           "lie on one line; the file needs at least one face with an area"});
    }
  }
  sort_findings(scene);
  return scene;
}

}  // namespace clrad

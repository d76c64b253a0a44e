// What the tests of mirrors and glass share: materials, bodies of glass, and how far off a followed ray may be.
#pragma once
#include <numbers>

#include "render/support.hpp"

namespace clrad::test {

inline constexpr double pi = std::numbers::pi;

inline Material mirror(unsigned bands, double specular) {
  Material m = material(bands, 0);
  m.specular.assign(bands, specular);
  return m;
}

inline Material glass(unsigned bands, double transmission, double ior) {
  Material m = material(bands, 0);
  m.transmission.assign(bands, transmission);
  m.ior = ior;
  return m;
}

// Six sides facing outward, corners shared to the last bit.
inline std::vector<Polygon> box(const glm::dvec3& a, const glm::dvec3& b, std::uint32_t material) {
  const auto c = [&](int i, int j, int k) { return glm::dvec3(i ? b.x : a.x, j ? b.y : a.y, k ? b.z : a.z); };
  return {polygon({c(0, 0, 0), c(0, 1, 0), c(1, 1, 0), c(1, 0, 0)}, material),
          polygon({c(0, 0, 1), c(1, 0, 1), c(1, 1, 1), c(0, 1, 1)}, material),
          polygon({c(0, 0, 0), c(1, 0, 0), c(1, 0, 1), c(0, 0, 1)}, material),
          polygon({c(0, 1, 0), c(0, 1, 1), c(1, 1, 1), c(1, 1, 0)}, material),
          polygon({c(0, 0, 0), c(0, 0, 1), c(0, 1, 1), c(0, 1, 0)}, material),
          polygon({c(1, 0, 0), c(1, 1, 0), c(1, 1, 1), c(1, 0, 1)}, material)};
}

// Fresnel's reflected share of unpolarised light from index n1 to n2, from the angles (Born & Wolf 1.5).
inline double fresnel(double n1, double n2, double angle) {
  const double sine = n1 / n2 * std::sin(angle);
  if (sine >= 1) return 1;
  const double t = std::asin(sine);
  if (angle == 0) return std::pow((n1 - n2) / (n1 + n2), 2);
  const double s = std::sin(angle - t) / std::sin(angle + t), p = std::tan(angle - t) / std::tan(angle + t);
  return 0.5 * (s * s + p * p);
}

// How far off the point may be where a ray ends that met one surface before, in frame units. Where a camera ray meets a
// plane: 2^-17 (shade_test.cpp). It starts again from there; its new direction, unit vectors after some 32 roundings
// of numbers up to 1, is off by 2^-19, which over a path of at most 4 units is 2^-17; where it meets the last
// plane, at a cosine above 0.5, that doubles, and another meeting costs 2^-17 again.
inline const double once_bent = 5 * std::ldexp(1, -17);
// Each surface more doubles nothing where it is met at such angles again, but adds the same direction error and a meeting.
inline double bent(int surfaces) {
  return once_bent + (surfaces - 1) * 4 * std::ldexp(1, -17);
}

// Radiance of the field rho B / pi with values up to `largest`, through some 16 more roundings of throughputs.
inline double rounding(double largest) {
  return 0.5 * largest / pi * 24 * std::ldexp(1, -24);
}

// A patch in z = 0, larger than is seen, with a field of its own; before it what `more` holds.
struct Behind {
  Scene scene;
  Solution solution;
  static double field(const glm::dvec3& x) { return 20 + 5 * x.x - 4 * x.y; }
  Behind(const std::vector<Polygon>& more, const Material& material, unsigned bands = 1) {
    std::vector<Polygon> polygons = more;
    for (Polygon& p : polygons) p.material = 1;
    polygons.push_back(polygon({{-2, -2, 0}, {2, -2, 0}, {2, 2, 0}, {-2, 2, 0}}));
    scene = test::scene(polygons, bands);
    scene.materials.push_back(material);
    const auto patch = std::uint32_t(polygons.size() - 1);
    solution = test::solution(scene, 0.5, [patch](std::uint32_t p, std::uint32_t, const glm::dvec3& x) {
      return p == patch ? field(x) : 0;
    });
  }
};

inline Camera oblique() {
  Camera camera;
  camera.eye = {0.2, 0.9, 1.9}, camera.target = {0, 0, 0.5}, camera.vertical_field_of_view_rad = 0.25;
  return camera;
}

}  // namespace clrad::test

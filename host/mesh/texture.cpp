#include "mesh/texture.hpp"

#include <algorithm>
#include <cmath>
#include <glm/geometric.hpp>
#include <glm/vec2.hpp>
#include <map>
#include <memory>

#include "mesh/average.hpp"
#include "mesh/lattice.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t most_points = 32;   // along a side of an element
constexpr double points_a_texel = 2;        // beyond which the midpoint rule gains nothing that shows
constexpr std::uint32_t texture_uints = 6;  // CLRAD_TEXTURE_UINTS

// Texture coordinates at a vertex of a polygon's lattice.
glm::dvec2 uv_at(const Polygon& polygon, const PolygonMesh& mesh,
                 const std::array<std::uint32_t, 2>& lattice) {
  const double u = lattice[0] / (double(mesh.patches_u) * lattice_unit(0)),
               v = lattice[1] / (double(mesh.patches_v) * lattice_unit(0));
  const auto& c = polygon.uv;
  if (polygon.corners == 3) return c[0] + u * (c[1] - c[0]) + v * (c[2] - c[0]);
  return (1 - u) * (1 - v) * c[0] + u * (1 - v) * c[1] + u * v * c[2] + (1 - u) * v * c[3];
}

// A texture and its halves, made as they are asked for.
class Pyramid {
 public:
  Pyramid(const Texture& texture, std::uint32_t bands) : bands_(bands) { levels_.push_back(&texture); }
  std::size_t levels() const { return levels_.size(); }
  const Texture& at(std::size_t level) {
    while (level >= levels_.size()) {
      halves_.push_back(std::make_unique<Texture>(halved(*levels_.back(), bands_)));
      levels_.push_back(halves_.back().get());
    }
    return *levels_[level];
  }

 private:
  std::uint32_t bands_;
  std::vector<std::unique_ptr<Texture>> halves_;
  std::vector<const Texture*> levels_;
};

// What average_texture() of kernels/mesh/texture.cl takes.
struct TexturedElements {
  std::vector<std::uint32_t> element, points, texture;
  std::vector<double> uv, jacobian;
};

class ElementList {
 public:
  ElementList(const Scene& scene, const Mesh& mesh, std::uint32_t bands)
      : scene_(scene), mesh_(mesh), bands_(bands) {
    for (std::uint32_t p = 0; p < scene.polygons.size(); ++p) {
      const std::uint32_t texture = scene.materials[scene.polygons[p].material].texture;
      if (texture == no_texture) continue;
      const PolygonMesh& m = mesh.polygons[p];
      for (std::uint32_t k = 0; k < m.patches; ++k) {
        const Patch& patch = mesh.patches[m.first_patch + k];
        for (std::uint32_t e = 0; e < patch.elements; ++e) add(p, texture, patch.first_element + e);
      }
    }
  }
  TexturedElements list;
  std::vector<const Texture*> textures;  // what list.texture numbers

 private:
  void add(std::uint32_t p, std::uint32_t texture, std::uint32_t index) {
    const Element& e = mesh_.elements[index];
    const std::uint32_t corners = e.vertex[3] == 0xffffffffu ? 3 : 4;
    glm::dvec2 uv[4] = {};
    double area[4] = {}, largest = 0;
    for (std::uint32_t k = 0; k < corners; ++k)
      uv[k] = uv_at(scene_.polygons[p], mesh_.polygons[p], mesh_.lattice[e.vertex[k]]);
    for (std::uint32_t k = 0; k < corners && corners == 4; ++k) {
      const glm::dvec3& at = mesh_.position_m[e.vertex[k]];
      area[k] = glm::length(glm::cross(mesh_.position_m[e.vertex[(k + 1) % 4]] - at,
                                       mesh_.position_m[e.vertex[(k + 3) % 4]] - at));
      largest = std::max(largest, area[k]);
    }
    glm::dvec2 longest(0);
    for (std::uint32_t k = 0; k < corners; ++k)
      longest = glm::max(longest, glm::abs(uv[(k + 1) % corners] - uv[k]));
    Pyramid& pyramid = pyramids_.try_emplace(texture, scene_.textures[texture], bands_).first->second;
    std::size_t level = 0;
    double texels = 0;
    for (;; ++level) {
      const Texture& t = pyramid.at(level);
      texels = std::max(longest.x * t.width, longest.y * t.height);
      if (points_a_texel * texels <= most_points || (t.width == 1 && t.height == 1)) break;
    }
    const auto [number, is_new] = numbers_.try_emplace({texture, level}, std::uint32_t(textures.size()));
    if (is_new) textures.push_back(&pyramid.at(level));
    list.element.push_back(index);
    list.texture.push_back(number->second);
    list.points.push_back(
        std::uint32_t(std::clamp(std::ceil(points_a_texel * texels), 2.0, double(most_points))));
    for (std::uint32_t k = 0; k < 4; ++k) {
      list.uv.insert(list.uv.end(), {uv[k].x, uv[k].y});
      list.jacobian.push_back(largest > 0 ? area[k] / largest : 0);
    }
  }

  const Scene& scene_;
  const Mesh& mesh_;
  std::uint32_t bands_;
  std::map<std::uint32_t, Pyramid> pyramids_;
  std::map<std::pair<std::uint32_t, std::size_t>, std::uint32_t> numbers_;
};

std::vector<double> means_on_device(Device& device, const ElementList& elements, std::uint32_t bands) {
  const TexturedElements& list = elements.list;
  const auto count = std::uint32_t(list.element.size());
  if (count == 0) return {};
  const DeviceTextures textures = textures_on_device(device, elements.textures, bands);
  const RealArray uv(device, list.uv, "texture coordinates"),
      jacobian(device, list.jacobian, "texture coordinates");
  const Array<std::uint32_t> points(device, list.points, "texture points"),
      texture(device, list.texture, "texture points");
  RealArray mean(device, std::uint64_t(count) * bands, "element reflectances");
  device.run("mesh/texture.cl", "average_texture", std::uint64_t(count) * bands, uv, jacobian, points,
             texture, textures.textures, textures.texels, bands, mean, count);
  return mean.download();
}

// Share of an element's area that nothing covers.
double seen_share(const Element& e, const std::vector<std::uint8_t>& covered) {
  double seen = 0;
  for (std::uint32_t k = 0; k < 4; ++k)
    if (e.vertex[k] != 0xffffffffu && !covered[e.vertex[k]]) seen += e.weight[k];
  return seen;
}

}  // namespace

Texture halved(const Texture& t, std::uint32_t bands) {
  Texture half;
  half.name = t.name, half.wrap = t.wrap;
  half.width = (t.width + 1) / 2, half.height = (t.height + 1) / 2;
  half.texels.resize(std::size_t(half.width) * half.height * bands);
  // Texel k of n' takes the place of [k, k + 1) n / n' of the n: at most three, two of them perhaps in part.
  const auto parts = [](std::uint32_t k, std::uint32_t to, std::uint32_t from, std::uint32_t& first,
                        double* weight) {
    const double step = double(from) / to, low = k * step, high = (k + 1) * step;
    first = std::uint32_t(low);
    for (std::uint32_t i = 0; i < 3; ++i)
      weight[i] = std::max(0.0, std::min(high, first + i + 1.0) - std::max(low, double(first + i))) / step;
  };
  for (std::uint32_t y = 0; y < half.height; ++y)
    for (std::uint32_t x = 0; x < half.width; ++x) {
      std::uint32_t x0 = 0, y0 = 0;
      double wx[3], wy[3];
      parts(x, half.width, t.width, x0, wx), parts(y, half.height, t.height, y0, wy);
      for (std::uint32_t b = 0; b < bands; ++b) {
        double sum = 0;
        for (std::uint32_t j = 0; j < 3; ++j)
          for (std::uint32_t i = 0; i < 3; ++i)
            if (wx[i] * wy[j] > 0 && x0 + i < t.width && y0 + j < t.height)
              sum += wx[i] * wy[j] * double(t.texels[(std::size_t(y0 + j) * t.width + x0 + i) * bands + b]);
        half.texels[(std::size_t(y) * half.width + x) * bands + b] = float(sum);
      }
    }
  return half;
}

DeviceTextures textures_on_device(Device& device, std::span<const Texture* const> textures,
                                  std::uint32_t bands) {
  std::vector<std::uint32_t> table;
  std::uint64_t texels = 0;
  for (const Texture* t : textures) {
    table.insert(table.end(), {std::uint32_t(texels), std::uint32_t(texels >> 32), t->width, t->height,
                               std::uint32_t(t->wrap[0]), std::uint32_t(t->wrap[1])});
    texels += std::uint64_t(t->width) * t->height;
  }
  table.resize(std::max<std::size_t>(table.size(), texture_uints));  // devices have no empty buffers
  DeviceTextures on_device{Array<std::uint32_t>(device, table, "textures"),
                           Array<float>(device, std::max<std::uint64_t>(texels, 1) * bands, "textures")};
  std::uint64_t at = 0;
  for (const Texture* t : textures) {
    on_device.texels.upload(t->texels, at);
    at += t->texels.size();
  }
  return on_device;
}

Reflectances average_textures(Device& device, const Scene& scene, const Mesh& mesh,
                              const std::vector<std::uint8_t>& covered) {
  const auto stage = device.stage("average textures over elements");
  const auto bands = std::uint32_t(scene.bands.size());
  const std::size_t elements = mesh.elements.size(), patches = mesh.patches.size(),
                    vertices = mesh.vertex_count();
  const auto material = [&](std::uint32_t polygon) -> const Material& {
    return scene.materials[scene.polygons[polygon].material];
  };
  Reflectances r;
  r.element.resize(bands * elements), r.patch.resize(bands * patches), r.vertex.resize(bands * vertices);
  for (std::uint32_t b = 0; b < bands; ++b) {
    for (std::size_t p = 0; p < patches; ++p) {
      const double rho = material(mesh.patches[p].polygon).reflectance[b];
      r.patch[b * patches + p] = rho;
      std::fill_n(r.element.begin() + std::ptrdiff_t(b * elements + mesh.patches[p].first_element),
                  mesh.patches[p].elements, rho);
    }
    for (std::size_t v = 0; v < vertices; ++v)
      r.vertex[b * vertices + v] = material(mesh.receivers[v].surface).reflectance[b];
  }
  const ElementList textured(scene, mesh, bands);
  const std::vector<double> mean = means_on_device(device, textured, bands);
  if (mean.empty()) return r;

  // Elements in their patches' order, so that sums have a fixed one.
  struct MeanSum {
    double seen = 0, of_seen = 0, all = 0, of_all = 0;
  };
  for (std::uint32_t b = 0; b < bands; ++b) {
    std::map<std::uint32_t, MeanSum> patch, vertex;
    for (std::size_t i = 0; i < textured.list.element.size(); ++i) {
      const std::uint32_t index = textured.list.element[i];
      const Element& e = mesh.elements[index];
      // A mean of values in [0, 1) may reach 1 by rounding.
      const double factor = material(mesh.patches[e.patch].polygon).reflectance[b],
                   rho = std::clamp(factor * mean[i * bands + b], 0.0, 0x1.fffffep-1);
      r.element[b * elements + index] = rho;
      const double seen = e.area_m2 * seen_share(e, covered);
      MeanSum& of_patch = patch[e.patch];
      of_patch.seen += seen, of_patch.of_seen += seen * rho;
      of_patch.all += e.area_m2, of_patch.of_all += e.area_m2 * rho;
      for (const std::uint32_t v : e.vertex)
        if (v != 0xffffffffu) vertex[v].all += e.area_m2, vertex[v].of_all += e.area_m2 * rho;
    }
    for (const auto& [p, sum] : patch)
      r.patch[b * patches + p] = sum.seen > 0 ? sum.of_seen / sum.seen : sum.of_all / sum.all;
    for (const auto& [v, sum] : vertex) r.vertex[b * vertices + v] = sum.of_all / sum.all;
  }
  return r;
}

double texture_correlation(const Solution& solution) {
  const Mesh& mesh = solution.mesh;
  const std::size_t vertices = solution.vertex_count(), elements = mesh.elements.size();
  double squares = 0, irradiance = 0, area = 0;
  for (std::uint32_t b = 0; b < solution.bands; ++b) {
    const std::vector<double> of_vertex(
        solution.vertex_irradiance.begin() + std::ptrdiff_t(b * vertices),
        solution.vertex_irradiance.begin() + std::ptrdiff_t((b + 1) * vertices));
    const std::vector<double> h = element_averages(mesh, solution.vertex_covered, of_vertex);
    for (std::uint32_t p = 0; p < mesh.patches.size(); ++p) {
      const Patch& patch = mesh.patches[p];
      double more = 0;
      for (std::uint32_t e = patch.first_element; e < patch.first_element + patch.elements; ++e) {
        const double arriving =
            h[e] * seen_share(mesh.elements[e], solution.vertex_covered) * mesh.elements[e].area_m2;
        more += arriving * (solution.textured.element[b * elements + e] - solution.patch_reflectance(b, p));
        irradiance += arriving;
      }
      more /= patch.area_m2;
      squares += patch.area_m2 * more * more, area += patch.area_m2;
    }
  }
  return irradiance > 0 ? std::sqrt(squares / area) / (irradiance / area) : 0;
}

}  // namespace clrad

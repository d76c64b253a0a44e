// Meshes with elements of different level, split by hand.
#pragma once
#include <map>
#include <tuple>

#include "mesh/lattice.hpp"
#include "render/support.hpp"

namespace clrad::test {

constexpr std::uint32_t none = 0xffffffffu;

inline std::uint32_t corners_of(const Element& e) {
  return e.vertex[3] == none ? 3 : 4;
}

/// Vertices by the polygon and the lattice point they stand at.
class VertexFinder {
 public:
  explicit VertexFinder(const Mesh& mesh) {
    for (std::uint32_t v = 0; v < mesh.vertex_count(); ++v)
      at_[{mesh.receivers[v].surface, mesh.lattice[v][0], mesh.lattice[v][1]}] = v;
  }
  std::uint32_t at(std::uint32_t polygon, std::uint32_t i, std::uint32_t j) const {
    const auto found = at_.find({polygon, i, j});
    return found == at_.end() ? none : found->second;
  }
  std::uint32_t between(const Mesh& mesh, std::uint32_t a, std::uint32_t b) const {
    const auto &p = mesh.lattice[a], &q = mesh.lattice[b];
    return at(mesh.receivers[a].surface, (p[0] + q[0]) / 2, (p[1] + q[1]) / 2);
  }

 private:
  std::map<std::tuple<std::uint32_t, std::uint32_t, std::uint32_t>, std::uint32_t> at_;
};

/// Splits element `index` in four; its neighbours' T-vertices are set. Only meshes are touched: values are set_field()'s.
inline void split(Mesh& mesh, const Frame& frame, std::uint32_t index) {
  const Element parent = mesh.elements[index];
  const std::uint32_t corners = corners_of(parent), polygon = mesh.patches[parent.patch].polygon;
  const VertexFinder finder(mesh);
  const auto middle = [&](const std::vector<std::uint32_t>& of) {
    std::array<std::uint32_t, 2> at{0, 0};
    glm::dvec3 position{0, 0, 0};
    for (const std::uint32_t v : of) {
      for (int c = 0; c < 2; ++c) at[c] += mesh.lattice[v][c];
      position += mesh.position_m[v] / double(of.size());
    }
    for (int c = 0; c < 2; ++c) at[c] /= std::uint32_t(of.size());
    if (const std::uint32_t there = finder.at(polygon, at[0], at[1]); there != none) return there;
    Point receiver = mesh.receivers[of[0]];
    receiver.position = frame.to_frame(position);
    mesh.lattice.push_back(at);
    mesh.position_m.push_back(position);
    mesh.receivers.push_back(receiver);
    return mesh.vertex_count() - 1;
  };
  const auto& v = parent.vertex;
  std::vector<std::vector<std::uint32_t>> quarters;
  if (corners == 4) {
    const std::uint32_t a = middle({v[0], v[1]}), b = middle({v[1], v[2]}), c = middle({v[2], v[3]}),
                        d = middle({v[3], v[0]}), centre = middle({v[0], v[1], v[2], v[3]});
    quarters = {{v[0], a, centre, d}, {a, v[1], b, centre}, {centre, b, v[2], c}, {d, centre, c, v[3]}};
  } else {
    const std::uint32_t a = middle({v[0], v[1]}), b = middle({v[1], v[2]}), c = middle({v[2], v[0]});
    quarters = {{v[0], a, c}, {a, v[1], b}, {c, b, v[2]}, {b, c, a}};
  }
  std::vector<Element> children;
  for (std::uint32_t k = 0; k < 4; ++k) {
    Element child;
    child.vertex.fill(none);
    std::copy(quarters[k].begin(), quarters[k].end(), child.vertex.begin());
    child.patch = parent.patch;
    child.level = parent.level + 1;
    child.code = parent.code | k << 2 * (lattice_depth - 1 - parent.level);
    glm::dvec3 p[4];
    for (std::uint32_t c = 0; c < corners; ++c) p[c] = frame.to_frame(mesh.position_m[child.vertex[c]]);
    measure_element(child, p, corners, frame.metres());
    children.push_back(child);
  }
  mesh.elements.erase(mesh.elements.begin() + index);
  mesh.elements.insert(mesh.elements.begin() + index, children.begin(), children.end());
  const auto grow = [&](auto& segment) {
    if (segment.first_element > index)
      segment.first_element += 3;
    else if (index < segment.first_element + segment.elements)
      segment.elements += 3;
  };
  for (Patch& patch : mesh.patches) grow(patch);
  for (PolygonMesh& of : mesh.polygons) grow(of);

  const VertexFinder all(mesh);
  for (Element& e : mesh.elements)
    for (std::uint32_t k = 0; k < corners_of(e); ++k)
      e.middle[k] = all.between(mesh, e.vertex[k], e.vertex[(k + 1) % corners_of(e)]);
}

/// Irradiance by `field` at every vertex, the added ones included; patches by their elements.
inline void set_field(Solution& s, const Field& field) {
  const std::size_t vertices = s.vertex_count(), patches = s.mesh.patches.size();
  s.vertex_irradiance.assign(s.bands * vertices, 0);
  s.vertex_covered.resize(vertices, 0);
  s.patch_irradiance.assign(s.bands * patches, 0);
  for (std::uint32_t band = 0; band < s.bands; ++band) {
    for (std::size_t v = 0; v < vertices; ++v)
      s.vertex_irradiance[band * vertices + v] =
          field(s.mesh.receivers[v].surface, band, s.mesh.position_m[v]);
    for (const Element& e : s.mesh.elements)
      for (std::uint32_t k = 0; k < corners_of(e); ++k)
        s.patch_irradiance[band * patches + e.patch] += e.area_m2 / s.mesh.patches[e.patch].area_m2 *
                                                        e.weight[k] *
                                                        s.vertex_irradiance[band * vertices + e.vertex[k]];
  }
}

/// A square, a general quad and a triangle, some elements split once and some twice; quads and triangles with one, two and
/// more T-vertices.
inline Solution adaptive_solution(unsigned bands) {
  Scene s = scene({polygon({{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}}),
                   polygon({{0, 0, 0}, {0, 0, 2}, {1.7, 0, 1.9}, {2, 0, 0}}, 2),
                   polygon({{0, 0, 2}, {2, 0.3, 2}, {0, 2, 2}}, 2)},
                  bands);
  s.materials = {material(bands, 0.3), material(bands, 0.9), material(bands, 0.6, 2.5)};
  s.materials[2].name = "lamp \"\xc3\xa4\" & <co>";
  const Field field = [](std::uint32_t p, std::uint32_t band, const glm::dvec3& x) {
    return 1 + p + band + 0.37 * x.x + x.y * x.y + std::sin(3 * x.z);
  };
  Solution out = solution(s, 0.3, field);
  for (std::uint32_t p = 0; p < 3; ++p) {
    const auto first = [&] { return out.mesh.polygons[p].first_element; };
    // Apart, then neighbours, then one of the children of those whose neighbours are all split.
    for (const std::uint32_t e : {40u, 20u, 18u, 17u, 3u, 2u, 1u, 0u})
      split(out.mesh, out.frame, first() + e);
    split(out.mesh, out.frame, first() + 2);
  }
  set_field(out, field);
  return out;
}

}  // namespace clrad::test

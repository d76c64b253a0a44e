#include "mesh/subdivide.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <bit>

#include "clrad/primitives.hpp"
#include "mesh/lattice.hpp"

namespace clrad {
namespace {

using Words = Array<std::uint32_t>;
constexpr const char* subdivide_kernels = "mesh/subdivide.cl";

// The leaves on the device; scratch of one subdivision.
struct Leaves {
  std::uint32_t count;
  Words vertex, middle, level, code;

  Leaves(Device& device, std::uint32_t elements)
      : count(elements),
        vertex(device, 4 * std::uint64_t(elements), "element corners"),
        middle(device, 4 * std::uint64_t(elements), "element T-vertices"),
        level(device, elements, "element levels"),
        code(device, elements, "element codes") {}

  Leaves(Device& device, const Mesh& mesh) : Leaves(device, std::uint32_t(mesh.elements.size())) {
    std::vector<std::uint32_t> v, m, l, c;
    for (const Element& e : mesh.elements) {
      v.insert(v.end(), e.vertex.begin(), e.vertex.end());
      m.insert(m.end(), e.middle.begin(), e.middle.end());
      l.push_back(e.level);
      c.push_back(e.code);
    }
    vertex.upload(v), middle.upload(m), level.upload(l), code.upload(c);
  }
};

// Where vertices lie: coordinates and polygon.
struct Places {
  Words lattice, polygon;

  Places(Device& device, const Mesh& mesh)
      : lattice(device, 2 * std::uint64_t(mesh.vertex_count()), "lattice coordinates"),
        polygon(device, mesh.vertex_count(), "polygons of vertices") {
    std::vector<std::uint32_t> ij, of;
    for (const auto& p : mesh.lattice) ij.insert(ij.end(), p.begin(), p.end());
    for (const Point& p : mesh.receivers) of.push_back(p.surface);
    lattice.upload(ij), polygon.upload(of);
  }
};

// Vertices that elements ask for, named and sorted by name.
struct Wanted {
  Allocation slots;
  Words low, high, polygon, coordinates, parents, order;
};

// How long names are: lattice coordinates are cut by `shift` bits that are 0 in every vertex made now.
struct NameLength {
  std::uint32_t shift, coordinate_bits, polygon_bits;

  explicit NameLength(const Mesh& mesh) {
    std::uint32_t deepest = 0, patches = 1;
    for (const Element& e : mesh.elements) deepest = std::max(deepest, e.level);
    for (const PolygonMesh& p : mesh.polygons) patches = std::max({patches, p.patches_u, p.patches_v});
    shift = lattice_depth - std::min(deepest + 1, lattice_depth);
    coordinate_bits = std::uint32_t(std::bit_width(patches)) + lattice_depth - shift;
    polygon_bits = std::uint32_t(std::bit_width(mesh.polygons.size()));
  }
};

Wanted name_wanted(Device& device, const Leaves& leaves, const Places& places, const Words& split,
                   const NameLength& length) {
  Words counts(device, leaves.count, "vertices asked for");
  device.run(subdivide_kernels, "ask_vertices", leaves.count, split, leaves.vertex, leaves.middle, counts,
             leaves.count);
  Wanted w;
  w.slots = allocate(device, counts.buffer(), leaves.count, "vertices asked for");
  const std::uint32_t n = w.slots.total, room = std::max(n, 1u);
  for (Words* words : {&w.low, &w.high, &w.polygon, &w.order}) *words = Words(device, room, "vertex names");
  w.coordinates = Words(device, 2 * std::uint64_t(room), "new vertices");
  w.parents = Words(device, 4 * std::uint64_t(room), "new vertices");
  device.run(subdivide_kernels, "name_vertices", n, w.slots.owner, w.slots.rank, leaves.vertex, leaves.middle,
             places.lattice, places.polygon, length.shift, w.low, w.high, w.polygon, w.coordinates, w.parents,
             w.order, n);
  Words keys(device, room, "vertex names");
  const auto sort_by = [&](const Words& words, std::uint32_t bits) {
    device.run(subdivide_kernels, "gather_words", n, words, w.order, keys, n);
    radix_sort(device, keys.buffer(), w.order.buffer(), n, bits);
  };
  sort_by(w.low, std::min(32u, 2 * length.coordinate_bits));
  if (2 * length.coordinate_bits > 32) sort_by(w.high, 2 * length.coordinate_bits - 32);
  sort_by(w.polygon, length.polygon_bits);
  return w;
}

// Splits spread to coarser neighbours, a level a round.
Wanted name_balanced(Device& device, const Leaves& leaves, const Places& places, Words& split,
                     const NameLength& length) {
  Words forced(device, leaves.count, "forced splits"), list(device, leaves.count, "forced splits");
  for (;;) {
    Wanted wanted = name_wanted(device, leaves, places, split, length);
    device.run(subdivide_kernels, "balance", leaves.count, split, leaves.vertex, leaves.middle,
               places.lattice, places.polygon, length.shift, wanted.low, wanted.high, wanted.polygon,
               wanted.order, wanted.slots.total, forced, leaves.count);
    if (compact(device, forced.buffer(), leaves.count, list.buffer()) == 0) return wanted;
  }
}

// Appends the vertices of `made` to the mesh.
void append_vertices(const Scene& scene, const Frame& frame, Mesh& mesh, const Wanted& wanted,
                     const std::vector<std::uint32_t>& made) {
  const auto coordinates = wanted.coordinates.download(), parents = wanted.parents.download(),
             polygon = wanted.polygon.download(), owner = wanted.slots.owner.download();
  for (const std::uint32_t slot : made) {
    const std::uint32_t p = polygon[slot], i = coordinates[2 * slot], j = coordinates[2 * slot + 1];
    const PolygonMesh& of = mesh.polygons[p];
    const LatticeMap map(scene.polygons[p], frame, of.patches_u, of.patches_v);
    Point receiver = mesh.receivers[of.first_vertex];
    receiver.position = map.inside(i, j, lattice_unit(mesh.elements[owner[slot]].level + 1));
    mesh.lattice.push_back({i, j});
    mesh.position_m.push_back(frame.from_frame(map.position(i, j)));
    mesh.receivers.push_back(receiver);
    mesh.parents.push_back(
        {parents[4 * slot], parents[4 * slot + 1], parents[4 * slot + 2], parents[4 * slot + 3]});
  }
}

// The element array as the device laid it; areas and weights of those that are new.
void take_elements(const Scene& scene, const Frame& frame, Mesh& mesh, const Leaves& leaves,
                   const std::vector<std::uint32_t>& owner) {
  const auto vertex = leaves.vertex.download(), middle = leaves.middle.download(),
             level = leaves.level.download(), code = leaves.code.download();
  std::vector<Element> elements(leaves.count);
  for (std::uint32_t e = 0; e < leaves.count; ++e) {
    Element& element = elements[e] = mesh.elements[owner[e]];
    std::copy_n(vertex.begin() + std::ptrdiff_t(4) * e, 4, element.vertex.begin());
    std::copy_n(middle.begin() + std::ptrdiff_t(4) * e, 4, element.middle.begin());
    if (level[e] == element.level) continue;
    element.level = level[e], element.code = code[e];
    const std::uint32_t p = mesh.patches[element.patch].polygon;
    const LatticeMap map(scene.polygons[p], frame, mesh.polygons[p].patches_u, mesh.polygons[p].patches_v);
    const std::uint32_t corners = element.vertex[3] == 0xffffffffu ? 3 : 4;
    glm::dvec3 corner[4];
    for (std::uint32_t k = 0; k < corners; ++k) {
      const auto& at = mesh.lattice[element.vertex[k]];
      corner[k] = map.position(at[0], at[1]);
    }
    measure_element(element, corner, corners, frame.metres());
  }
  mesh.elements = std::move(elements);
  for (Patch& patch : mesh.patches) patch.elements = 0;
  for (const Element& e : mesh.elements) ++mesh.patches[e.patch].elements;
  std::uint32_t first = 0;
  for (Patch& patch : mesh.patches) patch.first_element = first, first += patch.elements;
  for (PolygonMesh& polygon : mesh.polygons) {
    polygon.first_element = mesh.patches[polygon.first_patch].first_element;
    const Patch& last = mesh.patches[polygon.first_patch + polygon.patches - 1];
    polygon.elements = last.first_element + last.elements - polygon.first_element;
  }
}

}  // namespace

Subdivision subdivide(Device& device, const Scene& scene, const Frame& frame, Mesh& mesh,
                      std::vector<std::uint32_t> split) {
  Subdivision result;
  result.first_vertex = mesh.vertex_count();
  for (std::size_t e = 0; e < split.size(); ++e)
    if (mesh.elements[e].level == lattice_depth) split[e] = 0;
  const NameLength length(mesh);
  const Leaves before(device, mesh);
  Words split_device(device, split, "elements to split");
  const Wanted wanted = [&] {
    const Places places(device, mesh);
    return name_balanced(device, before, places, split_device, length);
  }();
  const std::uint32_t slots = wanted.slots.total, room = std::max(slots, 1u);

  Words heads(device, room, "new vertices"), runs(device, room, "new vertices"),
      number(device, room, "new vertices"), made(device, room, "new vertices");
  device.run(subdivide_kernels, "find_heads", slots, wanted.low, wanted.high, wanted.polygon, wanted.order,
             heads, slots);
  const std::uint32_t vertices = scan_uint(device, Sum::inclusive, heads.buffer(), runs.buffer(), slots);
  if (std::uint64_t(mesh.vertex_count()) + vertices > 1u << 31)
    throw UsageError(fmt::format(
        "adaptive subdivision would make more than {} vertices; use a larger --adaptive", 1u << 31));
  device.run(subdivide_kernels, "number_vertices", slots, wanted.order, heads, runs, result.first_vertex,
             number, made, slots);
  append_vertices(scene, frame, mesh, wanted, made.download(0, vertices));

  Words counts(device, before.count, "children");
  device.run(subdivide_kernels, "ask_children", before.count, split_device, counts, before.count);
  const Allocation children = allocate(device, counts.buffer(), before.count, "children");
  result.split = (children.total - before.count) / 3;
  Leaves after(device, children.total);
  device.run(subdivide_kernels, "place_children", after.count, children.owner, children.rank, split_device,
             before.vertex, before.middle, before.level, before.code, wanted.slots.offsets, number,
             after.vertex, after.middle, after.level, after.code, after.count);
  const Places places(device, mesh);
  device.run(subdivide_kernels, "find_middles", after.count, after.vertex, after.middle, after.level,
             places.lattice, places.polygon, length.shift, wanted.low, wanted.high, wanted.polygon,
             wanted.order, number, slots, after.count);
  result.owner = children.owner.download(0, children.total);
  take_elements(scene, frame, mesh, after, result.owner);
  return result;
}

}  // namespace clrad

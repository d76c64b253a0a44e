#include "output/archive_parts.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstring>

#include "output/fields.hpp"

namespace clrad {
namespace {

constexpr std::uint32_t none = 0xffffffffu;

// How many numbers a field holds: 1, or those of its parts.
template <class T>
constexpr unsigned width() {
  if constexpr (std::is_arithmetic_v<T>)
    return 1;
  else
    return unsigned(sizeof(T) / sizeof(std::declval<T>()[0])) *
           width<std::decay_t<decltype(std::declval<T>()[0])>>();
}

template <class T>
auto& number(T& field, unsigned k) {
  if constexpr (std::is_arithmetic_v<T>) {
    return field;
  } else {
    constexpr unsigned part = width<std::decay_t<decltype(field[0])>>();
    return number(field[k / part], k % part);
  }
}

// A table of structs as columns of numbers, one a field; one list of columns serves both ways.
struct AddColumns {
  ArchiveWriter& archive;

  template <class Row, class Field>
  void operator()(const char* name, const std::vector<Row>& rows, Field Row::*field) {
    add<Field>(name, rows, [field](const Row& row) -> const Field& { return row.*field; });
  }
  template <class Row>
  void operator()(const char* name, const std::vector<Row>& rows) {
    add<Row>(name, rows, [](const Row& row) -> const Row& { return row; });
  }

 private:
  template <class Field, class Row, class Get>
  void add(const char* name, const std::vector<Row>& rows, Get field) {
    std::vector<std::decay_t<decltype(number(std::declval<Field&>(), 0))>> values;
    values.reserve(rows.size() * width<Field>());
    for (const Row& row : rows)
      for (unsigned k = 0; k < width<Field>(); ++k) values.push_back(number(field(row), k));
    archive.add(name, values);
  }
};

struct ReadColumns {
  ArchiveReader& archive;

  template <class Row, class Field>
  void operator()(const char* name, std::vector<Row>& rows, Field Row::*field) {
    read<Field>(name, rows, [field](Row& row) -> Field& { return row.*field; });
  }
  template <class Row>
  void operator()(const char* name, std::vector<Row>& rows) {
    read<Row>(name, rows, [](Row& row) -> Row& { return row; });
  }

 private:
  template <class Field, class Row, class Get>
  void read(const char* name, std::vector<Row>& rows, Get field) {
    constexpr unsigned each = width<Field>();
    using Number = std::decay_t<decltype(number(std::declval<Field&>(), 0))>;
    std::vector<Number> values;
    if constexpr (std::is_floating_point_v<Number>)
      values = archive.finite<Number>(name);
    else
      values = archive.array<Number>(name);
    if (rows.empty()) rows.resize(values.size() / each);
    if (values.size() != rows.size() * each)
      archive.fail(
          fmt::format("section '{}' has {} values, not {}", name, values.size(), rows.size() * each));
    std::size_t at = 0;
    for (Row& row : rows)
      for (unsigned k = 0; k < each; ++k) number(field(row), k) = values[at++];
  }
};

// Where a polygon comes from; texts are numbers in a list without repeats.
struct PolygonOrigin {
  std::uint32_t name, file, line, item, back;
};

template <class Visit, class Polygons, class Origins>
void visit_polygons(Visit& visit, Polygons& polygons, Origins& origins) {
  visit("polygon.corner_m", polygons, &Polygon::corner);
  visit("polygon.corners", polygons, &Polygon::corners);
  visit("polygon.material", polygons, &Polygon::material);
  visit("polygon.name", origins, &PolygonOrigin::name);
  visit("polygon.file", origins, &PolygonOrigin::file);
  visit("polygon.line", origins, &PolygonOrigin::line);
  visit("polygon.item", origins, &PolygonOrigin::item);
  visit("polygon.back", origins, &PolygonOrigin::back);
}

// A field that is added to one of these is to be named below.
static_assert(sizeof(PolygonMesh) == 10 * 4);
static_assert(sizeof(Patch) == 2 * 4 + 12 * 8 + 8 + 2 * 4);
static_assert(sizeof(Element) == 11 * 4 + 4 + 8 + 4 * 8);
static_assert(sizeof(Point) == 6 * 8 + 2 * 4);

template <class Visit, OneOf<Mesh> M>
void visit_mesh(Visit& visit, M& mesh) {
  auto& [polygons, patches, elements, receivers, position_m, lattice, parents, patch_edge_m, element_edge_m] =
      mesh;
  visit("mesh.polygon.first_vertex", polygons, &PolygonMesh::first_vertex);
  visit("mesh.polygon.vertices", polygons, &PolygonMesh::vertices);
  visit("mesh.polygon.first_patch", polygons, &PolygonMesh::first_patch);
  visit("mesh.polygon.patches", polygons, &PolygonMesh::patches);
  visit("mesh.polygon.first_element", polygons, &PolygonMesh::first_element);
  visit("mesh.polygon.elements", polygons, &PolygonMesh::elements);
  visit("mesh.polygon.cells_u", polygons, &PolygonMesh::cells_u);
  visit("mesh.polygon.cells_v", polygons, &PolygonMesh::cells_v);
  visit("mesh.polygon.patches_u", polygons, &PolygonMesh::patches_u);
  visit("mesh.polygon.patches_v", polygons, &PolygonMesh::patches_v);

  visit("mesh.patch.polygon", patches, &Patch::polygon);
  visit("mesh.patch.corners", patches, &Patch::corners);
  visit("mesh.patch.corner", patches, &Patch::corner);
  visit("mesh.patch.area_m2", patches, &Patch::area_m2);
  visit("mesh.patch.first_element", patches, &Patch::first_element);
  visit("mesh.patch.elements", patches, &Patch::elements);

  visit("mesh.element.vertex", elements, &Element::vertex);
  visit("mesh.element.middle", elements, &Element::middle);
  visit("mesh.element.patch", elements, &Element::patch);
  visit("mesh.element.level", elements, &Element::level);
  visit("mesh.element.code", elements, &Element::code);
  visit("mesh.element.area_m2", elements, &Element::area_m2);
  visit("mesh.element.weight", elements, &Element::weight);

  visit("mesh.vertex.receiver", receivers, &Point::position);
  visit("mesh.vertex.normal", receivers, &Point::normal);
  visit("mesh.vertex.plane", receivers, &Point::plane);
  visit("mesh.vertex.surface", receivers, &Point::surface);
  visit("mesh.vertex.position_m", position_m);
  visit("mesh.vertex.lattice", lattice);
  visit("mesh.vertex.parents", parents);
}

// first, first + 1, ..., first + count - 1 are all below `size`.
bool in_range(std::uint64_t first, std::uint64_t count, std::size_t size) {
  return first + count <= size;
}

bool consistent(const PolygonMesh& m, const Polygon& polygon, const Mesh& mesh) {
  const std::uint64_t u = m.cells_u, v = m.cells_v;
  const std::uint64_t regular = polygon.corners == 4 ? (u + 1) * (v + 1) : (u + 1) * (u + 2) / 2;
  const std::uint64_t patches_u = m.patches_u, patches_v = m.patches_v;
  return (polygon.corners == 4 || (u == v && patches_u == patches_v)) && m.patches == patches_u * patches_v &&
         u >> 31 == 0 && v >> 31 == 0 && in_range(m.first_vertex, regular, mesh.receivers.size()) &&
         in_range(m.first_vertex, m.vertices, mesh.receivers.size()) &&
         in_range(m.first_patch, m.patches, mesh.patches.size()) &&
         in_range(m.first_element, m.elements, mesh.elements.size());
}

bool consistent(const Element& element, const Mesh& mesh) {
  const auto& v = element.vertex;
  const auto is_vertex = [&](std::uint32_t i) { return i < mesh.receivers.size(); };
  const auto is_vertex_or_none = [&](std::uint32_t i) { return i == none || is_vertex(i); };
  return element.patch < mesh.patches.size() && element.level <= lattice_depth &&
         std::all_of(v.begin(), v.begin() + 3, is_vertex) && is_vertex_or_none(v[3]) &&
         std::all_of(element.middle.begin(), element.middle.end(), is_vertex_or_none) &&
         (v[3] != none || element.middle[3] == none);
}

bool consistent(const Mesh& mesh, const Scene& scene) {
  if (mesh.polygons.size() != scene.polygons.size() || mesh.position_m.size() != mesh.receivers.size() ||
      mesh.lattice.size() != mesh.receivers.size() || mesh.parents.size() != mesh.receivers.size() ||
      mesh.receivers.size() >= none)
    return false;
  for (const auto& of : mesh.parents)
    for (const std::uint32_t v : of)
      if (v != none && v >= mesh.receivers.size()) return false;
  for (std::size_t p = 0; p < mesh.polygons.size(); ++p)
    if (!consistent(mesh.polygons[p], scene.polygons[p], mesh)) return false;
  return std::all_of(mesh.patches.begin(), mesh.patches.end(),
                     [&](const Patch& p) {
                       return p.polygon < mesh.polygons.size() && (p.corners == 3 || p.corners == 4) &&
                              in_range(p.first_element, p.elements, mesh.elements.size());
                     }) &&
         std::all_of(mesh.elements.begin(), mesh.elements.end(),
                     [&](const Element& e) { return consistent(e, mesh); }) &&
         std::all_of(mesh.receivers.begin(), mesh.receivers.end(),
                     [&](const Point& p) { return p.surface < mesh.polygons.size(); });
}

bool is_finite(const glm::dvec3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

// Shares of light: one a band, or none where that is allowed.
bool are_shares(const std::vector<double>& values, std::size_t bands) {
  return values.size() == bands &&
         std::all_of(values.begin(), values.end(), [](double v) { return v >= 0 && v <= 1; });
}

bool consistent(const Texture& t, std::size_t bands) {
  return t.width > 0 && t.height > 0 && t.wrap[0] <= Wrap::clamp && t.wrap[1] <= Wrap::clamp &&
         t.texels.size() == std::size_t(t.width) * t.height * bands &&
         std::all_of(t.texels.begin(), t.texels.end(), [](float x) { return x >= 0 && x <= 1; });
}

bool consistent(const Material& m, std::size_t bands) {
  return are_shares(m.reflectance, bands) && (m.specular.empty() || are_shares(m.specular, bands)) &&
         (m.transmission.empty() || are_shares(m.transmission, bands)) &&
         m.emitted_exitance.size() == bands &&
         std::all_of(m.emitted_exitance.begin(), m.emitted_exitance.end(),
                     [](double e) { return e >= 0 && std::isfinite(e); }) &&
         std::isfinite(m.ior);
}

bool consistent(const PunctualLight& light, std::size_t bands) {
  return light.kind <= PunctualLight::Kind::directional && is_finite(light.position_m) &&
         is_finite(light.direction) && light.intensity.size() == bands &&
         std::all_of(light.intensity.begin(), light.intensity.end(),
                     [](double i) { return i >= 0 && std::isfinite(i); }) &&
         light.inner_cone_rad >= 0 && light.inner_cone_rad <= light.outer_cone_rad &&
         light.outer_cone_rad < 1.6;
}

bool consistent(const Scene& scene) {
  return scene.quantity <= Quantity::photometric &&
         std::all_of(scene.materials.begin(), scene.materials.end(),
                     [&](const Material& m) { return consistent(m, scene.bands.size()); }) &&
         std::all_of(scene.textures.begin(), scene.textures.end(),
                     [&](const Texture& t) { return consistent(t, scene.bands.size()); }) &&
         std::all_of(scene.materials.begin(), scene.materials.end(),
                     [&](const Material& m) {
                       return m.texture == no_texture || m.texture < scene.textures.size();
                     }) &&
         std::all_of(scene.polygons.begin(), scene.polygons.end(),
                     [&](const Polygon& p) {
                       return (p.corners == 3 || p.corners == 4) && p.material < scene.materials.size();
                     }) &&
         std::all_of(scene.cameras.begin(), scene.cameras.end(),
                     [](const Camera& c) {
                       return is_finite(c.eye) && is_finite(c.target) && is_finite(c.up) &&
                              c.vertical_field_of_view_rad > 0 && c.vertical_field_of_view_rad < 3.2;
                     }) &&
         std::all_of(scene.lights.begin(), scene.lights.end(),
                     [&](const PunctualLight& l) { return consistent(l, scene.bands.size()); }) &&
         std::all_of(scene.diagnostics.begin(), scene.diagnostics.end(),
                     [](const Diagnostic& d) { return d.severity <= Diagnostic::Severity::error; });
}

}  // namespace

void add_scene(ArchiveWriter& archive, const Scene& scene) {
  const auto& [file, quantity, bands, materials, polygons, cameras, diagnostics, lights, textures] = scene;
  std::map<std::string, std::uint32_t> numbers;
  std::vector<std::string> list;
  const auto listed = [&](const std::string& text) {
    const auto [entry, added] = numbers.emplace(text, std::uint32_t(list.size()));
    if (added) list.push_back(text);
    return entry->second;
  };
  std::vector<PolygonOrigin> origins;
  for (const Polygon& p : polygons) {
    const auto& [corner, corners, material, name, where, back, uv] = p;
    origins.push_back({listed(name), listed(where.file), where.line, listed(where.item), back});
  }
  AddColumns visit{archive};
  visit_polygons(visit, polygons, origins);
  archive.add_json("scene", {{"file", put(file)},
                             {"quantity", put(quantity)},
                             {"bands", put(bands)},
                             {"materials", put(materials)},
                             {"cameras", put(cameras)},
                             {"diagnostics", put(diagnostics)},
                             {"lights", put(lights)},
                             {"textures", put(textures)},
                             {"texts", put(list)}});
  if (textures.empty()) return;
  visit("polygon.uv", polygons, &Polygon::uv);
  for (std::size_t t = 0; t < textures.size(); ++t)
    archive.add(fmt::format("texture.{}.texels", t), textures[t].texels);
}

Scene read_scene(ArchiveReader& archive) {
  const nlohmann::json json = archive.json("scene");
  Scene scene;
  std::vector<std::string> list;
  try {
    get(json.at("file"), scene.file), get(json.at("quantity"), scene.quantity);
    get(json.at("bands"), scene.bands), get(json.at("materials"), scene.materials);
    get(json.at("cameras"), scene.cameras), get(json.at("diagnostics"), scene.diagnostics);
    get(json.at("lights"), scene.lights);
    get(json.at("textures"), scene.textures), get(json.at("texts"), list);
  } catch (const nlohmann::json::exception& e) {
    archive.fail(fmt::format("section 'scene' cannot be understood: {}", e.what()));
  }
  std::vector<PolygonOrigin> origins;
  ReadColumns visit{archive};
  visit_polygons(visit, scene.polygons, origins);
  const auto known = [&](std::uint32_t text) { return text < list.size(); };
  if (origins.size() != scene.polygons.size()) archive.fail("a polygon's name is missing");
  for (std::size_t p = 0; p < origins.size(); ++p) {
    const PolygonOrigin& origin = origins[p];
    if (!known(origin.name) || !known(origin.file) || !known(origin.item))
      archive.fail("a polygon's name is missing");
    scene.polygons[p].name = list[origin.name];
    scene.polygons[p].where = {list[origin.file], origin.line, list[origin.item]};
    scene.polygons[p].back = origin.back != 0;
    if (origin.back > 1 || (origin.back && (p == 0 || origins[p - 1].back)))
      archive.fail("a polygon is the back of none");
  }
  if (!scene.textures.empty()) visit("polygon.uv", scene.polygons, &Polygon::uv);
  for (std::size_t t = 0; t < scene.textures.size(); ++t)
    scene.textures[t].texels = archive.array<float>(fmt::format("texture.{}.texels", t));
  if (!consistent(scene)) archive.fail("the scene does not fit together");
  return scene;
}

void add_mesh(ArchiveWriter& archive, const Mesh& mesh) {
  AddColumns visit{archive};
  visit_mesh(visit, mesh);
  archive.add("mesh.edges_m", std::vector<double>{mesh.patch_edge_m, mesh.element_edge_m});
}

Mesh read_mesh(ArchiveReader& archive, const Scene& scene) {
  Mesh mesh;
  ReadColumns visit{archive};
  visit_mesh(visit, mesh);
  const auto edges = archive.array<double>("mesh.edges_m", 2);
  mesh.patch_edge_m = edges[0], mesh.element_edge_m = edges[1];
  if (!consistent(mesh, scene)) archive.fail("the mesh does not fit together");
  return mesh;
}

}  // namespace clrad

// VTK XML unstructured grids (VTK's "VTK XML Formats": UnstructuredGrid, appended raw data behind UInt64 lengths).
#include <fmt/format.h>

#include <bit>
#include <cmath>
#include <functional>

#include "clrad/output.hpp"
#include "output/colours.hpp"
#include "output/file.hpp"
#include "output/outline.hpp"
#include "output/tone.hpp"
#include "version.hpp"

namespace clrad {
namespace {

// Cell types of VTK's vtkCellType.h.
constexpr std::uint8_t vtk_triangle = 5, vtk_polygon = 7, vtk_quad = 9;

// Names of the user's in an attribute. What is not a character of XML 1.0, or not ASCII and perhaps not UTF-8, becomes '?'.
std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '&')
      out += "&amp;";
    else if (c == '<')
      out += "&lt;";
    else if (c == '"')
      out += "&quot;";
    else
      out += c >= ' ' && c <= '~' ? c : '?';
  }
  return out;
}

template <class T>
constexpr const char* vtk_type() {
  if constexpr (std::is_same_v<T, std::uint8_t>) return "UInt8";
  if constexpr (std::is_same_v<T, std::uint32_t>) return "UInt32";
  if constexpr (std::is_same_v<T, std::int64_t>) return "Int64";
  if constexpr (std::is_same_v<T, double>) return "Float64";
}

// The XML text and, behind it, arrays that are made one after the other only when the file is written.
class Grid {
 public:
  std::string xml;

  /// `make` gives as many values as `values` says, those of one point or cell next to each other; `components` are the
  /// names of what they are, where there is more than one.
  template <class T>
  void array(const std::string& name, const std::vector<std::string>& components, std::uint64_t values,
             std::function<std::vector<T>()> make) {
    xml += fmt::format("        <DataArray type=\"{}\" Name=\"{}\"", vtk_type<T>(), escaped(name));
    if (components.size() > 1) {
      xml += fmt::format(" NumberOfComponents=\"{}\"", components.size());
      for (std::size_t c = 0; c < components.size(); ++c)
        xml += fmt::format(" ComponentName{}=\"{}\"", c, escaped(components[c]));
    }
    xml += fmt::format(" format=\"appended\" offset=\"{}\"/>\n", offset_);
    const std::uint64_t bytes = values * sizeof(T);
    offset_ += sizeof bytes + bytes;
    appended_.push_back([make = std::move(make), bytes, name](FileWriter& file) {
      const std::vector<T> all = make();
      if (all.size() * sizeof(T) != bytes)
        throw UsageError(
            fmt::format("the solution has {} values of {}, not {}", all.size(), name, bytes / sizeof(T)));
      file.write(&bytes, sizeof bytes);
      file.write(all.data(), bytes);
    });
  }

  /// Texts as field data: VTK reads the characters as numbers, each text ended by a 0.
  void texts(const std::string& name, const std::vector<std::string>& values) {
    xml += fmt::format("      <Array type=\"String\" Name=\"{}\" NumberOfTuples=\"{}\" format=\"ascii\">",
                       name, values.size());
    for (const std::string& value : values) {
      for (const char c : value) xml += fmt::format(" {}", int(static_cast<unsigned char>(c)));
      xml += " 0";
    }
    xml += " </Array>\n";
  }

  void write(const std::string& path) const {
    FileWriter file(path);
    file.write(xml);
    file.write("  <AppendedData encoding=\"raw\">\n_");
    for (const auto& append : appended_) append(file);
    file.write("\n  </AppendedData>\n</VTKFile>\n");
    file.commit();
  }

 private:
  std::uint64_t offset_ = 0;
  std::vector<std::function<void(FileWriter&)>> appended_;
};

// Band by band to value by value: [band][item] -> [item][band].
std::vector<double> interleaved(std::uint32_t bands, std::size_t items,
                                const std::function<double(std::uint32_t, std::size_t)>& value) {
  std::vector<double> all;
  all.reserve(bands * items);
  for (std::size_t i = 0; i < items; ++i)
    for (std::uint32_t band = 0; band < bands; ++band) all.push_back(value(band, i));
  return all;
}

void add_field_data(Grid& grid, const Solution& s) {
  const bool photometric = s.scene.quantity == Quantity::photometric;
  grid.xml += "    <FieldData>\n";
  grid.texts("generator", {std::string("clrad ") + version});
  grid.texts("quantity", {photometric ? "photometric" : "radiometric"});
  grid.texts("unit", {photometric ? "lm/m^2" : "W/m^2"});
  grid.texts("luminance_unit", {photometric ? "cd/m^2" : "W/(sr m^2)"});
  grid.texts("bands", s.scene.bands);
  grid.xml += "    </FieldData>\n";
}

void add_point_data(Grid& grid, const Solution& s, const DisplayColours& display) {
  const std::size_t n = s.vertex_count();
  grid.xml += "      <PointData Scalars=\"luminance\">\n";
  grid.array<double>("radiosity", s.scene.bands, n * s.bands, [&s, n] {
    return interleaved(s.bands, n, [&s](std::uint32_t band, std::size_t v) {
      return s.vertex_radiosity(band, std::uint32_t(v), s.mesh.receivers[v].surface);
    });
  });
  grid.array<double>("irradiance", s.scene.bands, n * s.bands, [&s, n] {
    return interleaved(
        s.bands, n, [&s, n](std::uint32_t band, std::size_t v) { return s.vertex_irradiance[band * n + v]; });
  });
  grid.array<std::uint8_t>("covered", {}, n, [&s] { return s.vertex_covered; });
  grid.array<double>("luminance", {}, n, [&display] {
    constexpr double pi = 3.14159265358979323846;
    std::vector<double> of_radiance = display.luminance;
    for (double& l : of_radiance) l /= pi;
    return of_radiance;
  });
  grid.array<std::uint8_t>("display_colour", {"red", "green", "blue"}, 3 * n, [&display] {
    std::vector<std::uint8_t> codes;
    codes.reserve(display.rgb.size());
    for (const double c : display.rgb) codes.push_back(std::uint8_t(std::lround(255 * srgb_encoded(c))));
    return codes;
  });
  grid.xml += "      </PointData>\n";
}

void add_cell_data(Grid& grid, const Solution& s) {
  const auto& elements = s.mesh.elements;
  const auto whole = [&](const char* name, const std::function<std::uint32_t(const Element&)>& value) {
    grid.array<std::uint32_t>(name, {}, elements.size(), [&elements, value] {
      std::vector<std::uint32_t> all;
      all.reserve(elements.size());
      for (const Element& e : elements) all.push_back(value(e));
      return all;
    });
  };
  const auto polygon = [&s](const Element& e) { return s.mesh.patches[e.patch].polygon; };
  grid.xml += "      <CellData>\n";
  whole("polygon", polygon);
  whole("patch", [](const Element& e) { return e.patch; });
  whole("material", [&s, polygon](const Element& e) { return s.scene.polygons[polygon(e)].material; });
  whole("level", [](const Element& e) { return e.level; });
  grid.array<double>("area_m2", {}, elements.size(), [&elements] {
    std::vector<double> all;
    all.reserve(elements.size());
    for (const Element& e : elements) all.push_back(e.area_m2);
    return all;
  });
  grid.array<double>("mean_radiosity", s.scene.bands, elements.size() * s.bands, [&s, polygon] {
    return interleaved(s.bands, s.mesh.elements.size(), [&](std::uint32_t band, std::size_t i) {
      const Element& e = s.mesh.elements[i];
      double mean = 0;
      for (std::size_t k = 0; k < (e.vertex[3] == 0xffffffffu ? 3 : 4); ++k)
        mean += e.weight[k] * s.vertex_radiosity(band, e.vertex[k], polygon(e));
      return mean;
    });
  });
  grid.xml += "      </CellData>\n";
}

void add_cells(Grid& grid, const std::vector<Element>& elements) {
  std::uint64_t corners = 0;
  for (const Element& e : elements) corners += outline(e).vertices;
  grid.xml += "      <Cells>\n";
  grid.array<std::int64_t>("connectivity", {}, corners, [&elements, corners] {
    std::vector<std::int64_t> all;
    all.reserve(corners);
    for (const Element& e : elements) {
      const Outline around = outline(e);
      all.insert(all.end(), around.vertex.begin(), around.vertex.begin() + around.vertices);
    }
    return all;
  });
  grid.array<std::int64_t>("offsets", {}, elements.size(), [&elements] {
    std::vector<std::int64_t> all;
    all.reserve(elements.size());
    std::int64_t end = 0;
    for (const Element& e : elements) all.push_back(end += outline(e).vertices);
    return all;
  });
  grid.array<std::uint8_t>("types", {}, elements.size(), [&elements] {
    std::vector<std::uint8_t> all;
    all.reserve(elements.size());
    for (const Element& e : elements) {
      const bool triangle = e.vertex[3] == 0xffffffffu;
      const bool whole = outline(e).vertices == (triangle ? 3u : 4u);
      all.push_back(!whole ? vtk_polygon : triangle ? vtk_triangle : vtk_quad);
    }
    return all;
  });
  grid.xml += "      </Cells>\n";
}

}  // namespace

void write_vtu(const std::string& path, const Solution& solution) {
  if (lower_ending(path) != ".vtu")
    throw UsageError(fmt::format("cannot write {}: the ending of a VTK unstructured grid is .vtu", path));
  if (solution.mesh.elements.empty())
    throw UsageError(fmt::format("cannot write {}: the mesh has no elements", path));
  const DisplayColours display = display_colours(solution);
  Grid grid;
  grid.xml = fmt::format(
      "<?xml version=\"1.0\"?>\n"
      "<VTKFile type=\"UnstructuredGrid\" version=\"1.0\" byte_order=\"{}\" header_type=\"UInt64\">\n"
      "  <UnstructuredGrid>\n",
      std::endian::native == std::endian::little ? "LittleEndian" : "BigEndian");
  add_field_data(grid, solution);
  grid.xml += fmt::format("    <Piece NumberOfPoints=\"{}\" NumberOfCells=\"{}\">\n", solution.vertex_count(),
                          solution.mesh.elements.size());
  add_point_data(grid, solution, display);
  add_cell_data(grid, solution);
  grid.xml += "      <Points>\n";
  grid.array<double>("Points", {"x", "y", "z"}, 3 * std::uint64_t(solution.vertex_count()), [&solution] {
    std::vector<double> all;
    all.reserve(3 * solution.mesh.position_m.size());
    for (const glm::dvec3& p : solution.mesh.position_m) all.insert(all.end(), {p.x, p.y, p.z});
    return all;
  });
  grid.xml += "      </Points>\n";
  add_cells(grid, solution.mesh.elements);
  grid.xml += "    </Piece>\n  </UnstructuredGrid>\n";
  grid.write(path);
}

}  // namespace clrad

#include <fmt/format.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <nlohmann/json.hpp>

#include "clrad/output.hpp"
#include "output/colours.hpp"
#include "output/file.hpp"
#include "output/outline.hpp"
#include "version.hpp"

namespace clrad {
namespace {

using Json = nlohmann::ordered_json;

// Numbers of the glTF 2.0 specification, sections 3.6.2 and 3.7.2.
constexpr int array_buffer = 34962, element_array_buffer = 34963;
constexpr int type_float = 5126, type_uint = 5125, mode_triangles = 4;
constexpr std::uint32_t glb_magic = 0x46546C67, glb_json = 0x4E4F534A, glb_bin = 0x004E4942;

static_assert(std::numeric_limits<float>::is_iec559);

// The JSON and the one binary buffer of a glTF asset while it is built.
class Asset {
 public:
  Json json;

  /// Little-endian, as glTF wants it; every array starts on 4 bytes because all values have 4 bytes.
  template <class T>
  int add(const std::vector<T>& values, const char* type, unsigned components, int target) {
    static_assert(sizeof(T) == 4);
    Json& views = json["bufferViews"];
    views.push_back({{"buffer", 0},
                     {"byteOffset", bytes_.size()},
                     {"byteLength", 4 * values.size()},
                     {"target", target}});
    bytes_.reserve(bytes_.size() + 4 * values.size());
    for (const T value : values) {
      std::uint32_t word;
      std::memcpy(&word, &value, 4);
      for (int k = 0; k < 4; ++k) bytes_.push_back(char(word >> (8 * k) & 0xff));
    }
    json["accessors"].push_back({{"bufferView", views.size() - 1},
                                 {"componentType", std::is_same_v<T, float> ? type_float : type_uint},
                                 {"count", values.size() / components},
                                 {"type", type}});
    return int(json["accessors"].size() - 1);
  }

  std::string glb() {
    json["buffers"] = Json::array({{{"byteLength", bytes_.size()}}});
    std::string text = dump();
    text.resize((text.size() + 3) / 4 * 4, ' ');
    const std::uint64_t total = 12 + 8 + text.size() + 8 + bytes_.size();
    if (total > std::numeric_limits<std::uint32_t>::max())
      throw UsageError(fmt::format(
          "a GLB file of {} bytes; its format ends at 4 GiB: use a larger --element-edge", total));
    std::string file;
    file.reserve(total);
    for (const std::uint32_t word :
         {glb_magic, 2u, std::uint32_t(total), std::uint32_t(text.size()), glb_json})
      put(file, word);
    file += text;
    for (const std::uint32_t word : {std::uint32_t(bytes_.size()), glb_bin}) put(file, word);
    file += bytes_;
    return file;
  }

  std::string gltf() {
    json["buffers"] = Json::array(
        {{{"byteLength", bytes_.size()}, {"uri", "data:application/octet-stream;base64," + base64()}}});
    return dump() + "\n";
  }

 private:
  std::string bytes_;

  std::string dump() const { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

  static void put(std::string& file, std::uint32_t word) {
    for (int k = 0; k < 4; ++k) file.push_back(char(word >> (8 * k) & 0xff));
  }

  std::string base64() const {
    static const char digits[] = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    std::string text;
    text.reserve((bytes_.size() + 2) / 3 * 4);
    for (std::size_t i = 0; i < bytes_.size(); i += 3) {
      const std::size_t n = std::min<std::size_t>(3, bytes_.size() - i);
      std::uint32_t group = 0;
      for (std::size_t k = 0; k < 3; ++k) group = group << 8 | (k < n ? std::uint8_t(bytes_[i + k]) : 0);
      for (std::size_t k = 0; k < 4; ++k) text.push_back(k <= n ? digits[group >> (18 - 6 * k) & 63] : '=');
    }
    return text;
  }
};

// Positions relative to the frame's centre, which is the node's translation: single precision is spent on the
// scene and not on where it stands.
int add_positions(Asset& asset, const Solution& solution) {
  std::vector<float> positions;
  float low[3], high[3];
  std::fill_n(low, 3, std::numeric_limits<float>::infinity());
  std::fill_n(high, 3, -std::numeric_limits<float>::infinity());
  for (const glm::dvec3& p : solution.mesh.position_m)
    for (int c = 0; c < 3; ++c) {
      const float x = float(p[c] - solution.frame.centre[c]) + 0.0f;  // + 0: no negative zero
      positions.push_back(x);
      low[c] = std::min(low[c], x), high[c] = std::max(high[c], x);
    }
  const int accessor = asset.add(positions, "VEC3", 3, array_buffer);
  // A double written with all its digits reads back as the very float.
  asset.json["accessors"][accessor]["min"] = {double(low[0]), double(low[1]), double(low[2])};
  asset.json["accessors"][accessor]["max"] = {double(high[0]), double(high[1]), double(high[2])};
  return accessor;
}

int add_colours(Asset& asset, const Solution& solution) {
  const auto rgb = display_colours(solution).rgb;
  return asset.add(std::vector<float>(rgb.begin(), rgb.end()), "VEC3", 3, array_buffer);
}

// One or three bands are one attribute; other counts are one scalar attribute a band, numbered.
void add_quantity(Asset& asset, Json& attributes, const std::string& name, std::uint32_t bands,
                  std::size_t vertices, const std::vector<double>& values) {
  if (bands == 3) {
    std::vector<float> packed;
    packed.reserve(3 * vertices);
    for (std::size_t v = 0; v < vertices; ++v)
      for (std::size_t b = 0; b < 3; ++b) packed.push_back(float(values[b * vertices + v]));
    attributes[name] = asset.add(packed, "VEC3", 3, array_buffer);
    return;
  }
  for (std::size_t b = 0; b < bands; ++b) {
    const std::vector<float> one(values.begin() + std::ptrdiff_t(b * vertices),
                                 values.begin() + std::ptrdiff_t((b + 1) * vertices));
    attributes[bands == 1 ? name : fmt::format("{}_{}", name, b)] = asset.add(one, "SCALAR", 1, array_buffer);
  }
}

std::vector<double> vertex_radiosity(const Solution& solution) {
  const std::size_t vertices = solution.vertex_count();
  std::vector<double> radiosity(solution.bands * vertices);
  for (std::uint32_t band = 0; band < solution.bands; ++band)
    for (std::uint32_t v = 0; v < vertices; ++v)
      radiosity[band * vertices + v] = solution.vertex_radiosity(band, v, solution.mesh.receivers[v].surface);
  return radiosity;
}

// Corner numbers of each used material's elements, each a fan over its outline; a quad is split along its diagonal 0-2.
std::map<std::uint32_t, std::vector<std::uint32_t>> triangles_by_material(const Solution& solution) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> triangles;
  for (const Element& element : solution.mesh.elements) {
    const std::uint32_t polygon = solution.mesh.patches[element.patch].polygon;
    auto& list = triangles[solution.scene.polygons[polygon].material];
    const auto [v, vertices] = outline(element);
    for (std::uint32_t k = 2; k < vertices; ++k) list.insert(list.end(), {v[0], v[k - 1], v[k]});
  }
  return triangles;
}

Asset build(const Solution& solution) {
  const bool photometric = solution.scene.quantity == Quantity::photometric;
  Asset asset;
  Json& json = asset.json;
  json["asset"] = {{"version", "2.0"}, {"generator", std::string("clrad ") + version}};
  json["asset"]["extras"] = {{"quantity", photometric ? "photometric" : "radiometric"},
                             {"unit", photometric ? "lm/m^2" : "W/m^2"},
                             {"bands", solution.scene.bands}};
  json["extensionsUsed"] = {"KHR_materials_unlit"};
  json["scene"] = 0;
  json["scenes"] = Json::array({{{"nodes", {0}}}});
  const glm::dvec3& centre = solution.frame.centre;
  json["nodes"] =
      Json::array({{{"name", "radiosity"}, {"mesh", 0}, {"translation", {centre.x, centre.y, centre.z}}}});

  const std::size_t vertices = solution.vertex_count();
  Json attributes;
  attributes["POSITION"] = add_positions(asset, solution);
  attributes["COLOR_0"] = add_colours(asset, solution);
  add_quantity(asset, attributes, "_RADIOSITY", solution.bands, vertices, vertex_radiosity(solution));
  add_quantity(asset, attributes, "_IRRADIANCE", solution.bands, vertices, solution.vertex_irradiance);

  Json primitives = Json::array(), materials = Json::array();
  for (const auto& [index, triangles] : triangles_by_material(solution)) {
    const Material& material = solution.scene.materials[index];
    primitives.push_back({{"attributes", attributes},
                          {"indices", asset.add(triangles, "SCALAR", 1, element_array_buffer)},
                          {"material", materials.size()},
                          {"mode", mode_triangles}});
    materials.push_back(
        {{"name", material.name},
         {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}},
         {"extensions", {{"KHR_materials_unlit", Json::object()}}},
         {"extras",
          {{"reflectance", material.reflectance}, {"emitted_exitance", material.emitted_exitance}}}});
  }
  json["meshes"] = Json::array({{{"name", "radiosity"}, {"primitives", primitives}}});
  json["materials"] = materials;
  return asset;
}

}  // namespace

void write_gltf(const std::string& path, const Solution& solution) {
  const std::string ending = lower_ending(path);
  if (ending != ".glb" && ending != ".gltf")
    throw UsageError(fmt::format("cannot write {}: the ending of a glTF file is .glb or .gltf", path));
  if (solution.mesh.elements.empty())
    throw UsageError(fmt::format("cannot write {}: the mesh has no elements", path));
  Asset asset = build(solution);
  write_file(path, ending == ".glb" ? asset.glb() : asset.gltf());
}

}  // namespace clrad

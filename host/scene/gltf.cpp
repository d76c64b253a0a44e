#include "scene/gltf.hpp"

#include <fmt/format.h>

#include <clrad/error.hpp>
#include <cmath>
#include <cstring>
#include <filesystem>
#include <glm/geometric.hpp>
#include <glm/gtc/quaternion.hpp>
#include <glm/mat3x3.hpp>
#include <glm/mat4x4.hpp>
#include <numbers>

#include "output/json_depth.hpp"
#include "scene/gltf_geometry.hpp"
#include "scene/gltf_lights.hpp"
#include "scene/gltf_textures.hpp"
#include "scene/quads.hpp"
#include "scene/read_file.hpp"

namespace clrad {
namespace {

using Severity = Diagnostic::Severity;

// The JSON of a glTF or GLB file, whose chunks each begin with length and type.
std::string_view json_of(const std::string& bytes, bool binary) {
  constexpr std::size_t begin = 20;
  std::uint32_t length = 0;
  if (!binary) return bytes;
  if (bytes.size() < begin) return {};
  std::memcpy(&length, bytes.data() + 12, sizeof length);
  return std::string_view(bytes).substr(begin, length);
}

tinygltf::Model parse(const std::string& path, bool binary, GltfImages& images) {
  const std::string bytes = read_file(path);
  std::uint32_t container = 2;
  if (binary && bytes.size() >= 8) std::memcpy(&container, bytes.data() + 4, sizeof container);
  if (binary && bytes.starts_with("glTF") && container != 2)
    throw InputError(fmt::format("{}: is GLB of version {}; clrad reads version 2", path, container));
  if (nests_too_deeply(json_of(bytes, binary), nlohmann::json::input_format_t::json))
    throw InputError(fmt::format("{}: its JSON nests deeper than {} levels", path, deepest_json));
  tinygltf::Model model;
  tinygltf::TinyGLTF loader;
  loader.SetImageLoader(keep_gltf_image, &images);
  std::string error, warning;
  const std::string folder = std::filesystem::path(path).parent_path().string();
  const auto size = static_cast<unsigned int>(bytes.size());
  bool read = false;
  try {
    read = binary ? loader.LoadBinaryFromMemory(&model, &error, &warning,
                                                reinterpret_cast<const unsigned char*>(bytes.data()), size,
                                                folder)
                  : loader.LoadASCIIFromString(&model, &error, &warning, bytes.data(), size, folder);
  } catch (const std::exception& e) {  // the library's JSON parser throws on wrong types
    error = e.what();
  }
  if (!read) throw InputError(fmt::format("{}: is not valid glTF, or cut off: {}", path, one_line(error)));
  return model;
}

glm::dmat4 transform_of(const tinygltf::Node& node) {
  glm::dmat4 m(1.0);
  if (node.matrix.size() == 16) {
    for (int i = 0; i < 16; ++i) m[i / 4][i % 4] = node.matrix[std::size_t(i)];
    return m;
  }
  if (node.rotation.size() == 4) {
    const glm::dquat q(node.rotation[3], node.rotation[0], node.rotation[1], node.rotation[2]);
    m = glm::mat4_cast(glm::normalize(q));
  }
  if (node.scale.size() == 3) {
    for (int k = 0; k < 3; ++k) m[k] *= node.scale[std::size_t(k)];
  }
  if (node.translation.size() == 3)
    m[3] = {node.translation[0], node.translation[1], node.translation[2], 1.0};
  return m;
}

// A number of a material's extension; `otherwise` where it is not there.
double extension_number(const tinygltf::Material& material, const char* extension, const char* key,
                        double otherwise) {
  const auto found = material.extensions.find(extension);
  if (found == material.extensions.end() || !found->second.Has(key) || !found->second.Get(key).IsNumber())
    return otherwise;
  return found->second.Get(key).GetNumberAsDouble();
}

// Metals and glass rougher than this blur what they show so much that following one ray would mislead.
constexpr double kSharp = 0.2;
// What a rough metal reflects diffusely stays below what the solve allows.
constexpr double kBrightestRoughMetal = 0.99;

class Reader {
 public:
  Reader(const tinygltf::Model& model, RawScene& scene, const GltfImages& images)
      : model_(model), scene_(scene), textures_(model, scene, images) {}

  void read() {
    check_extensions();
    read_materials();
    std::vector<int> roots;
    if (!model_.scenes.empty()) {
      const bool given = model_.defaultScene >= 0 && std::size_t(model_.defaultScene) < model_.scenes.size();
      roots = model_.scenes[given ? std::size_t(model_.defaultScene) : 0].nodes;
    } else {
      std::vector<bool> child(model_.nodes.size(), false);
      for (const tinygltf::Node& node : model_.nodes) {
        for (const int c : node.children) {
          if (c >= 0 && std::size_t(c) < child.size()) child[std::size_t(c)] = true;
        }
      }
      for (std::size_t n = 0; n < child.size(); ++n) {
        if (!child[n]) roots.push_back(static_cast<int>(n));
      }
    }
    visited_.assign(model_.nodes.size(), false);
    for (const int root : roots) read_node(root, glm::dmat4(1.0), "the scene");
    // Materials with a texture that no primitive has, or that cannot be read, are not judged by their factor.
    for (std::size_t m = 0; m < named_.size(); ++m)
      if (!named_[m].item.empty() && scene_.materials[m].texture == no_texture)
        scene_.materials[m].reflectance.assign(3, 0.0);
  }

 private:
  void add(Severity severity, const char* rule, const std::string& item, std::string message) {
    scene_.add(severity, rule, {scene_.file, 0, item}, std::move(message));
  }

  void check_extensions() {
    for (const std::string& name : model_.extensionsRequired) {
      if (name.starts_with("KHR_materials_") || name.starts_with("KHR_texture_")) continue;
      if (name == "KHR_lights_punctual") continue;
      add(Severity::error, "extension", "",
          fmt::format("needs extension {}, which is not read; export without it", name));
    }
  }

  void read_materials() {
    for (std::size_t m = 0; m < model_.materials.size(); ++m) {
      const tinygltf::Material& theirs = model_.materials[m];
      const tinygltf::PbrMetallicRoughness& pbr = theirs.pbrMetallicRoughness;
      Material material;
      material.name = theirs.name.empty() ? fmt::format("material {}", m) : theirs.name;
      const std::string item = fmt::format("material \"{}\"", material.name);
      material.where = {scene_.file, 0, item};
      const double strength =
          extension_number(theirs, "KHR_materials_emissive_strength", "emissiveStrength", 1.0);
      const double metal = pbr.metallicFactor;
      const double glass =
          (1.0 - metal) * extension_number(theirs, "KHR_materials_transmission", "transmissionFactor", 0);
      const bool sharp = pbr.roughnessFactor <= kSharp;
      material.ior = extension_number(theirs, "KHR_materials_ior", "ior", material.ior);
      if (metal > 0 && sharp) material.specular.resize(3);
      if (glass != 0) material.transmission.resize(3);
      for (std::size_t k = 0; k < 3; ++k) {
        const double base = k < pbr.baseColorFactor.size() ? pbr.baseColorFactor[k] : 1.0;
        const double factor = k < theirs.emissiveFactor.size() ? theirs.emissiveFactor[k] : 0.0;
        const double radiance_nit = factor * strength;
        double diffuse = base * (1.0 - metal - glass);
        if (metal > 0 && sharp) material.specular[k] = base * metal;
        if (metal > 0 && !sharp) diffuse = std::min(diffuse + base * metal, kBrightestRoughMetal);
        if (glass != 0) material.transmission[k] = base * glass;
        material.reflectance.push_back(diffuse);
        material.emitted_exitance.push_back(std::numbers::pi * radiance_nit);
        if (radiance_nit != 0) scene_.quantity = Quantity::photometric;
      }
      if (metal > 0 && !sharp) {
        add(Severity::warning, "rough-metal", item,
            fmt::format("it is a metal of roughness {:.3g}, over {}; what it reflects is taken as diffuse, "
                        "at most {}",
                        pbr.roughnessFactor, kSharp, kBrightestRoughMetal));
      }
      if (glass > 0 && !sharp) {
        add(Severity::warning, "rough-glass", item,
            fmt::format("it transmits with roughness {:.3g}, over {}; it is taken as clear",
                        pbr.roughnessFactor, kSharp));
      }
      if (pbr.baseColorTexture.index >= 0) read_base_colour(pbr, material, item);
      if (theirs.emissiveTexture.index >= 0 || pbr.metallicRoughnessTexture.index >= 0) {
        add(Severity::warning, "texture-ignored", item,
            "its textures of emission, metalness and roughness are ignored; the factors count");
      }
      if (theirs.alphaMode != "OPAQUE" && !theirs.alphaMode.empty()) {
        add(Severity::warning, "transparency-ignored", item, "it is transparent; it is taken as opaque");
      }
      material.two_sided = theirs.doubleSided;
      if (theirs.doubleSided && glass > 0) {
        add(Severity::warning, "double-sided", item,
            "it is double-sided glass: rays pass both of its sides, but only the front reflects diffusely");
      }
      scene_.materials.push_back(std::move(material));
    }
  }

  // The texture of what a material reflects diffusely.
  void read_base_colour(const tinygltf::PbrMetallicRoughness& pbr, Material& material,
                        const std::string& item) {
    const auto dark = [](const std::vector<double>& v) {
      return std::all_of(v.begin(), v.end(), [](double x) { return x == 0; });
    };
    if (!material.specular.empty() || !material.transmission.empty())
      add(Severity::warning, "texture-ignored", item,
          "its texture colours what it reflects diffusely alone; what it mirrors or transmits has the "
          "factor's colour");
    if (dark(material.reflectance)) return;
    named_.resize(scene_.materials.size() + 1);
    named_.back() = {&pbr.baseColorTexture, item};
  }

  // The texture of a material that a primitive has, read when the first one asks; null without one.
  const tinygltf::TextureInfo* use_texture(std::uint32_t material) {
    if (material >= named_.size() || !named_[material].info) return nullptr;
    NamedTexture& named = named_[material];
    std::uint32_t& texture = scene_.materials[material].texture;
    if (texture != no_texture) return named.info;
    try {
      texture = textures_.number_of(named.info->index);
      return named.info;
    } catch (const GltfFault& fault) {
      add(Severity::error, fault.rule.c_str(), named.item, fault.what());
    } catch (const InputError& error) {
      add(Severity::error, "texture", named.item, error.what());
    }
    named.info = nullptr;  // said once
    return nullptr;
  }

  std::string item_of(int index) const {
    const std::string& name = model_.nodes[std::size_t(index)].name;
    return name.empty() ? fmt::format("node {}", index) : fmt::format("node \"{}\"", name);
  }

  // Parents come before children; a node met twice hangs in a cycle or under two parents, which glTF forbids.
  void read_node(int root, const glm::dmat4& parent, const std::string& root_from) {
    struct Visit {
      int node;
      glm::dmat4 parent;
      std::string from;
    };
    std::vector<Visit> waiting = {{root, parent, root_from}};
    while (!waiting.empty()) {
      const Visit visit = waiting.back();
      waiting.pop_back();
      if (visit.node < 0 || std::size_t(visit.node) >= model_.nodes.size()) {
        add(Severity::error, "reference", visit.from, fmt::format("node {} does not exist", visit.node));
        continue;
      }
      const std::string item = item_of(visit.node);
      if (visited_[std::size_t(visit.node)]) {
        add(Severity::error, "node-cycle", item, "is reached twice; a node has one parent and no cycle");
        continue;
      }
      visited_[std::size_t(visit.node)] = true;
      const tinygltf::Node& node = model_.nodes[std::size_t(visit.node)];
      const glm::dmat4 world = visit.parent * transform_of(node);
      if (node.mesh >= 0) read_mesh(node, world, item);
      if (node.camera >= 0) read_camera(node, world, item);
      read_light_of(node, world, item);
      for (auto child = node.children.rbegin(); child != node.children.rend(); ++child) {
        waiting.push_back({*child, world, item});
      }
    }
  }

  void read_light_of(const tinygltf::Node& node, const glm::dmat4& world, const std::string& item) {
    try {
      if (auto light = read_light(model_, node, world, {scene_.file, 0, item}, scene_))
        scene_.lights.push_back(std::move(*light));
    } catch (const GltfFault& fault) {
      add(Severity::error, fault.rule.c_str(), item, fault.what());
    }
  }

  void read_mesh(const tinygltf::Node& node, const glm::dmat4& world, const std::string& node_item) {
    if (std::size_t(node.mesh) >= model_.meshes.size()) {
      return add(Severity::error, "reference", node_item, fmt::format("mesh {} does not exist", node.mesh));
    }
    const tinygltf::Mesh& mesh = model_.meshes[std::size_t(node.mesh)];
    if (node.skin >= 0) {
      add(Severity::warning, "deformation-ignored", node_item,
          "its skin is ignored; the mesh is taken as it rests");
    }
    for (std::size_t p = 0; p < mesh.primitives.size(); ++p) {
      const std::string item = fmt::format("{}, primitive {}", node_item, p);
      try {
        read_primitive(mesh.primitives[p], world, item, node.name.empty() ? mesh.name : node.name);
      } catch (const GltfFault& fault) {
        add(Severity::error, fault.rule.c_str(), item, fault.what());
      }
    }
  }

  void read_primitive(const tinygltf::Primitive& primitive, const glm::dmat4& world, const std::string& item,
                      const std::string& name) {
    if (primitive.mode != -1 &&
        (primitive.mode < TINYGLTF_MODE_TRIANGLES || primitive.mode > TINYGLTF_MODE_TRIANGLE_FAN)) {
      return add(Severity::warning, "primitive-ignored", item,
                 "points and lines are ignored; only triangles count");
    }
    if (!primitive.targets.empty()) {
      add(Severity::warning, "deformation-ignored", item, "its morph targets are ignored");
    }
    const std::uint32_t material = material_of(primitive.material, item);
    const std::vector<glm::dvec3> positions = read_positions(model_, primitive);
    // A mirroring transform turns fronts into backs; glTF 2.0, section 3.7.4, says to take the winding the
    // other way.
    const bool mirrored = glm::determinant(glm::dmat3(world)) < 0;
    std::vector<std::array<glm::dvec3, 3>> triangles;
    std::vector<glm::dvec2> coordinates;
    std::vector<std::array<glm::dvec2, 3>> uv;
    if (const tinygltf::TextureInfo* info = use_texture(material)) {
      const GltfUvMap map = uv_map_of(*info);
      coordinates = read_texture_coordinates(model_, primitive, map.set, positions.size());
      for (glm::dvec2& c : coordinates) c = map(c);
    }
    for (const auto& index : read_triangles(model_, primitive, positions.size())) {
      std::array<glm::dvec3, 3> triangle;
      for (std::size_t i = 0; i < 3; ++i) {
        const glm::dvec3& p = positions[index[mirrored ? (3 - i) % 3 : i]];
        triangle[i] = glm::dvec3(world * glm::dvec4(p, 1.0));
      }
      triangles.push_back(triangle);
      if (coordinates.empty()) continue;
      uv.emplace_back();
      for (std::size_t i = 0; i < 3; ++i) uv.back()[i] = coordinates[index[mirrored ? (3 - i) % 3 : i]];
    }
    for (const MergedFace& merged : merge_quads(triangles, uv)) {
      RawFace face;
      face.first = static_cast<std::uint32_t>(scene_.corners.size());
      face.corners = merged.count;
      face.material = material;
      face.name = name;
      face.where = {scene_.file, 0, item};
      for (std::uint32_t i = 0; i < merged.count; ++i) scene_.corners.push_back(merged.corner[i]);
      if (!scene_.textures.empty()) scene_.uv.resize(scene_.corners.size(), glm::dvec2(0));
      face.has_uv = !uv.empty();
      if (face.has_uv)
        std::copy_n(merged.uv.begin(), merged.count, scene_.uv.begin() + std::ptrdiff_t(face.first));
      scene_.faces.push_back(std::move(face));
    }
  }

  std::uint32_t material_of(int index, const std::string& item) {
    if (index >= 0 && std::size_t(index) < model_.materials.size()) return static_cast<std::uint32_t>(index);
    if (index >= 0) throw GltfFault("reference", fmt::format("material {} does not exist", index));
    if (default_material_ < 0) {
      default_material_ = static_cast<int>(scene_.materials.size());
      scene_.materials.push_back(
          {"default", std::vector(3, kDefaultReflectance), std::vector(3, 0.0), {scene_.file, 0, item}});
    }
    add(Severity::warning, "no-material", item,
        fmt::format("has no material; reflectance {} is assumed", kDefaultReflectance));
    return static_cast<std::uint32_t>(default_material_);
  }

  void read_camera(const tinygltf::Node& node, const glm::dmat4& world, const std::string& item) {
    if (std::size_t(node.camera) >= model_.cameras.size()) {
      return add(Severity::error, "reference", item, fmt::format("camera {} does not exist", node.camera));
    }
    const tinygltf::Camera& theirs = model_.cameras[std::size_t(node.camera)];
    const double angle = theirs.perspective.yfov;
    if (theirs.type != "perspective" || !(angle > 0 && angle < std::numbers::pi)) {
      return add(Severity::warning, "camera-ignored", item,
                 "only perspective cameras with yfov between 0 and pi are used");
    }
    const glm::dvec3 back(world[2]), up(world[1]), eye(world[3]);
    const double length = glm::length(back) * glm::length(up), size = glm::length(eye);
    if (!(length > 0) || !std::isfinite(length) || !std::isfinite(size)) {
      return add(Severity::warning, "camera-ignored", item,
                 "its node's transform leaves no direction to look along");
    }
    Camera camera;
    camera.name = node.name.empty() ? theirs.name : node.name;
    camera.eye = eye;
    camera.target = eye - glm::normalize(back);  // it looks along its -Z
    camera.up = glm::normalize(up);
    camera.vertical_field_of_view_rad = angle;
    scene_.cameras.push_back(std::move(camera));
  }

  const tinygltf::Model& model_;
  RawScene& scene_;
  GltfTextures textures_;
  struct NamedTexture {
    const tinygltf::TextureInfo* info = nullptr;
    std::string item;
  };
  std::vector<NamedTexture> named_;  // of the materials up to the last with a texture
  std::vector<bool> visited_;
  int default_material_ = -1;
};

}  // namespace

RawScene read_gltf(const std::string& path, bool binary) {
  RawScene scene;
  scene.file = path;
  GltfImages images;
  const tinygltf::Model model = parse(path, binary, images);
  Reader(model, scene, images).read();
  return scene;
}

}  // namespace clrad

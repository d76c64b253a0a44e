#include "scene/obj.hpp"

#include <fmt/format.h>
#include <tiny_obj_loader.h>

#include <algorithm>
#include <clrad/error.hpp>
#include <cmath>
#include <filesystem>
#include <map>
#include <numbers>
#include <set>
#include <sstream>

#include "scene/obj_lines.hpp"
#include "scene/range.hpp"
#include "scene/read_file.hpp"
#include "scene/texture.hpp"

namespace clrad {
namespace {

using Severity = Diagnostic::Severity;

static_assert(sizeof(tinyobj::real_t) == sizeof(double), "tinyobjloader must be built in double");

constexpr std::uint32_t kNoMaterial = ~0u;

Material material_of(const MtlMaterial& m, const std::string& file) {
  Material material;
  material.name = m.name;
  material.where = {file, m.reflectance_line > 0 ? m.reflectance_line : m.line, ""};
  for (int k = 0; k < 3; ++k) {
    material.reflectance.push_back(m.reflectance[k]);
    material.emitted_exitance.push_back(std::numbers::pi * m.radiance[k]);
  }
  if (m.is_mirror()) material.specular.assign(m.mirrored.begin(), m.mirrored.end());
  if (m.is_glass()) {
    material.ior = m.ior;
    // Exporters write Tf or d or neither; glass of which nothing is said is clear.
    for (int k = 0; k < 3; ++k)
      material.transmission.push_back(m.filtered       ? (*m.filtered)[k]
                                      : m.dissolve < 1 ? 1 - m.dissolve
                                                       : 1 - m.reflectance[k]);
  }
  return material;
}

// From `vt` to places in the texture: -s and -o of map_Kd, and rows from the top.
struct ObjUvMap {
  glm::dvec2 offset{0}, scale{1};
  glm::dvec2 operator()(const glm::dvec2& uv) const {
    const glm::dvec2 moved = uv * scale + offset;
    return {moved.x, 1 - moved.y};
  }
};

// Hands MTL files to tinyobjloader and keeps what it does not: lines, exact numbers, missing files.
class MtlReader : public tinyobj::MaterialReader {
 public:
  MtlReader(RawScene& scene, const ObjLines& lines) : scene_(scene), lines_(lines) {}

  // Always false: after true the library would skip the other files of the same `mtllib` line.
  bool operator()(const std::string& word, std::vector<tinyobj::material_t>* materials,
                  std::map<std::string, int>* index_of, std::string* warn, std::string* err) override {
    if (word.empty()) return false;
    const std::string name = name_with_blanks(word);
    if (!read_.insert(name).second) return false;
    const std::string file = beside(name);
    std::string text;
    try {
      text = with_plain_lines(read_file(file));
    } catch (const InputError& error) {
      missing_ = true;
      scene_.add(Severity::error, "material-file", {scene_.file, line_of(name), ""},
                 fmt::format("material file {}; put it there or correct the mtllib line", error.what()));
      return false;
    }
    const std::size_t first = materials->size();
    std::istringstream stream(text);
    tinyobj::LoadMtl(index_of, materials, &stream, warn, err);
    keep(file, text, *materials, first);
    return false;
  }

  bool missing() const { return missing_; }
  // The scene's material of each of the library's.
  const std::vector<std::uint32_t>& scene_material() const { return scene_material_; }

  // Materials with a texture that no face has, or that cannot be read, are not judged by their factor.
  void put_aside_unused() {
    for (std::size_t m = 0; m < named_.size(); ++m)
      if (named_[m].named && scene_.materials[m].texture == no_texture)
        scene_.materials[m].reflectance.assign(3, 0.0);
  }

  // How a face of this material lies in its texture, which is read when the first one asks; null without one.
  const ObjUvMap* texture_of(std::uint32_t number) {
    if (number >= named_.size() || named_[number].path.empty()) return nullptr;
    NamedTexture& named = named_[number];
    if (scene_.materials[number].texture != no_texture) return &named.map;
    const auto [found, is_new] =
        textures_.try_emplace({named.path, named.wrap}, std::uint32_t(scene_.textures.size()));
    if (is_new) {
      try {
        scene_.textures.push_back(read_texture(named.path));
        scene_.textures.back().wrap = {named.wrap, named.wrap};
      } catch (const InputError& error) {
        textures_.erase(found);
        scene_.add(Severity::error, "texture", named.where,
                   fmt::format("{}; put it there or correct the map_Kd line", error.what()));
        named.path.clear();  // said once
        return nullptr;
      }
    }
    scene_.materials[number].texture = found->second;
    return &named.map;
  }

 private:
  std::string beside(const std::string& name) const {
    return (std::filesystem::path(scene_.file).parent_path() / name).string();
  }

  // The library splits a `mtllib` line at blanks. Where the whole line names a file, that is the file.
  std::string name_with_blanks(const std::string& word) const {
    for (const ObjNameLine& mtllib : lines_.mtllib) {
      std::error_code ignored;
      const bool inside = mtllib.name.find(word) != std::string::npos && mtllib.name.size() > word.size();
      if (inside && std::filesystem::is_regular_file(beside(mtllib.name), ignored)) return mtllib.name;
    }
    return word;
  }

  std::uint32_t line_of(const std::string& name) const {
    for (const ObjNameLine& mtllib : lines_.mtllib) {
      if (mtllib.name.find(name) != std::string::npos) return mtllib.line;
    }
    return lines_.mtllib.empty() ? 0 : lines_.mtllib.front().line;
  }

  void keep(const std::string& file, const std::string& text, const std::vector<tinyobj::material_t>& theirs,
            std::size_t first) {
    const std::vector<MtlMaterial> ours = scan_mtl(file, text, scene_);
    // The library makes one without a name of a file that defines none.
    scene_material_.resize(theirs.size(), kNoMaterial);
    std::size_t k = first;
    for (const MtlMaterial& m : ours) {
      const SourceLocation where{file, m.line, ""};
      if (!names_.insert(m.name).second) {
        scene_.add(Severity::warning, "duplicate-material", where,
                   fmt::format("material \"{}\" is defined again; the first definition holds", m.name));
      }
      // Theirs has the same materials in the same order, with the rest of the newmtl line as the name.
      while (k < theirs.size() && !theirs[k].name.starts_with(m.name)) ++k;
      if (k < theirs.size()) {
        warn_of(theirs[k], m, where);
        scene_material_[k] = static_cast<std::uint32_t>(scene_.materials.size());
      }
      scene_.materials.push_back(material_of(m, file));
      if (k < theirs.size()) read_texture_of(theirs[k++], m, file);
      if (m.is_mirror() || m.is_glass()) {
        for (const Diagnostic& finding : m.specular_findings) scene_.diagnostics.push_back(finding);
      }
      const bool sound = std::all_of(m.radiance.begin(), m.radiance.end(), [](double l) {
        const double exitance = std::numbers::pi * l;
        return l == 0 || (exitance >= smallest_exitance && exitance <= largest_exitance);
      });
      if (!sound) scene_.materials.back().where.line = m.radiance_line;
    }
  }

  // The texture of the last material. Kd multiplies it; a file with a texture that does not say Kd means 1.
  void read_texture_of(const tinyobj::material_t& theirs, const MtlMaterial& m, const std::string& file) {
    if (theirs.diffuse_texname.empty() || m.texture_line == 0) return;
    Material& material = scene_.materials.back();
    const SourceLocation where{file, m.texture_line, ""};
    if (m.reflectance_line == 0) material.reflectance.assign(3, 1.0);  // until put_aside_unused()
    if (std::all_of(material.reflectance.begin(), material.reflectance.end(),
                    [](double x) { return x == 0; })) {
      scene_.add(Severity::warning, "texture-ignored", where,
                 fmt::format("Kd of material \"{}\" is 0, and it multiplies the texture: black", m.name));
      return;
    }
    const tinyobj::texture_option_t& options = theirs.diffuse_texopt;
    const double turbulence = std::abs(options.turbulence[0]) + std::abs(options.turbulence[1]);
    if (options.brightness != 0 || options.contrast != 1 || turbulence > 0)
      scene_.add(
          Severity::warning, "texture-option-ignored", where,
          fmt::format("of the options of map_Kd of material \"{}\" only -o, -s and -clamp are followed",
                      m.name));
    std::string name = theirs.diffuse_texname;
    std::replace(name.begin(), name.end(), '\\', '/');
    named_.resize(scene_.materials.size());
    named_.back() = {
        (std::filesystem::path(file).parent_path() / name).string(),
        options.clamp ? Wrap::clamp : Wrap::repeat,
        {{options.origin_offset[0], options.origin_offset[1]}, {options.scale[0], options.scale[1]}},
        where,
        true};
  }

  void warn_of(const tinyobj::material_t& theirs, const MtlMaterial& m, const SourceLocation& where) {
    if (!theirs.emissive_texname.empty()) {
      scene_.add(Severity::warning, "texture-ignored", where,
                 fmt::format("the texture of the emission of material \"{}\" is ignored; Ke counts", m.name));
    }
    if (theirs.dissolve < 1 && !m.is_glass()) {
      scene_.add(Severity::warning, "transparency-ignored", where,
                 fmt::format("material \"{}\" is transparent; it is taken as opaque", m.name));
    }
    if (m.reflectance_line == 0 && m.radiance_line == 0 && m.texture_line == 0 && !m.is_mirror() &&
        !m.is_glass()) {
      scene_.add(Severity::warning, "no-reflectance", where,
                 fmt::format("material \"{}\" has neither Kd nor Ke; it is black", m.name));
    }
  }

  RawScene& scene_;
  const ObjLines& lines_;
  std::set<std::string> read_, names_;
  std::vector<std::uint32_t> scene_material_;
  std::map<std::pair<std::string, Wrap>, std::uint32_t> textures_;
  struct NamedTexture {
    std::string path;  // empty: none
    Wrap wrap{};
    ObjUvMap map;
    SourceLocation where;
    bool named = false;
  };
  std::vector<NamedTexture> named_;  // of the materials up to the last with a texture
  bool missing_ = false;
};

// Where the corners of the last face are in its material's texture.
void read_uv(RawScene& scene, const ObjLines& lines, const ObjFaceLine& line, const ObjUvMap& map,
             RawFace& face) {
  scene.uv.resize(scene.corners.size(), glm::dvec2(0));
  if (lines.uv_of_corner.empty()) return;
  for (std::uint32_t i = 0; i < face.corners; ++i) {
    const std::uint32_t at = lines.uv_of_corner[line.first_uv + i];
    if (at == ObjLines::no_uv) return;
    if (at == ObjLines::wrong_uv) {
      scene.add(Severity::error, "texture-index", face.where,
                fmt::format("corner {} names texture coordinates that there are not; there are {} vt", i + 1,
                            lines.uv.size()));
      return;
    }
    scene.uv[face.first + i] = map(lines.uv[at]);
  }
  face.has_uv = true;
}

// Gives faces without a material the default one, and reports materials that no file defines.
class MaterialChoice {
 public:
  MaterialChoice(RawScene& scene, const ObjLines& lines, const MtlReader& reader)
      : scene_(scene), lines_(lines), reader_(reader) {}

  std::uint32_t operator()(const ObjFaceLine& face, int theirs) {
    if (theirs >= 0 && reader_.scene_material()[static_cast<std::size_t>(theirs)] != kNoMaterial)
      return reader_.scene_material()[static_cast<std::size_t>(theirs)];
    if (face.usemtl >= 0) report_unknown(lines_.usemtl[static_cast<std::size_t>(face.usemtl)]);
    if (default_ == kNoMaterial) {
      default_ = static_cast<std::uint32_t>(scene_.materials.size());
      const SourceLocation where{scene_.file, face.line, ""};
      scene_.materials.push_back(
          {"default", std::vector(3, kDefaultReflectance), std::vector(3, 0.0), where});
      if (face.usemtl < 0) {
        scene_.add(Severity::warning, "no-material", where,
                   fmt::format("faces from here on have no material; reflectance {} is assumed",
                               kDefaultReflectance));
      }
    }
    return default_;
  }

 private:
  void report_unknown(const ObjNameLine& usemtl) {
    if (reader_.missing() || !reported_.insert(usemtl.name).second) return;
    scene_.add(
        Severity::error, "material-not-found", {scene_.file, usemtl.line, ""},
        fmt::format(
            "no material file read before this line defines \"{}\"; add it there, or a mtllib line above",
            usemtl.name));
  }

  RawScene& scene_;
  const ObjLines& lines_;
  const MtlReader& reader_;
  std::uint32_t default_ = kNoMaterial;
  std::set<std::string> reported_;
};

}  // namespace

RawScene read_obj(const std::string& path) {
  RawScene scene;
  scene.file = path;
  std::string bytes = read_file(path);
  if (bytes.find('\0') != std::string::npos) throw InputError(path + ": is not a text file, so not OBJ");
  const ObjLines lines = scan_obj(std::move(bytes), scene);

  tinyobj::attrib_t attributes;
  std::vector<tinyobj::shape_t> shapes;
  std::vector<tinyobj::material_t> materials;
  std::string warn, err;
  MtlReader reader(scene, lines);
  std::istringstream stream(lines.text);
  const bool triangulate = false, default_colors = false;
  if (!tinyobj::LoadObj(&attributes, &shapes, &materials, &warn, &err, &stream, &reader, triangulate,
                        default_colors)) {
    throw InputError(fmt::format("{}: {}", path, one_line(err)));
  }

  MaterialChoice material(scene, lines, reader);
  std::size_t number = 0;
  for (const tinyobj::shape_t& shape : shapes) {
    std::size_t next = 0;
    for (std::size_t f = 0; f < shape.mesh.num_face_vertices.size(); ++f, ++number) {
      if (number >= lines.faces.size())
        throw InputError(path + ": its faces cannot be told apart line by line");
      RawFace face;
      face.first = static_cast<std::uint32_t>(scene.corners.size());
      face.corners = shape.mesh.num_face_vertices[f];
      face.material = material(lines.faces[number], shape.mesh.material_ids[f]);
      face.name = shape.name;
      face.where = {path, lines.faces[number].line, ""};
      for (std::uint32_t i = 0; i < face.corners; ++i) {
        scene.corners.push_back(
            lines.vertices.at(static_cast<std::size_t>(shape.mesh.indices[next++].vertex_index)));
      }
      if (const ObjUvMap* map = reader.texture_of(face.material))
        read_uv(scene, lines, lines.faces[number], *map, face);
      else if (!scene.textures.empty())
        scene.uv.resize(scene.corners.size(), glm::dvec2(0));
      scene.faces.push_back(std::move(face));
    }
  }
  reader.put_aside_unused();
  if (number != lines.faces.size()) throw InputError(path + ": its faces cannot be told apart line by line");
  return scene;
}

}  // namespace clrad

#include "scene/gltf_textures.hpp"

#include <fmt/format.h>

#include <cmath>
#include <filesystem>

#include "scene/gltf_geometry.hpp"
#include "scene/texture.hpp"

namespace clrad {
namespace {

Wrap wrap_of(int word) {
  return word == TINYGLTF_TEXTURE_WRAP_CLAMP_TO_EDGE     ? Wrap::clamp
         : word == TINYGLTF_TEXTURE_WRAP_MIRRORED_REPEAT ? Wrap::mirror
                                                         : Wrap::repeat;
}

}  // namespace

bool keep_gltf_image(tinygltf::Image*, int number, std::string*, std::string*, int, int,
                     const unsigned char* bytes, int size, void* images) {
  if (size > 0)
    (*static_cast<GltfImages*>(images))[number].assign(reinterpret_cast<const char*>(bytes),
                                                       std::size_t(size));
  return true;
}

std::uint32_t GltfTextures::number_of(int index) {
  if (std::size_t(index) >= model_.textures.size())
    throw GltfFault("reference", fmt::format("texture {} does not exist", index));
  const tinygltf::Texture& theirs = model_.textures[std::size_t(index)];
  if (theirs.source < 0 || std::size_t(theirs.source) >= model_.images.size())
    throw GltfFault("texture",
                    fmt::format("texture {} has no image of a format that is read (PNG, JPEG)", index));
  std::array<Wrap, 2> wrap = {Wrap::repeat, Wrap::repeat};
  if (theirs.sampler >= 0 && std::size_t(theirs.sampler) < model_.samplers.size()) {
    const tinygltf::Sampler& sampler = model_.samplers[std::size_t(theirs.sampler)];
    wrap = {wrap_of(sampler.wrapS), wrap_of(sampler.wrapT)};
  }
  const auto key = std::tuple(theirs.source, wrap[0], wrap[1]);
  const auto found = known_.find(key);
  if (found != known_.end()) return found->second;
  const tinygltf::Image& image = model_.images[std::size_t(theirs.source)];
  const bool embedded = image.uri.empty() || image.uri.starts_with("data:");
  const std::string name = !embedded ? (std::filesystem::path(scene_.file).parent_path() / image.uri).string()
                           : image.name.empty() ? fmt::format("image {} of {}", theirs.source, scene_.file)
                                                : fmt::format("image \"{}\" of {}", image.name, scene_.file);
  const auto bytes = images_.find(theirs.source);
  if (bytes == images_.end())
    throw GltfFault("texture", fmt::format("{}: cannot be read; put it there or correct the uri", name));
  Texture texture = decode_texture(bytes->second, name);
  texture.wrap = wrap;
  const auto number = std::uint32_t(scene_.textures.size());
  scene_.textures.push_back(std::move(texture));
  known_.emplace(key, number);
  return number;
}

glm::dvec2 GltfUvMap::operator()(const glm::dvec2& uv) const {
  const glm::dvec2 s = uv * scale;
  const double c = std::cos(turn_rad), t = std::sin(turn_rad);
  return {c * s.x + t * s.y + offset.x, c * s.y - t * s.x + offset.y};
}

GltfUvMap uv_map_of(const tinygltf::TextureInfo& info) {
  GltfUvMap map;
  map.set = info.texCoord;
  const auto found = info.extensions.find("KHR_texture_transform");
  if (found == info.extensions.end()) return map;
  const tinygltf::Value& transform = found->second;
  const auto pair = [&](const char* key, glm::dvec2& to) {
    if (!transform.Has(key) || transform.Get(key).ArrayLen() != 2) return;
    for (int k = 0; k < 2; ++k)
      if (transform.Get(key).Get(k).IsNumber()) to[k] = transform.Get(key).Get(k).GetNumberAsDouble();
  };
  pair("offset", map.offset), pair("scale", map.scale);
  if (transform.Has("rotation") && transform.Get("rotation").IsNumber())
    map.turn_rad = transform.Get("rotation").GetNumberAsDouble();
  if (transform.Has("texCoord") && transform.Get("texCoord").IsInt())
    map.set = transform.Get("texCoord").GetNumberAsInt();
  return map;
}

}  // namespace clrad

/// Textures of a glTF model: its images, its samplers, and the coordinates that KHR_texture_transform moves.
#pragma once
#include <tiny_gltf.h>

#include <glm/vec2.hpp>
#include <map>
#include <string>
#include <tuple>

#include "scene/raw_scene.hpp"

namespace clrad {

/// Images as they come, not decoded, since most of them will not be used: their bytes by their number.
using GltfImages = std::map<int, std::string>;
/// For tinygltf's loader, with a GltfImages as its user data.
bool keep_gltf_image(tinygltf::Image*, int number, std::string*, std::string*, int, int,
                     const unsigned char* bytes, int size, void* images);

class GltfTextures {
 public:
  GltfTextures(const tinygltf::Model& model, RawScene& scene, const GltfImages& images)
      : model_(model), scene_(scene), images_(images) {}

  /// The number in RawScene::textures of the model's texture `index`, which is decoded when it is first asked for. Throws
  /// GltfFault, and InputError where the image cannot be read.
  std::uint32_t number_of(int index);

 private:
  const tinygltf::Model& model_;
  RawScene& scene_;
  const GltfImages& images_;
  std::map<std::tuple<int, Wrap, Wrap>, std::uint32_t> known_;
};

/// From a set of coordinates to places in the texture: scaled, then turned, then moved. What KHR_texture_transform calls
/// counter-clockwise is so where v points down, as its first example shows.
struct GltfUvMap {
  int set = 0;
  glm::dvec2 offset{0}, scale{1};
  double turn_rad = 0;
  glm::dvec2 operator()(const glm::dvec2& uv) const;
};
GltfUvMap uv_map_of(const tinygltf::TextureInfo& info);

}  // namespace clrad

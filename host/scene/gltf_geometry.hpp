/// Accessors and triangles of a glTF mesh primitive, with every bound checked.
#pragma once
#include <tiny_gltf.h>

#include <array>
#include <cstdint>
#include <glm/vec2.hpp>
#include <glm/vec3.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace clrad {

/// What is wrong with a part of a glTF file; the reader turns it into a finding.
struct GltfFault : std::runtime_error {
  GltfFault(std::string the_rule, const std::string& message)
      : std::runtime_error(message), rule(std::move(the_rule)) {}
  std::string rule;
};

/// The positions of a primitive, in double. Throws GltfFault.
std::vector<glm::dvec3> read_positions(const tinygltf::Model& model, const tinygltf::Primitive& primitive);

/// Texture coordinates of set `set` (TEXCOORD_n), floats or whole numbers that stand for [0, 1]; none where the primitive has
/// no such set. Throws GltfFault, also when there are not as many as `vertices`.
std::vector<glm::dvec2> read_texture_coordinates(const tinygltf::Model& model,
                                                 const tinygltf::Primitive& primitive, int set,
                                                 std::size_t vertices);

/// Vertex numbers of its triangles, each below `vertices`; strips and fans unrolled with the winding of
/// glTF 2.0, section 3.7.2.1. Throws GltfFault.
std::vector<std::array<std::uint32_t, 3>> read_triangles(const tinygltf::Model& model,
                                                         const tinygltf::Primitive& primitive,
                                                         std::size_t vertices);

}  // namespace clrad

/// Accessors and triangles of a glTF mesh primitive, with every bound checked.
#pragma once
#include <tiny_gltf.h>

#include <array>
#include <cstdint>
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

/// Vertex numbers of its triangles, each below `vertices`; strips and fans unrolled with the winding of
/// glTF 2.0, section 3.7.2.1. Throws GltfFault.
std::vector<std::array<std::uint32_t, 3>> read_triangles(const tinygltf::Model& model,
                                                         const tinygltf::Primitive& primitive,
                                                         std::size_t vertices);

}  // namespace clrad

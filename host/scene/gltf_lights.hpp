/// Lights of glTF's KHR_lights_punctual.
#pragma once
#include <tiny_gltf.h>

#include <glm/mat4x4.hpp>
#include <optional>

#include "scene/raw_scene.hpp"

namespace clrad {

/// The light at a node, if it has one, in the file's units of length: three bands, colour x intensity. `world` is the node's
/// transform, `where` the node. Adds warnings to `scene`, and makes it photometric. Throws GltfFault.
std::optional<PunctualLight> read_light(const tinygltf::Model& model, const tinygltf::Node& node,
                                        const glm::dmat4& world, const SourceLocation& where,
                                        RawScene& scene);

}  // namespace clrad

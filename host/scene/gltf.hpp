/// glTF 2.0 and GLB through tinygltf.
#pragma once
#include <string>

#include "scene/raw_scene.hpp"

namespace clrad {

/// Reads the default scene (else the first, else all root nodes): meshes of triangles, strips and fans, node
/// transforms applied in double, perspective cameras. Diffuse reflectance is baseColorFactor x (1 -
/// metallicFactor), less the share KHR_materials_transmission takes; what is metal mirrors baseColorFactor
/// up to roughness 0.2, and above counts as diffuse; glass has the index of KHR_materials_ior. With a baseColorTexture
/// (embedded or beside the file; wrap modes and KHR_texture_transform are followed) that is a factor of its texels.
/// Materials that are doubleSided are two-sided. emissiveFactor x KHR_materials_emissive_strength is radiance [cd/m^2]: E = pi L [lm/m^2],
/// and the scene is photometric as soon as one material emits. Triangle pairs that form a planar convex quad
/// are merged (scene/quads.hpp). Throws InputError when the file cannot be read at all; findings about its
/// content are in RawScene::diagnostics with node and primitive:
///
/// accessor, index, reference, extension (a required one unknown), node-cycle    error
/// texture (missing, damaged or too large)       error
/// no-material, texture-ignored (all but that of the base colour), transparency-ignored, double-sided (glass), primitive-ignored, camera-ignored,
/// deformation-ignored (skins, morph targets), rough-metal, rough-glass          warning
RawScene read_gltf(const std::string& path, bool binary);

}  // namespace clrad

/// Wavefront OBJ with MTL. Structure (faces, groups, material assignment, relative indices) comes from
/// tinyobjloader; numbers are read again from the same lines, since the library rounds them to within a few
/// ulp only, replaces what it cannot read by zero, and does not say on which line a face stands.
#pragma once
#include <string>

#include "scene/raw_scene.hpp"

namespace clrad {

/// Reads `path` and the MTL files it names (beside it). `Kd` is reflectance, `Ke` radiance [W/(sr m^2)]: E =
/// pi Ke; a single number stands for all three bands. `illum` 3 and 5 are mirrors of `Ks`; 4, 6, 7 and 9 glass
/// of index `Ni` that passes `Tf`, else 1 - `d` where d < 1, else 1 - Kd, and reflects by Fresnel, not by Ks.
/// With any other `illum`, Ks is an exporter's highlight and not used. `map_Kd` is a texture (beside the MTL file; with
/// -o, -s and -clamp): its texels times Kd, as the format's own text has it, or times 1 where there is no Kd; `vt` are its
/// coordinates, v upwards. Throws InputError when the file cannot be read at all;
/// findings about its content are in RawScene::diagnostics with their line, and the elements they concern are
/// left out:
///
/// vertex, face-index, too-few-corners, too-many-corners (over 255), number      error
/// material-file (missing MTL), material-not-found, texture (missing, damaged or too large),
/// texture-index (a face with a texture names a vt that there is not)            error
/// no-material (reflectance 0.5 is assumed), no-reflectance (0 is assumed), duplicate-material,
/// texture-ignored (map_Ke), texture-option-ignored, transparency-ignored, element-ignored (points, lines,
/// curves)                                                                       warning
RawScene read_obj(const std::string& path);

}  // namespace clrad

/// From what a file says to a scene that can be solved, by rules that each leave a finding. Both readers
/// share it.
///
/// rule                  severity  when, and what is done
/// unit                  error     (UsageError) the unit is not a finite positive length
/// reflectance           error     a band of a reflectance is outside [0, 1) (with a texture: [0, 1]), or not a number
/// texture-reflectance   repair    texels reflect all light or more, with the material's factor: they reflect 0.99
/// texture-coordinate    error     a texture coordinate is not finite
/// no-texture-coordinates          warning   faces without them get the mean colour of their material's texture
/// emission              error     a band of an emission is negative, or not a finite number
/// specular              error     a mirrored or transmitted share is negative, or not a finite number
/// specular-share        repair    with the diffuse share they pass 1 in a band: both are scaled to what that leaves
/// ior                   repair    an index of refraction below 1, or not a number: 1.5 is used
/// too-few-corners       error     a face has fewer than three corners
/// coordinate            error     a coordinate of a corner or light is not finite, or beyond 1e100 m
/// self-intersecting     error     the sides of a face cross (a bow tie)
/// degenerate-face       repair    all corners on one line, within 4 ulp of the largest coordinate: dropped
/// repeated-corner       repair    a corner equals the one before it: left out
/// non-planar            repair    a quad whose diagonals pass by more than 1e-6 of the longer: cut along 0-2
///                                 (1-3 where corner 1 or 3 is not convex)
/// concave               repair    a quad with a reflex corner: cut from that corner
/// straight-corner       repair    a quad with a corner of 180 degrees (within 4 ulp): cut from that corner
/// many-corners          repair    more than four corners: cut into triangles, best-shaped ear first
/// duplicate-face        warning   the corners of an earlier polygon again, facing the same way
/// orientation           warning   a polygon faces against the others of its connected surface
/// inside-out            warning   a closed surface faces inward though empty, or outward though it holds all others
/// overlap               warning   (check only) a polygon lies on an earlier one of its plane that faces the same way
/// open-edges            warning   (check only) sides used by one polygon alone: count and the first five
/// no-polygons           error     nothing is left
/// no-emitter            warning   no polygon has an emitting material, and there is no light that shines
///
/// The readers' own rules stand where they are applied: of lights in gltf_lights.cpp, of sizes and powers in range.hpp.
#pragma once
#include <clrad/scene.hpp>

#include "scene/raw_scene.hpp"

namespace clrad {

/// Applies the rules above. All findings, those of the reader included, are in Scene::diagnostics, in file
/// order; polygons with an error are left out. Materials come out with one band ("grey") when none of their
/// values differs between the three, else with three.
Scene validate(RawScene raw, double unit_m);

/// Puts Scene::diagnostics into file order: other files (MTL) first, then by line where there are lines,
/// findings about the whole file last; otherwise as found.
void sort_findings(Scene& scene);

}  // namespace clrad

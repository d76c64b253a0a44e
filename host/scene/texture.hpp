/// Reflectance textures: from image files to Scene::textures.
#pragma once
#include <clrad/scene.hpp>
#include <string>
#include <string_view>

#include "scene/raw_scene.hpp"

namespace clrad {

/// Most texels of one image: 2^26, 8192 x 8192, which as linear floats take 768 MiB.
inline constexpr std::uint64_t most_texels = std::uint64_t(1) << 26;

/// An image file through OpenImageIO, as three linear bands: files of integers are taken as sRGB and decoded, those of floats
/// (.exr, .hdr) as linear. Of one or two channels the first is all three bands; alpha is not used. Throws InputError that
/// names the file: it cannot be read, is damaged or cut off, has more than most_texels, or a value that is negative
/// or not finite.
Texture read_texture(const std::string& path);
/// The same of an image in memory; `name` is for messages, and its ending says the format where the bytes do not.
Texture decode_texture(std::string_view bytes, const std::string& name);

/// Mean over the texture, per band.
std::vector<double> mean_colour(const Texture& texture, std::uint32_t bands);

/// The scene with textures put aside: reflectances times their textures' means.
Scene with_mean_colours(Scene scene);

/// Rules of validation (scene/validate.hpp) that concern textures, on three bands: texels whose reflectance with the
/// material's factor would be 1 or more reflect 0.99 ("texture-reflectance", repair); faces without coordinates get the
/// texture's mean ("no-texture-coordinates", warning); textures that no face uses are dropped.
void settle_textures(RawScene& raw);

}  // namespace clrad

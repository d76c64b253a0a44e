#include "scene/texture.hpp"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>

#include "clrad/error.hpp"

namespace clrad {
namespace {

constexpr double brightest_texel = 0.99;  // of what would reflect all light or more
constexpr std::size_t three_bands = 3;

// IEC 61966-2-1.
double linear_of_srgb(double c) {
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

// What the library says of the last failure, on one line.
std::string reason_of(std::string text) {
  if (text.empty()) text = OIIO::geterror();
  if (text.empty()) return "its format is not known, or it is damaged";
  std::replace(text.begin(), text.end(), '\n', ' ');
  while (!text.empty() && text.back() == ' ') text.pop_back();
  return text;
}

// The library would multiply colours by alpha, which is not used.
OIIO::ImageSpec unassociated(OIIO::Filesystem::IOProxy* memory = nullptr) {
  OIIO::ImageSpec spec;
  // With a configuration, the library looks for what it reads from in there.
  if (memory) spec.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, static_cast<void*>(&memory));
  spec.attribute("oiio:UnassociatedAlpha", 1);
  return spec;
}

Texture texture_of(OIIO::ImageInput& input, const std::string& name) {
  const OIIO::ImageSpec spec = input.spec();
  if (spec.width <= 0 || spec.height <= 0 || spec.depth > 1 || spec.nchannels <= 0)
    throw InputError(fmt::format("{}: is not an image of one layer", name));
  const std::uint64_t count = std::uint64_t(spec.width) * std::uint64_t(spec.height);
  if (count > most_texels)
    throw InputError(
        fmt::format("{}: has {} x {} texels, which would take {:.1f} GiB; textures have at most {} million: "
                    "scale it down",
                    name, spec.width, spec.height, double(count) * three_bands * sizeof(float) / 0x1p30,
                    most_texels / 1000000));
  const auto channels = std::size_t(spec.nchannels);
  const bool integers = !spec.format.is_floating_point(), bytes = spec.format == OIIO::TypeDesc::UINT8;
  Texture texture;
  texture.name = name;
  texture.width = std::uint32_t(spec.width), texture.height = std::uint32_t(spec.height);
  texture.texels.resize(count * three_bands);
  std::array<float, 256> of_byte{};
  for (std::size_t i = 0; i < of_byte.size(); ++i) of_byte[i] = float(linear_of_srgb(double(i) / 255));
  // Row by row: a wide image of many channels is never in memory as a whole. Integers come out in [0, 1].
  const std::size_t used = std::min<std::size_t>(channels, channels < 3 ? 1 : 3);
  std::vector<float> row(std::size_t(spec.width) * channels);
  const bool tiled = spec.tile_width > 0;
  std::vector<float> whole;
  if (tiled) {  // such files are read in one piece
    whole.resize(count * channels);
    if (!input.read_image(0, 0, 0, spec.nchannels, OIIO::TypeDesc::FLOAT, whole.data()))
      throw InputError(fmt::format("{}: cannot be read: {}", name, reason_of(input.geterror())));
  }
  for (std::uint32_t y = 0; y < texture.height; ++y) {
    if (tiled)
      std::copy_n(whole.begin() + std::ptrdiff_t(y * row.size()), row.size(), row.begin());
    else if (!input.read_scanline(spec.y + int(y), 0, OIIO::TypeDesc::FLOAT, row.data()))
      throw InputError(fmt::format("{}: cannot be read: {}", name, reason_of(input.geterror())));
    for (std::uint32_t x = 0; x < texture.width; ++x)
      for (std::size_t b = 0; b < three_bands; ++b) {
        const float value = row[x * channels + std::min(b, used - 1)];
        if (!(value >= 0) || !std::isfinite(value))
          throw InputError(
              fmt::format("{}: its texel in column {}, row {} is {}; reflectances are numbers from 0 to 1",
                          name, x, y, value));
        float& texel = texture.texels[(std::size_t(y) * texture.width + x) * three_bands + b];
        texel = !integers ? value
                : bytes   ? of_byte[std::size_t(std::lround(std::min(value, 1.0f) * 255))]
                          : float(linear_of_srgb(double(value)));
      }
  }
  return texture;
}

std::string_view band_name(std::size_t band) {
  constexpr std::array<std::string_view, three_bands> names = {"red", "green", "blue"};
  return names[band];
}

// Of a material that no face has the factor alone would be judged, which may be 1.
void put_aside(Material& material) {
  material.texture = no_texture;
  material.reflectance.assign(three_bands, 0.0);
}

// Materials that would reflect all light somewhere get a copy of their texture that does not.
void cap_texels(RawScene& raw) {
  std::map<std::pair<std::uint32_t, std::array<float, three_bands>>, std::uint32_t> copies;
  std::vector<std::array<float, three_bands>> most(raw.textures.size());
  for (std::size_t t = 0; t < most.size(); ++t) {
    most[t] = {0, 0, 0};
    for (std::size_t i = 0; i < raw.textures[t].texels.size(); ++i)
      most[t][i % three_bands] = std::max(most[t][i % three_bands], raw.textures[t].texels[i]);
  }
  for (Material& m : raw.materials) {
    if (m.texture == no_texture) continue;
    std::array<float, three_bands> cap{};
    std::size_t worst = three_bands;
    for (std::size_t b = 0; b < three_bands; ++b) {
      cap[b] = std::numeric_limits<float>::infinity();
      if (!(m.reflectance[b] * double(most[m.texture][b]) >= 1)) continue;
      cap[b] = float(brightest_texel / m.reflectance[b]);
      if (worst == three_bands ||
          m.reflectance[b] * most[m.texture][b] > m.reflectance[worst] * most[m.texture][worst])
        worst = b;
    }
    if (worst == three_bands) continue;
    const auto [copy, is_new] = copies.try_emplace({m.texture, cap}, std::uint32_t(raw.textures.size()));
    const std::uint32_t from = m.texture;
    std::uint64_t capped = 0;
    Texture lower = is_new ? raw.textures[from] : Texture{};
    const std::vector<float>& texels = raw.textures[from].texels;
    for (std::size_t i = 0; i < texels.size(); i += three_bands) {
      bool over = false;
      for (std::size_t b = 0; b < three_bands; ++b) {
        if (!(m.reflectance[b] * double(texels[i + b]) >= 1)) continue;
        over = true;
        if (is_new) lower.texels[i + b] = cap[b];
      }
      capped += over;
    }
    raw.add(
        Diagnostic::Severity::repair, "texture-reflectance", m.where,
        fmt::format(
            "material \"{}\" with {} would reflect {:.3g} of {} light at its brightest; the {} of {} texels "
            "that reflect all or more are taken to reflect {}",
            m.name, raw.textures[from].name, m.reflectance[worst] * double(most[from][worst]),
            band_name(worst), capped, texels.size() / three_bands, brightest_texel));
    if (is_new) raw.textures.push_back(std::move(lower));
    if (is_new) most.push_back(most[from]);
    m.texture = copy->second;
  }
}

// Faces that say nothing of where they are in their texture.
void plain_where_no_coordinates(RawScene& raw) {
  std::map<std::uint32_t, std::uint32_t> plain;
  for (RawFace& face : raw.faces) {
    const std::uint32_t texture = raw.materials[face.material].texture;
    if (texture == no_texture || face.has_uv) continue;
    const auto [found, is_new] = plain.try_emplace(face.material, std::uint32_t(raw.materials.size()));
    if (is_new) {
      Material m = raw.materials[face.material];
      const std::vector<double> mean = mean_colour(raw.textures[texture], three_bands);
      for (std::size_t b = 0; b < three_bands; ++b) m.reflectance[b] *= mean[b];
      m.texture = no_texture;
      raw.add(
          Diagnostic::Severity::warning, "no-texture-coordinates", face.where,
          fmt::format("has no texture coordinates, but its material \"{}\" has the texture {}; such faces "
                      "get the texture's mean colour",
                      m.name, raw.textures[texture].name));
      raw.materials.push_back(std::move(m));
    }
    face.material = found->second;
  }
}

void drop_unused(RawScene& raw) {
  std::vector<std::uint32_t> number(raw.textures.size(), no_texture);
  std::vector<bool> used(raw.textures.size(), false), on_face(raw.materials.size(), false);
  for (const RawFace& face : raw.faces) on_face[face.material] = true;
  for (std::size_t m = 0; m < raw.materials.size(); ++m) {
    Material& material = raw.materials[m];
    if (material.texture == no_texture) continue;
    if (on_face[m])
      used[material.texture] = true;
    else
      put_aside(material);
  }
  std::vector<Texture> kept;
  for (std::size_t t = 0; t < used.size(); ++t) {
    if (!used[t]) continue;
    number[t] = std::uint32_t(kept.size());
    kept.push_back(std::move(raw.textures[t]));
  }
  raw.textures = std::move(kept);
  for (Material& m : raw.materials)
    if (m.texture != no_texture) m.texture = number[m.texture];
}

}  // namespace

Texture read_texture(const std::string& path) {
  const OIIO::ImageSpec as_stored = unassociated();
  const auto input = OIIO::ImageInput::open(path, &as_stored);
  if (!input) throw InputError(fmt::format("{}: cannot be read as an image: {}", path, reason_of("")));
  return texture_of(*input, path);
}

Texture decode_texture(std::string_view bytes, const std::string& name) {
  const bool jpeg = bytes.starts_with("\xFF\xD8"), png = bytes.starts_with("\x89PNG");
  OIIO::Filesystem::IOMemReader memory(const_cast<char*>(bytes.data()), bytes.size());
  const std::string as = jpeg ? "image.jpg" : png ? "image.png" : name;
  const OIIO::ImageSpec as_stored = unassociated(&memory);
  const auto input = OIIO::ImageInput::open(as, &as_stored, &memory);
  if (!input) throw InputError(fmt::format("{}: cannot be read as an image: {}", name, reason_of("")));
  return texture_of(*input, name);
}

std::vector<double> mean_colour(const Texture& texture, std::uint32_t bands) {
  std::vector<double> mean(bands, 0);
  for (std::uint32_t y = 0; y < texture.height; ++y) {
    std::vector<double> row(bands, 0);  // sums of sums
    for (std::size_t i = 0; i < std::size_t(texture.width) * bands; ++i)
      row[i % bands] += double(texture.texels[std::size_t(y) * texture.width * bands + i]);
    for (std::uint32_t b = 0; b < bands; ++b) mean[b] += row[b];
  }
  for (double& m : mean) m /= double(texture.width) * texture.height;
  return mean;
}

Scene with_mean_colours(Scene scene) {
  const auto bands = std::uint32_t(scene.bands.size());
  for (Material& m : scene.materials) {
    if (m.texture == no_texture) continue;
    const std::vector<double> mean = mean_colour(scene.textures[m.texture], bands);
    for (std::uint32_t b = 0; b < bands; ++b) m.reflectance[b] *= mean[b];
    m.texture = no_texture;
  }
  scene.textures.clear();
  return scene;
}

void settle_textures(RawScene& raw) {
  if (raw.textures.empty()) return;
  drop_unused(raw);
  plain_where_no_coordinates(raw);
  drop_unused(raw);
  cap_texels(raw);
  drop_unused(raw);
}

}  // namespace clrad

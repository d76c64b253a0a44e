/// Small images for tests of textures.
#pragma once
#include <OpenImageIO/imageio.h>

#include <array>
#include <clrad/scene.hpp>
#include <cmath>
#include <cstdint>
#include <fstream>
#include <iterator>
#include <stdexcept>
#include <string>
#include <vector>

namespace clrad_test {

/// [row][column][channel]; the ending of the path says the format.
template <class T>
std::string write_image_file(const std::string& path, int width, int height, int channels,
                             const std::vector<T>& values) {
  const auto type = sizeof(T) == 1   ? OIIO::TypeDesc::UINT8
                    : sizeof(T) == 2 ? OIIO::TypeDesc::UINT16
                                     : OIIO::TypeDesc::FLOAT;
  auto out = OIIO::ImageOutput::create(path);
  if (!out || !out->open(path, OIIO::ImageSpec(width, height, channels, type)) ||
      !out->write_image(type, values.data()) || !out->close())
    throw std::runtime_error("cannot write " + path);
  return path;
}

inline std::string bytes_of(const std::string& path) {
  std::ifstream in(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

/// What a byte of an sRGB image means (IEC 61966-2-1).
inline double srgb(double byte) {
  const double c = byte / 255;
  return c <= 0.04045 ? c / 12.92 : std::pow((c + 0.055) / 1.055, 2.4);
}

/// A texture of one band.
inline clrad::Texture grey_texture(std::uint32_t width, std::uint32_t height, std::vector<float> texels,
                                   clrad::Wrap wrap = clrad::Wrap::repeat) {
  clrad::Texture t;
  t.name = "by hand";
  t.width = width, t.height = height;
  t.wrap = {wrap, wrap};
  t.texels = std::move(texels);
  return t;
}

/// The bilinear interpolant, straight from its definition, in double.
inline double texture_value(const clrad::Texture& t, double u, double v) {
  const auto wrapped = [](long long i, long long n, clrad::Wrap wrap) {
    if (wrap == clrad::Wrap::clamp) return std::min(std::max(i, 0ll), n - 1);
    const long long period = wrap == clrad::Wrap::mirror ? 2 * n : n, k = ((i % period) + period) % period;
    return k < n ? k : period - 1 - k;
  };
  const double x = u * t.width - 0.5, y = v * t.height - 0.5;
  const auto i = (long long)(std::floor(x)), j = (long long)(std::floor(y));
  double sum = 0;
  for (int b = 0; b < 2; ++b)
    for (int a = 0; a < 2; ++a)
      sum += (a ? x - double(i) : 1 - x + double(i)) * (b ? y - double(j) : 1 - y + double(j)) *
             double(t.texels[std::size_t(wrapped(j + b, t.height, t.wrap[1]) * t.width +
                                         wrapped(i + a, t.width, t.wrap[0]))]);
  return sum;
}

}  // namespace clrad_test

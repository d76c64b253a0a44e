#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "clrad/output.hpp"
#include "output/file.hpp"
#include "output/tone.hpp"

namespace clrad {
namespace {

// The file's bytes, made in memory: what reaches the disk is whole.
std::string encoded(const std::string& path, const std::string& format, const OIIO::ImageSpec& spec,
                    const OIIO::TypeDesc& type, const void* pixels) {
  const auto out = OIIO::ImageOutput::create(format);
  if (!out) throw DeviceError(fmt::format("cannot write {}: OpenImageIO has no {} writer", path, format));
  std::vector<unsigned char> bytes;
  OIIO::Filesystem::IOVecOutput memory(bytes);
  if (!out->set_ioproxy(&memory) || !out->open("memory." + format, spec) || !out->write_image(type, pixels) ||
      !out->close())
    throw DeviceError(fmt::format("cannot write {}: {}", path, out->geterror()));
  return std::string(bytes.begin(), bytes.end());
}

double exposure(const Image& image, const ImageOptions& options) {
  double factor = std::exp2(options.exposure_stops);
  if (options.automatic_exposure) {
    std::vector<double> luminances;
    for (std::size_t i = 0; i < image.radiance.size(); i += image.bands)
      luminances.push_back(luminance(&image.radiance[i], image.bands));
    factor *= automatic_exposure(std::move(luminances));
  }
  return factor;
}

std::string png(const std::string& path, const Image& image, const ImageOptions& options) {
  if (image.bands != 1 && image.bands != 3)
    throw UsageError(
        fmt::format("cannot write {}: PNG shows 1 or 3 bands, this picture has {}; write EXR instead", path,
                    image.bands));
  const double factor = exposure(image, options);
  std::vector<unsigned char> codes;
  codes.reserve(image.radiance.size());
  double colour[3];
  for (std::size_t i = 0; i < image.radiance.size(); i += image.bands) {
    std::copy_n(&image.radiance[i], image.bands, colour);
    expose({colour, image.bands}, factor, options.automatic_exposure);
    for (unsigned b = 0; b < image.bands; ++b)
      codes.push_back((unsigned char)std::lround(255 * srgb_encoded(colour[b])));
  }
  OIIO::ImageSpec spec(int(image.width), int(image.height), int(image.bands), OIIO::TypeDesc::UINT8);
  spec.attribute("oiio:ColorSpace", "sRGB");
  return encoded(path, "png", spec, OIIO::TypeDesc::UINT8, codes.data());
}

std::string exr(const std::string& path, const Image& image) {
  OIIO::ImageSpec spec(int(image.width), int(image.height), int(image.bands), OIIO::TypeDesc::FLOAT);
  spec.channelnames.clear();
  for (unsigned b = 0; b < image.bands; ++b) {
    if (image.bands == 1)
      spec.channelnames.push_back("Y");
    else if (image.bands == 3)
      spec.channelnames.push_back(std::string(1, "RGB"[b]));
    else
      spec.channelnames.push_back(b < image.band_names.size() ? image.band_names[b]
                                                              : fmt::format("band{}", b));
  }
  spec.attribute("oiio:ColorSpace", "Linear");
  spec.attribute("compression", "zip");
  if (!image.unit.empty()) spec.attribute("radianceUnit", image.unit);
  if (image.bands == 3) {
    // Rec.709 primaries and D65: what the three bands are.
    const float chromaticities[8] = {0.64f, 0.33f, 0.30f, 0.60f, 0.15f, 0.06f, 0.3127f, 0.3290f};
    spec.attribute("chromaticities", OIIO::TypeDesc(OIIO::TypeDesc::FLOAT, 8), chromaticities);
  }
  return encoded(path, "openexr", spec, OIIO::TypeDesc::FLOAT, image.radiance.data());
}

}  // namespace

void write_image(const std::string& path, const Image& image, const ImageOptions& options) {
  if (image.width == 0 || image.height == 0 || image.bands == 0 ||
      image.radiance.size() != std::size_t(image.width) * image.height * image.bands)
    throw UsageError(fmt::format("cannot write {}: the picture has {} values for {} x {} pixels of {} bands",
                                 path, image.radiance.size(), image.width, image.height, image.bands));
  const std::string ending = lower_ending(path);
  if (ending == ".png")
    write_file(path, png(path, image, options));
  else if (ending == ".exr")
    write_file(path, exr(path, image));
  else
    throw UsageError(fmt::format("cannot write {}: the ending of a picture is .png or .exr", path));
}

}  // namespace clrad

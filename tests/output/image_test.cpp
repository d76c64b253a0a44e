#include <OpenImageIO/imageio.h>

#include <cmath>

#include "clrad/error.hpp"
#include "clrad/output.hpp"
#include "output/support.hpp"
#include "output/tone.hpp"

namespace clrad {
namespace {

class Images : public test::FileTest {
 protected:
  struct Read {
    OIIO::ImageSpec spec;
    std::vector<float> values;         // EXR
    std::vector<unsigned char> codes;  // PNG
  };
  static Read read(const std::string& path) {
    Read r;
    const auto in = OIIO::ImageInput::open(path);
    EXPECT_TRUE(in) << path;
    r.spec = in->spec();
    const std::size_t count = std::size_t(r.spec.width) * r.spec.height * r.spec.nchannels;
    r.values.resize(count), r.codes.resize(count);
    EXPECT_TRUE(in->read_image(0, 0, 0, r.spec.nchannels, OIIO::TypeDesc::FLOAT, r.values.data()));
    EXPECT_TRUE(in->read_image(0, 0, 0, r.spec.nchannels, OIIO::TypeDesc::UINT8, r.codes.data()));
    return r;
  }
};

Image image(unsigned width, unsigned height, unsigned bands, const std::vector<float>& radiance) {
  Image i;
  i.width = width, i.height = height, i.bands = bands, i.radiance = radiance, i.unit = "W/(sr m^2)";
  return i;
}

TEST_F(Images, ExrHoldsTheVeryNumbers) {
  const Image colour = image(2, 2, 3, {0, 1e-6f, 3e7f, 0.1f, 0.2f, 0.3f, 1, 2, 3, 4, 5, 6.7f});
  write_image(in_folder("a.exr"), colour, {.exposure_stops = 3});
  const Read r = read(in_folder("a.exr"));
  EXPECT_EQ(r.values, colour.radiance);
  EXPECT_EQ(r.spec.width, 2);
  EXPECT_EQ(r.spec.format, OIIO::TypeDesc::FLOAT);
  EXPECT_EQ(r.spec.channelnames, (std::vector<std::string>{"R", "G", "B"}));
  EXPECT_EQ(r.spec.get_string_attribute("radianceUnit"), "W/(sr m^2)");
  EXPECT_EQ(files(), 1u);
}

TEST_F(Images, ExrNamesOneBandOrMany) {
  write_image(in_folder("y.exr"), image(2, 1, 1, {0.5f, 7}));
  EXPECT_EQ(read(in_folder("y.exr")).spec.channelnames, std::vector<std::string>{"Y"});
  Image many = image(1, 1, 5, {1, 2, 3, 4, 5});
  many.band_names = {"b400nm", "b500nm", "b600nm", "b700nm", "b800nm"};
  write_image(in_folder("n.exr"), many);
  EXPECT_EQ(read(in_folder("n.exr")).spec.channelnames, many.band_names);
  EXPECT_EQ(read(in_folder("n.exr")).values, many.radiance);
}

TEST_F(Images, PngWithFixedExposureIsTheSrgbCurve) {
  // Codes of IEC 61966-2-1 for 0, below the linear toe, mid grey, 1 (white) and above; two stops up: a
  // quarter is white.
  const Image grey = image(5, 1, 1, {0, 0.002f, 0.18f, 1, 30});
  write_image(in_folder("a.png"), grey, {.automatic_exposure = false});
  const Read r = read(in_folder("a.png"));
  EXPECT_EQ(r.spec.nchannels, 1);
  EXPECT_EQ(r.codes, (std::vector<unsigned char>{0, 7, 118, 255, 255}));
  write_image(in_folder("b.png"), image(2, 1, 3, {0.25f, 0.045f, 0, 0, 0, 0}),
              {.exposure_stops = 2, .automatic_exposure = false});
  EXPECT_EQ(read(in_folder("b.png")).codes, (std::vector<unsigned char>{255, 118, 0, 0, 0, 0}));
}

TEST_F(Images, AutomaticExposureShowsThe90thPercentileAsHalf) {
  // 101 pixels: 10 black ones do not count, of the others the 90th percentile (number 81 from 0) is 82.
  std::vector<float> radiance(101, 0.0f);
  for (int i = 10; i < 101; ++i) radiance[i] = float(i - 9);
  write_image(in_folder("a.png"), image(101, 1, 1, radiance));
  const auto codes = read(in_folder("a.png")).codes;
  EXPECT_EQ(codes[9 + 82], 188);  // sRGB of 0.5
  EXPECT_EQ(codes[9 + 41], 137);  // of 0.25
  EXPECT_TRUE(std::is_sorted(codes.begin() + 9, codes.end()));
  // The scene's brightness does not matter, and a black picture stays black.
  for (float& x : radiance) x *= 4096;
  write_image(in_folder("b.png"), image(101, 1, 1, radiance));
  EXPECT_EQ(read(in_folder("b.png")).codes, codes);
  write_image(in_folder("c.png"), image(2, 1, 1, {0, 0}));
  EXPECT_EQ(read(in_folder("c.png")).codes, (std::vector<unsigned char>{0, 0}));
}

TEST(Tone, ShoulderRisesSmoothlyBelowOneAndKeepsTheHue) {
  double before = -1;
  for (double x = 0; x < 8; x += 1.0 / 256) {
    EXPECT_GT(shoulder(x), before);
    EXPECT_LT(shoulder(x), 1);
    EXPECT_LE(shoulder(x), x);
    before = shoulder(x);
  }
  // Slope 1 on both sides of the knee: second order in the step.
  EXPECT_NEAR(shoulder(0.6 + 1e-4) - 0.6, 1e-4, 2e-8);
  double colour[3] = {8, 4, 2};
  expose(colour, 0.5, true);
  EXPECT_NEAR(colour[0], shoulder(4), 1e-15);
  EXPECT_NEAR(colour[1], colour[0] / 2, 1e-15);
  EXPECT_NEAR(colour[2], colour[0] / 4, 1e-15);
  double odd[3] = {NAN, -1, 0.5};
  expose(odd, 1, true);
  EXPECT_EQ(odd[0], 0);
  EXPECT_EQ(odd[1], 0);
  EXPECT_EQ(odd[2], 0.5);
}

TEST_F(Images, WhatAFormatCannotShowIsSaid) {
  EXPECT_THROW(write_image(in_folder("a.png"), image(1, 1, 2, {1, 2})), UsageError);
  EXPECT_THROW(write_image(in_folder("a.jpg"), image(1, 1, 1, {1})), UsageError);
  EXPECT_THROW(write_image(in_folder("a"), image(1, 1, 1, {1})), UsageError);
  EXPECT_THROW(write_image(in_folder("a.png"), image(2, 2, 1, {1})), UsageError);
  EXPECT_THROW(write_image(in_folder("missing/a.png"), image(1, 1, 1, {1})), DeviceError);
  EXPECT_EQ(files(), 0u);
}

}  // namespace
}  // namespace clrad

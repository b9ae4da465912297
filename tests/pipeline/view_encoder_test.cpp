#include "panonav/pipeline/view_encoder.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/signature/dissimilarity.hpp"

namespace panonav {
namespace {

Camera mirror_camera() {
  Camera camera;
  camera.model = EquiangularModel{radians(-60.0), radians(30.0)};
  camera.image_size = {320, 240};
  camera.centre = {161.0, 118.5};
  camera.rim_radius_px = 114.0;
  camera.inner_radius_px = 20.0;
  return camera;
}

Image blotchy_image(ImageSize size, std::uint64_t seed) {
  Random random(seed);
  const double a = random.uniform(0.02, 0.1);
  const double b = random.uniform(0.02, 0.1);
  Image image(size.width, size.height);
  for (int v = 0; v < size.height; ++v) {
    for (int u = 0; u < size.width; ++u) {
      const double value =
          100.0 + 80.0 * std::sin(a * u + 1.0) * std::cos(b * v) + random.normal(0.0, 10.0);
      image.at(u, v) = static_cast<std::uint8_t>(std::clamp(value, 0.0, 255.0));
    }
  }
  return image;
}

MemoryHeader mirror_header(bool masked = false) {
  MemoryHeader header;
  header.shape = {20, 10};
  header.panorama_columns = 128;
  header.source.kind = PictureKind::mirror;
  header.source.camera = mirror_camera();
  if (masked) {
    Image mask(320, 240);
    for (int v = 0; v < 240; ++v) {
      for (int u = 0; u < 320; ++u) mask.at(u, v) = u < 40 && v > 100 && v < 140 ? 0 : 255;
    }
    header.source.mask = std::move(mask);
  }
  header.elevations = Unwarper(mirror_camera(), {20, 128}).elevations();
  return header;
}

MemoryHeader panorama_header(PictureKind kind) {
  MemoryHeader header;
  header.shape = {20, 10};
  header.panorama_columns = 128;
  header.source.kind = kind;
  if (kind == PictureKind::equirectangular) {
    header.elevations = header.source.layout.elevations =
        ElevationBand{radians(-90.0), radians(90.0)};
  }
  return header;
}

ImageSize picture_size(const MemoryHeader& header) {
  if (header.source.kind == PictureKind::mirror) return {320, 240};
  return header.source.kind == PictureKind::panorama ? ImageSize{128, 20} : ImageSize{256, 128};
}

TEST(ViewEncoder, GivesTheSameBitsFromPicturePanoramaAndObservation) {
  for (MemoryHeader header :
       {mirror_header(), mirror_header(true), panorama_header(PictureKind::panorama),
        panorama_header(PictureKind::equirectangular)}) {
    for (const bool edges : {false, true}) {
      header.preprocessing.edge_channel = edges;
      const ViewEncoder encoder(header, header.source);
      const Image image = blotchy_image(picture_size(header), 3);
      const Panorama panorama = encoder.panorama(image.view());
      const FourierSignature expected = encoder.signature(panorama);
      EXPECT_EQ(encoder.signature(image.view()), expected);
      EXPECT_EQ(encoder.signature(Observation(image)), expected);
      EXPECT_EQ(encoder.signature(Observation(panorama)), expected);
      EXPECT_EQ(encoder.packed(Observation(image)), pack(expected, header.full_scale));
      EXPECT_EQ(encoder.panorama(Observation(image)), panorama);
      // The definition: preprocessing, then the transform; equal but for rounding.
      const FourierSignature defined =
          compute_signature(preprocess(panorama, header.preprocessing), header.shape.components);
      for (std::size_t i = 0; i < defined.magnitudes().size(); ++i) {
        EXPECT_NEAR(expected.magnitudes()[i], defined.magnitudes()[i], 1e-5);
      }
      EXPECT_GT(largest_nonconstant_magnitude(defined), 0.01F);
    }
  }
}

TEST(ViewEncoder, TiltIsTakenOutOfPicturesAndPanoramas) {
  const MemoryHeader header = mirror_header();
  const ViewEncoder encoder(header, header.source);
  const Image image = blotchy_image({320, 240}, 1);
  const Tilt tilt{radians(3.0), radians(-2.0)};
  Observation picture(image);
  picture.tilt = tilt;
  Observation ready(encoder.panorama(image.view()));
  ready.tilt = tilt;
  const Panorama level = level_panorama(encoder.panorama(image.view()), tilt);
  EXPECT_EQ(encoder.panorama(ready), level);
  EXPECT_EQ(encoder.panorama(picture), encoder.panorama(image.view(), tilt));
  EXPECT_EQ(encoder.signature(ready), encoder.signature(level));
  EXPECT_EQ(encoder.signature(picture), encoder.signature(encoder.panorama(picture)));
  EXPECT_NE(encoder.signature(ready), encoder.signature(image.view()));
}

TEST(ViewEncoder, ManyThreadsGetTheBitsOfOne) {
  const MemoryHeader header = mirror_header();
  const ViewEncoder encoder(header, header.source);
  std::vector<Image> images;
  for (std::uint64_t i = 0; i < 24; ++i) images.push_back(blotchy_image({320, 240}, i));
  std::vector<PackedSignature> alone;
  for (const Image& image : images) alone.push_back(encoder.packed(image.view()));
  EXPECT_NE(alone[0], alone[1]);
  std::vector<PackedSignature> together(images.size());
  Executor executor(4);
  parallel_for(executor, images.size(),
               [&](std::size_t i) { together[i] = encoder.packed(images[i].view()); });
  EXPECT_EQ(together, alone);
}

TEST(ViewEncoder, RefusesWhatTheMemoryCannotCompare) {
  const MemoryHeader header = mirror_header();
  const ViewEncoder encoder(header, header.source);
  const auto message_of = [&](const Observation& observation) -> std::string {
    try {
      static_cast<void>(encoder.signature(observation));
    } catch (const FileError& error) {
      return std::string("file: ") + error.what();
    } catch (const ContractError& error) {
      return error.what();
    }
    return "";
  };
  EXPECT_EQ(message_of(blotchy_image({320, 240}, 1)), "");
  EXPECT_NE(message_of(Image(320, 200)).find("320 x 200"), std::string::npos);
  EXPECT_NE(message_of(Panorama(20, 64, header.elevations)).find("size is 64 x 20"),
            std::string::npos);
  EXPECT_NE(message_of(Panorama(20, 128, {})).find("elevation band"), std::string::npos);

  Observation tilted(blotchy_image({320, 240}, 1));
  tilted.tilt = Tilt{0.0, radians(-6.0)};
  EXPECT_EQ(message_of(tilted), "");
  tilted.tilt = Tilt{0.0, radians(-36.0)};
  EXPECT_NE(message_of(tilted).find("pitch is -36 degrees; allowed: -30 to 30"), std::string::npos);

  Observation from_file(Image(320, 200));
  from_file.file = "run/view.png";
  EXPECT_EQ(message_of(from_file).find("file: "), 0U);
  EXPECT_NE(message_of(from_file).find("run/view.png"), std::string::npos);
}

}  // namespace
}  // namespace panonav

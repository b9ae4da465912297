// Checks what GPano data say of a picture, and its panorama. The signs are those of the standard
// ("Photo Sphere XMP Metadata"): pitch is the elevation of the centre; as roll increases, the
// horizon turns counter-clockwise in the image.
#include "panonav/io/gpano.hpp"

#include <gtest/gtest.h>
#include <zlib.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/image_file.hpp"
#include "panonav/io/panorama_reader.hpp"
#include "support/gpano_pictures.hpp"
#include "support/temporary_folder.hpp"
#include "support/text.hpp"

namespace panonav::testing {
namespace {

namespace fs = std::filesystem;

const GpanoProperties cropped_sphere{
    {"ProjectionType", "equirectangular"},   {"FullPanoWidthPixels", "512"},
    {"FullPanoHeightPixels", "256"},         {"CroppedAreaImageWidthPixels", "512"},
    {"CroppedAreaImageHeightPixels", "128"}, {"CroppedAreaLeftPixels", "0"},
    {"CroppedAreaTopPixels", "32"}};

class Gpano : public ::testing::Test {
 protected:
  fs::path write(const std::string& name, const Image& picture,
                 const GpanoProperties& properties) const {
    const fs::path file = folder / name;
    const auto jpeg = encode_jpeg(picture.view(), 98);
    write_file(file, insert_xmp(jpeg, make_xmp(properties, false)));
    return file;
  }
  /// Returns the panorama of the only entry of a data set.
  static Panorama read(Dataset dataset) {
    apply_gpano(dataset);
    const DatasetEntry& entry = dataset.entries.at(0);
    const PanoramaReader reader(dataset.source, {70, 256});
    const Image picture = read_picture(entry);
    return reader.convert(picture.view(), entry.tilt.value_or(Tilt{}));
  }
  static PictureSource sphere() { return {.kind = PictureKind::equirectangular}; }
  static double compute_max_difference(const Panorama& a, const Panorama& b) {
    EXPECT_EQ(a.rows(), b.rows());
    double largest = 0.0;
    for (std::size_t i = 0; i < a.values().size(); ++i) {
      largest = std::max(largest, std::abs(static_cast<double>(a.values()[i] - b.values()[i])));
    }
    return largest;
  }
  TemporaryFolder folder;
};

TEST_F(Gpano, PosesLevelThePicture) {
  const Panorama truth =
      read(read_single_picture(write("level.jpg", take_sphere(0, 0), {}), sphere()));
  for (const auto& [pitch_deg, roll_deg] : std::vector<std::pair<double, double>>{
           {12.0, 0.0}, {0.0, 25.0}, {-20.0, -8.0}, {35.0, 50.0}, {-3.0, 180.0}, {5.0, -90.0}}) {
    SCOPED_TRACE(std::to_string(pitch_deg) + " " + std::to_string(roll_deg));
    const Image picture = take_sphere(radians(pitch_deg), radians(roll_deg));
    const fs::path file = write("tilted.jpg", picture,
                                {{"PosePitchDegrees", std::to_string(pitch_deg)},
                                 {"PoseRollDegrees", std::to_string(roll_deg)},
                                 {"PoseHeadingDegrees", "77"}});
    EXPECT_LT(compute_max_difference(read(read_single_picture(file, sphere())), truth), 0.03);
    const PanoramaReader reader(sphere(), {70, 256});
    EXPECT_GT(compute_max_difference(reader.read(file), truth), 0.1) << "as it is";
  }
}

// A robot whose front is elsewhere in the picture leans in its own axes.
TEST_F(Gpano, TiltFollowsTheForwardColumn) {
  const Image level = take_sphere(0, 0);
  const Image tilted = take_sphere(radians(10.0), radians(-14.0));
  const GpanoProperties pose{{"PosePitchDegrees", "10"}, {"PoseRollDegrees", "-14"}};
  for (const double forward : {0.0, 0.2, 0.75}) {
    PictureSource source = sphere();
    source.layout.forward_column = forward;
    const Panorama truth = read(read_single_picture(write("level.jpg", level, {}), source));
    const Panorama levelled = read(read_single_picture(write("tilted.jpg", tilted, pose), source));
    // Levelling keeps the heading of the front but for the second order of the tilt.
    double smallest = 1.0;
    for (int turn = -6; turn <= 6; ++turn) {
      smallest = std::min(smallest, compute_max_difference(rotate_columns(levelled, turn), truth));
    }
    EXPECT_LT(smallest, 0.05) << forward;
  }
}

TEST_F(Gpano, ReadsAttributesElementsAndAnyPrefix) {
  for (const bool as_elements : {false, true}) {
    for (const std::string prefix : {"GPano", "ns1"}) {
      const auto data = parse_gpano(make_xmp({{"PosePitchDegrees", " -12.5 "},
                                              {"PoseRollDegrees", "+4"},
                                              {"PoseHeadingDegrees", "90"}},
                                             as_elements, prefix));
      ASSERT_TRUE(data.has_value());
      EXPECT_NEAR(degrees(data->pitch_rad), -12.5, 1e-9);
      EXPECT_NEAR(degrees(data->roll_rad), 4.0, 1e-9);
      EXPECT_NEAR(degrees(data->heading_rad.value()), 90.0, 1e-9);
      EXPECT_TRUE(data->has_all_azimuths());
      EXPECT_FALSE(data->elevations.has_value());
    }
  }
  EXPECT_EQ(parse_gpano("<x/>").has_value(), false);
  EXPECT_FALSE(parse_gpano(make_xmp({{"ProjectionType", "cylindrical"}}, true)).has_value());
  const auto nonsense = parse_gpano(make_xmp({{"PosePitchDegrees", "nan"},
                                              {"PoseRollDegrees", "1e300"},
                                              {"FullPanoWidthPixels", "-5"},
                                              {"CroppedAreaImageWidthPixels", "7"}},
                                             false));
  ASSERT_TRUE(nonsense.has_value());
  EXPECT_EQ(nonsense->pitch_rad, 0.0);
  EXPECT_EQ(nonsense->roll_rad, 0.0);
  EXPECT_TRUE(nonsense->has_all_azimuths());
}

TEST_F(Gpano, IsReadFromPng) {
  const std::string xmp = make_xmp({{"PoseRollDegrees", "9"}}, true);
  const Image picture = take_sphere(0, 0, 64);
  for (const bool is_packed : {false, true}) {
    std::string text = xmp;
    if (is_packed) {
      uLongf length = compressBound(static_cast<uLong>(xmp.size()));
      text.resize(length);
      ASSERT_EQ(
          compress(reinterpret_cast<Bytef*>(text.data()), &length,
                   reinterpret_cast<const Bytef*>(xmp.data()), static_cast<uLong>(xmp.size())),
          Z_OK);
      text.resize(length);
    }
    const std::string content = "iTXtXML:com.adobe.xmp" + std::string(1, '\0') +
                                std::string(1, is_packed ? '\1' : '\0') + std::string(3, '\0') +
                                text;
    std::string chunk;
    const auto add_number = [&chunk](std::size_t value) {
      for (int shift = 24; shift >= 0; shift -= 8)
        chunk += static_cast<char>(value >> shift & 255U);
    };
    add_number(content.size() - 4);
    chunk += content;
    add_number(crc32(0, reinterpret_cast<const Bytef*>(content.data()),
                     static_cast<uInt>(content.size())));
    auto png = encode_png(picture.view());
    png.insert(png.end() - 12, chunk.begin(), chunk.end());  // before the end, after the pixels
    const fs::path file = folder / "p.png";
    write_file(file, png);
    EXPECT_EQ(read_image(file).size(), picture.size());
    const auto data = read_gpano(file);
    ASSERT_TRUE(data.has_value()) << is_packed;
    EXPECT_NEAR(degrees(data->roll_rad), 9.0, 1e-9);
  }
}

TEST_F(Gpano, ABandOfElevationsIsTakenFromTheData) {
  Image whole = take_sphere(0, 0);
  Image band(512, 128, 3);
  for (int v = 0; v < 128; ++v) {
    std::copy_n(&whole.at(0, v + 32), 512 * 3, &band.at(0, v));  // 67.5 to -22.5 degrees
  }
  Dataset dataset = read_single_picture(write("band.jpg", band, cropped_sphere), sphere());
  apply_gpano(dataset);
  EXPECT_NEAR(degrees(dataset.source.layout.elevations->top_rad), 67.5, 1e-9);
  EXPECT_NEAR(degrees(dataset.source.layout.elevations->bottom_rad), -22.5, 1e-9);
  EXPECT_NEAR(degrees(dataset.source.layout.kept_elevations->bottom_rad), -22.5, 1e-9);
  EXPECT_NEAR(degrees(dataset.source.layout.kept_elevations->top_rad), 40.0, 1e-9);
  EXPECT_EQ(dataset.warnings.size(), 1U);
  PictureSource same = sphere();
  same.layout.kept_elevations = dataset.source.layout.kept_elevations;
  const Panorama truth = read(read_single_picture(write("whole.jpg", whole, {}), same));
  EXPECT_LT(compute_max_difference(read(read_single_picture(folder / "band.jpg", sphere())), truth),
            0.03);
  PictureSource beyond = sphere();
  beyond.layout.kept_elevations = ElevationBand{radians(-40.0), radians(40.0)};
  Dataset refused = read_single_picture(folder / "band.jpg", beyond);
  EXPECT_THROW(apply_gpano(refused), FileError);
  const PanoramaReader reader(sphere(), {70, 256});
  EXPECT_THROW((void)reader.read(folder / "band.jpg"), FileError) << "no whole sphere";
}

TEST_F(Gpano, ASectorIsRefusedAndOthersAreKept) {
  GpanoProperties sector = cropped_sphere;
  sector[3].second = "256";
  sector[4].second = "128";
  sector[5].second = "128";
  sector[6].second = "64";
  const fs::path file = write("sector.jpg", take_sphere(0, 0, 256), sector);
  Dataset alone = read_single_picture(file, sphere());
  try {
    apply_gpano(alone);
    FAIL() << "a sector was used";
  } catch (const FileError& error) {
    for (const char* part : {"sector.jpg", "-90 to 90", "-45 to 45", "ignore_gpano"}) {
      EXPECT_TRUE(contains(error.what(), part)) << error.what();
    }
  }
  (void)write("whole.jpg", take_sphere(0, 0, 256), {});
  Dataset both = read_picture_folder(folder.path(), sphere());
  apply_gpano(both);
  ASSERT_EQ(both.entries.size(), 1U);
  EXPECT_EQ(both.entries.front().file, "whole.jpg");
  ASSERT_EQ(both.unusable.size(), 1U);
  EXPECT_EQ(both.unusable.front().file, "sector.jpg");
}

TEST_F(Gpano, AnyBytesAreRead) {
  const fs::path file = write("p.jpg", take_sphere(0, 0, 64), cropped_sphere);
  const auto whole = read_file(file, 1U << 20U);
  Random random(5, 0);
  std::size_t found = 0;
  for (int i = 0; i < 3000; ++i) {
    auto bytes = whole;
    bytes.resize(random.index(2) == 0 ? random.index(bytes.size()) : bytes.size());
    for (int j = 0; j < 4 && !bytes.empty(); ++j) {
      bytes[random.index(std::min<std::size_t>(bytes.size(), 1200))] =
          static_cast<std::uint8_t>(random.index(256));
    }
    write_file(file, bytes);
    const auto data = read_gpano(file);
    if (!data) continue;
    ++found;
    EXPECT_LE(std::abs(data->pitch_rad), std::numbers::pi / 2.0);
    EXPECT_GT(data->azimuth_width_rad, 0.0);
    const ElevationBand band = data->elevations.value_or(ElevationBand{0.0, 1.0});
    EXPECT_LT(band.bottom_rad, band.top_rad);
  }
  EXPECT_GT(found, 100U);
}

}  // namespace
}  // namespace panonav::testing

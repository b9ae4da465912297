// Pictures of a part of the azimuth against a memory of panoramas: narrow_pictures_bench MEMORY
// DATASET CROPS SEED. Cuts CROPS pictures of 640 x 480 at random azimuths out of each
// equirectangular picture of the data set, and localises them. Views of the same name are left out.
// Prints the share whose best view is within 1.5 times the distance of the nearest one, the share
// that is known, and medians, for three fields of view and with changed pictures; also for rigs of
// cameras of 90 degrees and for the whole pictures, once for each.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <limits>
#include <numbers>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/random.hpp"
#include "panonav/core/statistics.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/dataset.hpp"
#include "panonav/pipeline/place_recogniser.hpp"

namespace panonav {
namespace {

/// Differences of a picture from an exact one.
struct Change {
  const char* name;
  bool in_other_light = false;
  double stated_focal_length = 1.0;  ///< over the true one
  double tilt_rad = 0.0;             ///< roll and pitch, which nobody states
};

constexpr ImageSize picture_size{640, 480};

double sample(const Image& sphere, const Direction3& seen) {
  const double turns = 0.5 - seen.azimuth_rad() / (2.0 * std::numbers::pi);
  const double u = (turns - std::floor(turns)) * sphere.width() - 0.5;
  const double v =
      std::clamp((0.5 - seen.elevation_rad() / std::numbers::pi) * sphere.height() - 0.5, 0.0,
                 sphere.height() - 1.0);
  const int x = static_cast<int>(std::floor(u));
  const int y = std::min(static_cast<int>(v), sphere.height() - 2);
  const auto at = [&](int column, int row) {
    return static_cast<double>(sphere.at((column + sphere.width()) % sphere.width(), row));
  };
  const double a = u - x;
  const double b = v - y;
  return (1.0 - b) * ((1.0 - a) * at(x, y) + a * at(x + 1, y)) +
         b * ((1.0 - a) * at(x, y + 1) + a * at(x + 1, y + 1));
}

Image photograph(const Image& sphere, double azimuth_rad, double width_rad, const Change& change) {
  const PinholeModel lens{
      .focal_length_px = focal_length_from_field_of_view(picture_size.width, width_rad),
      .azimuth_rad = azimuth_rad,
      .elevation_rad = change.tilt_rad,
      .roll_rad = change.tilt_rad};
  Image picture(picture_size.width, picture_size.height);
  for (int v = 0; v < picture.height(); ++v) {
    for (int u = 0; u < picture.width(); ++u) {
      double level = sample(sphere, unproject(lens, u + 0.5 - 0.5 * picture.width(),
                                              0.5 * picture.height() - v - 0.5));
      if (change.in_other_light) {  // a lamp on the right, another exposure
        level = 12.0 + 255.0 * std::pow(level / 255.0, 0.7) * (0.55 + 0.35 * u / picture.width());
      }
      picture.at(u, v) = static_cast<std::uint8_t>(std::lround(std::clamp(level, 0.0, 255.0)));
    }
  }
  return picture;
}

struct Totals {
  int pictures = 0, right = 0, right_of_three = 0, known = 0;
  double time_ms = 0.0;
  std::vector<double> heading_errors_rad, position_errors_m;
};

class Bench {
 public:
  Bench(const std::string& memory, const std::string& dataset, int crops, std::uint64_t seed)
      : path_(memory),
        recogniser_(memory),
        dataset_(read_dataset(dataset)),
        crops_(crops),
        seed_(seed) {}

  void run(double width_rad, const Change& change) const {
    Totals totals;
    for (std::size_t i = 0; i < dataset_.entries.size(); ++i) {
      const Image sphere = read_grey_picture(dataset_.entries[i]);
      Random random(seed_, i);
      for (int crop = 0; crop < crops_; ++crop) {
        const double azimuth_rad = random.uniform(-std::numbers::pi, std::numbers::pi);
        Observation photo(photograph(sphere, azimuth_rad, width_rad, change));
        photo.narrow_source = PictureSource{
            .kind = PictureKind::pinhole,
            .field_of_view_rad =
                2.0 * std::atan(std::tan(0.5 * width_rad) / change.stated_focal_length)};
        ask(recogniser_, dataset_.entries[i], photo, azimuth_rad, totals);
      }
    }
    print(format_number(degrees(width_rad)) + " degrees, " + change.name, totals);
  }

  /// Asks with the pictures of cameras of 90 degrees around the robot, of which the first `used`
  /// are used; as a panorama if they cover all azimuths, and as narrow pictures.
  void run_rig(int used) const {
    constexpr int around = 4;
    std::vector<Camera> cameras;
    for (int i = 0; i < used; ++i) {
      Camera& camera = cameras.emplace_back();
      camera.model = PinholeModel{
          .focal_length_px = focal_length_from_field_of_view(picture_size.width, radians(90.0)),
          .azimuth_rad = 2.0 * std::numbers::pi * i / around};
      camera.image_size = picture_size;
      camera.centre = {0.5 * picture_size.width, 0.5 * picture_size.height};
    }
    const Camera rig = make_rig(std::move(cameras));
    PlaceRecogniserOptions options;
    if (used == around) {
      options.source = PictureSource{.kind = PictureKind::mirror, .camera = rig};
    }
    const PlaceRecogniser panoramic(path_, options);
    Totals as_panorama;
    Totals as_sectors;
    for (const DatasetEntry& entry : dataset_.entries) {
      const Image sphere = read_grey_picture(entry);
      std::vector<Image> images;
      for (int i = 0; i < used; ++i) {
        images.push_back(
            photograph(sphere, 2.0 * std::numbers::pi * i / around, radians(90.0), {}));
      }
      const std::vector<ImageView> views = view_all(images);
      Observation photo(join_pictures(std::get<RigModel>(rig.model), views));
      if (used == around) ask(panoramic, entry, photo, 0.0, as_panorama);
      photo.narrow_source = PictureSource{.kind = PictureKind::pinhole, .camera = rig};
      ask(recogniser_, entry, photo, 0.0, as_sectors);
    }
    const std::string name = std::to_string(used) + " cameras of 90 degrees";
    if (used == around) print(name + " as panorama", as_panorama);
    print(name + " as narrow ones", as_sectors);
  }

  /// Asks with the whole pictures.
  void run_whole() const {
    Totals totals;
    for (const DatasetEntry& entry : dataset_.entries) {
      ask(recogniser_, entry, read_picture(entry), 0.0, totals);
    }
    print("whole pictures", totals);
  }

 private:
  static std::vector<ImageView> view_all(const std::vector<Image>& images) {
    std::vector<ImageView> views;
    for (const Image& image : images) views.push_back(image.view());
    return views;
  }

  static void print(const std::string& name, const Totals& totals) {
    const auto percent = [&](int count) { return 100.0 * count / std::max(1, totals.pictures); };
    const auto middle = [](const std::vector<double>& errors) {
      return errors.empty() ? std::numeric_limits<double>::quiet_NaN() : median(errors);
    };
    std::printf(
        "%-38s %4d pictures: right %.1f %%, of three %.1f %%, known %.1f %%, "
        "heading %.2f degrees, position %.3f m, %.1f ms\n",
        name.c_str(), totals.pictures, percent(totals.right), percent(totals.right_of_three),
        percent(totals.known), degrees(middle(totals.heading_errors_rad)),
        middle(totals.position_errors_m), totals.time_ms / std::max(1, totals.pictures));
  }

  [[nodiscard]] double distance_to(const std::string& view, const ReferencePose& truth) const {
    const VisualMemory& memory = recogniser_.memory();
    const auto& pose = memory.info(memory.find(view).value()).pose;
    return pose ? std::hypot(pose->x_m - truth.x_m, pose->y_m - truth.y_m)
                : std::numeric_limits<double>::infinity();
  }

  /// `azimuth_rad`: the direction in which the camera looks, which is the robot's forward one.
  void ask(const PlaceRecogniser& recogniser, const DatasetEntry& entry, const Observation& photo,
           double azimuth_rad, Totals& totals) const {
    const std::vector<std::string> own{entry.file};
    const auto start = std::chrono::steady_clock::now();
    const Place place = recogniser.localise(photo, own);
    totals.time_ms +=
        std::chrono::duration<double, std::milli>(std::chrono::steady_clock::now() - start).count();
    ++totals.pictures;
    if (place.known) ++totals.known;
    if (!entry.pose) return;
    double nearest_m = std::numeric_limits<double>::infinity();
    for (const ViewId view : recogniser_.memory().views()) {
      const std::string& name = recogniser_.memory().info(view).name;
      if (name != entry.file) nearest_m = std::min(nearest_m, distance_to(name, *entry.pose));
    }
    const auto is_right = [&](std::size_t k) {
      return k < place.matches.size() &&
             distance_to(place.matches[k].name, *entry.pose) <= 1.5 * nearest_m;
    };
    if (is_right(0) || is_right(1) || is_right(2)) ++totals.right_of_three;
    if (!is_right(0)) return;
    ++totals.right;
    if (place.heading_rad && entry.pose->heading_rad) {
      totals.heading_errors_rad.push_back(
          std::abs(angle_difference(*place.heading_rad, *entry.pose->heading_rad + azimuth_rad)));
    }
    if (!place.position) return;
    totals.position_errors_m.push_back(
        std::hypot(place.position->x_m - entry.pose->x_m, place.position->y_m - entry.pose->y_m));
  }

  std::string path_;
  PlaceRecogniser recogniser_;
  Dataset dataset_;
  int crops_;
  std::uint64_t seed_;
};

void run_all(const Bench& bench) {
  constexpr double tilt_rad = radians(5.0);
  for (const double width_deg : {90.0, 70.0, 50.0}) bench.run(radians(width_deg), {"unchanged"});
  for (const Change& change : {Change{.name = "other light", .in_other_light = true},
                               Change{.name = "focal length", .stated_focal_length = 1.0 / 1.1},
                               Change{.name = "tilt", .tilt_rad = tilt_rad},
                               Change{.name = "all of them",
                               .in_other_light = true,
                               .stated_focal_length = 1.0 / 1.1,
                               .tilt_rad = tilt_rad}}) {
    bench.run(radians(70.0), change);
  }
  for (const int used : {2, 3, 4}) bench.run_rig(used);
  bench.run_whole();
}

}  // namespace
}  // namespace panonav

int main(int argc, char** argv) {
  if (argc != 5) {
    std::fputs("narrow_pictures_bench MEMORY DATASET CROPS SEED\n", stderr);
    return 2;
  }
  try {
    panonav::run_all({argv[1], argv[2], std::atoi(argv[3]), std::strtoull(argv[4], nullptr, 10)});
  } catch (const panonav::Error& error) {
    std::fprintf(stderr, "%s\n", error.what());
    return 1;
  }
  return 0;
}

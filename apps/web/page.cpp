// Functions that a page calls (panonav.js): memories from bytes in emscripten's file system,
// pictures as the RGBA pixels that the browser decoded, answers as JSON. A function that cannot do
// its work returns 0 and stores one line of text at `error`; whoever gets a text frees it.

#include <emscripten.h>

#include <cmath>
#include <cstdlib>
#include <cstring>
#include <deque>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/core/text.hpp"
#include "panonav/geometry/angles.hpp"
#include "panonav/io/exif.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/memoriser.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/pipeline/place_recogniser.hpp"
#include "panonav_server/place_json.hpp"

namespace {

using namespace panonav;

char* copy_text(const std::string& text) {
  return ::strdup(text.c_str());
}

/// Returns `work()`; if it throws, 0, and stores the message.
template <class Work>
auto answer(char** error, const Work& work) -> decltype(work()) {
  try {
    return work();
  } catch (const std::exception& fault) {
    *error = copy_text(fault.what());
    return {};
  }
}

std::string to_text(const nlohmann::ordered_json& json) {
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

/// Makes an observation of the pixels that a browser decoded. `field_of_view_deg`: angle between
/// the left and the right edge of a narrow picture; 0: it shows all azimuths.
Observation to_observation(const std::uint8_t* rgba, int width, int height, const char* name,
                           double field_of_view_deg) {
  Image image(width, height, 3);
  std::uint8_t* to = image.pixels().data();
  for (std::size_t i = 0; i < image.pixels().size() / 3; ++i) {
    std::memcpy(to + 3 * i, rgba + 4 * i, 3);
  }
  Observation observation(std::move(image));
  observation.name = name;
  if (field_of_view_deg != 0.0) {
    observation.narrow_source = PictureSource{.kind = PictureKind::pinhole,
                                              .field_of_view_rad = radians(field_of_view_deg)};
  }
  return observation;
}

/// A memory with the recogniser of its places.
class OpenMemory {
 public:
  explicit OpenMemory(const char* path)
      : file_(MemoryFile::open(path, Access::read_only)), recogniser_(file_) {}

  [[nodiscard]] const PlaceRecogniser& recogniser() const noexcept { return recogniser_; }
  [[nodiscard]] const MemoryFile& file() const noexcept { return file_; }
  /// Describes the views for a map and a gallery.
  [[nodiscard]] nlohmann::ordered_json describe() const {
    auto views = nlohmann::ordered_json::array();
    for (const PlacedView& view : list_placed_views()) views.push_back(view);
    const PictureSource& source = file_.header().source;
    return {{"kind", panonav::to_string(source.kind)},
            {"unit", panonav::to_string(recogniser_.length_unit())},
            {"is_from_map", has_positions_from_map(file_)},
            {"thumbnails", file_.views_with_thumbnail().size()},
            {"takes_narrow_pictures", has_narrow_features(file_)},
            {"views", std::move(views)}};
  }

 private:
  using PlacedView = nlohmann::ordered_json;
  [[nodiscard]] std::vector<PlacedView> list_placed_views() const {
    std::vector<PlacedView> views;
    file_.read_views([&](ViewId id, const ReferenceInfo& info, const PackedSignature&) {
      PlacedView view{{"id", id.value}, {"name", to_readable_line(info.name)}};
      if (info.pose) {
        view["x"] = info.pose->x_m;
        view["y"] = info.pose->y_m;
        if (info.pose->heading_rad) view["heading_rad"] = *info.pose->heading_rad;
      }
      views.push_back(std::move(view));
    });
    return views;
  }

  MemoryFile file_;
  PlaceRecogniser recogniser_;
};

/// A memory of 360 degree pictures that is being made, which narrow pictures can be compared with.
/// The first pictures wait for its full scale.
/// The page encodes the thumbnails, for which a browser has the codecs.
class MemoryMaker {
 public:
  explicit MemoryMaker(const char* path) : path_(path) {}

  void add(Observation observation) {
    observation.picture = to_grey(std::get<Image>(observation.picture).view());
    waiting_.push_back(std::move(observation));
  }
  /// Encodes the next picture that can be stored and returns its thumbnail; null if there is none.
  /// `is_last`: no picture will be added.
  const Image* encode_next(bool is_last) {
    if (waiting_.empty()) return nullptr;
    if (!file_) {
      if (!is_last && waiting_.size() < Memoriser::scale_views) return nullptr;
      begin();
    }
    const Observation observation = std::move(waiting_.front());
    waiting_.pop_front();
    const Panorama panorama = encoder_->panorama(observation);
    encoded_ = NewView{.info = {observation.name, {}, {}},
                       .signature = encoder_->packed(panorama),
                       .features = feature_encoder_->packed(observation, panorama)};
    thumbnail_ = make_thumbnail(panorama);
    return &thumbnail_;
  }
  /// Stores the picture that was encoded last.
  void store(std::vector<std::uint8_t> thumbnail) {
    encoded_.thumbnail = std::move(thumbnail);
    file_->append(std::exchange(encoded_, {}));
  }
  void finish() {
    if (!file_) throw ContractError("pictures", std::string_view("none"), "one or more");
    learn_and_store_models(*file_);
    file_.reset();
  }

 private:
  void begin() {
    Executor executor(1);
    const PictureSource source{.kind = PictureKind::equirectangular};
    const std::vector<Observation> first(waiting_.begin(), waiting_.end());
    const MemoryHeader header = make_memory_header(first, source, {}, {}, executor);
    file_.emplace(MemoryFile::create(path_, header));
    set_narrow_features(*file_);
    encoder_.emplace(header, source);
    feature_encoder_.emplace(header, source, true);
  }

  std::string path_;
  std::deque<Observation> waiting_;
  std::optional<MemoryFile> file_;
  std::optional<ViewEncoder> encoder_;
  std::optional<FeatureEncoder> feature_encoder_;
  NewView encoded_;
  Image thumbnail_{1, 1};
};

}  // namespace

extern "C" {

EMSCRIPTEN_KEEPALIVE OpenMemory* panonav_open(const char* memory, char** error) {
  return answer(error, [&] { return new OpenMemory(memory); });
}
EMSCRIPTEN_KEEPALIVE void panonav_close(OpenMemory* memory) {
  delete memory;
}
/// Returns the kind of the pictures, the unit of positions, and the views with their positions.
EMSCRIPTEN_KEEPALIVE char* panonav_describe(const OpenMemory* memory, char** error) {
  return answer(error, [&] { return copy_text(to_text(memory->describe())); });
}
/// Returns the file of a view's thumbnail and stores its size; 0 if there is none.
EMSCRIPTEN_KEEPALIVE std::uint8_t* panonav_thumbnail(const OpenMemory* memory, std::uint32_t view,
                                                     std::size_t* size, char** error) {
  return answer(error, [&]() -> std::uint8_t* {
    const auto bytes = memory->file().thumbnail(ViewId{view});
    if (!bytes) return nullptr;
    auto* const copy = static_cast<std::uint8_t*>(std::malloc(bytes->size()));
    std::memcpy(copy, bytes->data(), bytes->size());
    *size = bytes->size();
    return copy;
  });
}
/// Returns what `panonav localise --json` prints of the picture. `field_of_view_deg`: see
/// `to_observation`.
EMSCRIPTEN_KEEPALIVE char* panonav_localise(const OpenMemory* memory, const std::uint8_t* rgba,
                                            int width, int height, const char* name,
                                            double field_of_view_deg, char** error) {
  return answer(error, [&] {
    const PlaceRecogniser& recogniser = memory->recogniser();
    const Place place =
        recogniser.localise(to_observation(rgba, width, height, name, field_of_view_deg));
    nlohmann::ordered_json json{{"file", name}};
    json.update(server::place_json(place));
    json["turned_rad"] = 0.0;
    server::rename_lengths(json, recogniser.length_unit());
    return copy_text(to_text(json));
  });
}

/// Returns the angle between the left and the right edge, in degrees, that the EXIF data of a JPEG
/// file state for its picture of this size; 0 if there are none.
EMSCRIPTEN_KEEPALIVE double panonav_field_of_view(const std::uint8_t* jpeg, std::size_t size,
                                                  int width, int height) {
  const auto focal_length_mm = find_focal_length_35mm({jpeg, size});
  if (!focal_length_mm) return 0.0;
  const double focal_length_px = focal_length_from_35mm({width, height}, *focal_length_mm);
  return degrees(2.0 * std::atan(0.5 * width / focal_length_px));
}

EMSCRIPTEN_KEEPALIVE MemoryMaker* panonav_make(const char* memory) {
  return new MemoryMaker(memory);
}
EMSCRIPTEN_KEEPALIVE int panonav_add(MemoryMaker* maker, const std::uint8_t* rgba, int width,
                                     int height, const char* name, char** error) {
  return answer(error, [&] {
    maker->add(to_observation(rgba, width, height, name, 0.0));
    return 1;
  });
}
/// Encodes a picture that was added, and stores the address, width and height of the grey pixels of
/// its thumbnail. Returns 0 if no picture can be stored yet.
EMSCRIPTEN_KEEPALIVE int panonav_encode_next(MemoryMaker* maker, int is_last,
                                             std::uintptr_t* thumbnail, char** error) {
  return answer(error, [&] {
    const Image* const image = maker->encode_next(is_last != 0);
    if (image == nullptr) return 0;
    thumbnail[0] = reinterpret_cast<std::uintptr_t>(image->view().data);
    thumbnail[1] = static_cast<std::uintptr_t>(image->width());
    thumbnail[2] = static_cast<std::uintptr_t>(image->height());
    return 1;
  });
}
/// Stores the encoded picture with the file of its thumbnail.
EMSCRIPTEN_KEEPALIVE int panonav_store(MemoryMaker* maker, const std::uint8_t* thumbnail,
                                       std::size_t size, char** error) {
  return answer(error, [&] {
    maker->store({thumbnail, thumbnail + size});
    return 1;
  });
}
/// Learns the models of the stored pictures, and ends the maker.
EMSCRIPTEN_KEEPALIVE int panonav_finish(MemoryMaker* maker, char** error) {
  const int done = answer(error, [&] {
    maker->finish();
    return 1;
  });
  delete maker;
  return done;
}
EMSCRIPTEN_KEEPALIVE void panonav_discard(MemoryMaker* maker) {
  delete maker;
}

}  // extern "C"

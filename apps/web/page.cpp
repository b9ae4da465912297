// Functions that a page calls (panonav.js): memories from bytes in emscripten's file system,
// pictures as the RGBA pixels that the browser decoded, answers as JSON. A function that cannot do
// its work returns 0 and stores one line of text at `error`; whoever gets a text frees it.

#include <emscripten.h>

#include <cstring>
#include <optional>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/memoriser.hpp"
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

Observation to_observation(const std::uint8_t* rgba, int width, int height, const char* name) {
  Image image(width, height, 3);
  std::uint8_t* to = image.pixels().data();
  for (std::size_t i = 0; i < image.pixels().size() / 3; ++i) {
    std::memcpy(to + 3 * i, rgba + 4 * i, 3);
  }
  Observation observation(std::move(image));
  observation.name = name;
  return observation;
}

/// A memory of 360 degree pictures that is being made. The first pictures wait for its full scale.
class MemoryMaker {
 public:
  explicit MemoryMaker(const char* path) : path_(path) {}

  void add(Observation observation) {
    observation.picture = to_grey(std::get<Image>(observation.picture).view());
    if (file_) return append(observation);
    waiting_.push_back(std::move(observation));
    if (waiting_.size() == Memoriser::scale_views) begin();
  }
  void finish() {
    if (!file_) begin();
    learn_and_store_models(*file_);
    file_.reset();
  }

 private:
  void begin() {
    Executor executor(1);
    const PictureSource source{.kind = PictureKind::equirectangular};
    const MemoryHeader header = make_memory_header(waiting_, source, {}, {}, executor);
    file_.emplace(MemoryFile::create(path_, header));
    encoder_.emplace(header, source);
    for (const Observation& observation : waiting_) append(observation);
    waiting_.clear();
  }
  void append(const Observation& observation) {
    const Panorama panorama = encoder_->panorama(observation);
    file_->append(NewView{.info = {observation.name, {}, {}},
                          .signature = encoder_->packed(panorama),
                          .features = pack(encoder_->features(panorama).value())});
  }

  std::string path_;
  std::vector<Observation> waiting_;
  std::optional<MemoryFile> file_;
  std::optional<ViewEncoder> encoder_;
};

}  // namespace

extern "C" {

EMSCRIPTEN_KEEPALIVE PlaceRecogniser* panonav_open(const char* memory, char** error) {
  return answer(error, [&] { return new PlaceRecogniser(memory); });
}
EMSCRIPTEN_KEEPALIVE void panonav_close(PlaceRecogniser* recogniser) {
  delete recogniser;
}
/// Returns what `panonav localise --json` prints of the picture.
EMSCRIPTEN_KEEPALIVE char* panonav_localise(const PlaceRecogniser* recogniser,
                                            const std::uint8_t* rgba, int width, int height,
                                            const char* name, char** error) {
  return answer(error, [&] {
    const Place place = recogniser->localise(to_observation(rgba, width, height, name));
    nlohmann::ordered_json json{{"file", name}};
    json.update(server::place_json(place));
    json["turned_rad"] = 0.0;
    server::rename_lengths(json, recogniser->length_unit());
    return copy_text(json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  });
}

EMSCRIPTEN_KEEPALIVE MemoryMaker* panonav_make(const char* memory) {
  return new MemoryMaker(memory);
}
EMSCRIPTEN_KEEPALIVE int panonav_add(MemoryMaker* maker, const std::uint8_t* rgba, int width,
                                     int height, const char* name, char** error) {
  return answer(error, [&] {
    maker->add(to_observation(rgba, width, height, name));
    return 1;
  });
}
/// Stores what was added, and ends the maker.
EMSCRIPTEN_KEEPALIVE int panonav_finish(MemoryMaker* maker, char** error) {
  const int done = answer(error, [&] {
    maker->finish();
    return 1;
  });
  delete maker;
  return done;
}

}  // extern "C"

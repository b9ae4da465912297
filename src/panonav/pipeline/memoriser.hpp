#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "panonav/core/error.hpp"
#include "panonav/core/executor.hpp"
#include "panonav/pipeline/memory_map.hpp"
#include "panonav/pipeline/narrow_features.hpp"
#include "panonav/pipeline/view_encoder.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav {

/// Options for memorising observations, and for new files.
struct MemoriserOptions {
  /// Kind and layout of the pictures. Empty: those of the file; a new file needs it.
  std::optional<PictureSource> source;
  SignatureOptions signature;          ///< of a new file
  PreprocessingOptions preprocessing;  ///< of a new file
  bool thumbnails = true;              ///< keep small pictures of the views for people
  /// Store local features (about 4 kB for each view), which distinguish places 1 to 2 m apart. Not
  /// stored if elevations are unknown.
  bool features = true;
  /// Store features by which narrow pictures are localised (17 kB for each view): of a new file.
  /// Views that are added to a file have them if its first ones do.
  bool narrow = false;
  /// Make a map of views that have no positions from a data set (`map_views`).
  bool map = true;
  /// Callback for each observation that is left out because its image does not fit the others, for
  /// example in size; empty: `add` throws instead.
  std::function<void(const Observation&, const Error&)> left_out;
};

/// Makes the header of a new memory: takes the sizes from the first observation, and the full scale
/// from all observations in `first`. Throws ContractError on options that do not fit the images,
/// FileError if an image has no structure.
[[nodiscard]] MemoryHeader make_memory_header(std::span<const Observation> first,
                                              const PictureSource& source,
                                              const SignatureOptions& signature,
                                              const PreprocessingOptions& preprocessing,
                                              Executor& executor);

/// Makes the header of a new memory from the first images of a recording, so that light and scene
/// need not be known. Throws like `make_memory_header`, and FileError on images that cannot be
/// read.
[[nodiscard]] MemoryHeader make_header_from_recording(const Dataset& recording,
                                                      const SignatureOptions& signature,
                                                      const PreprocessingOptions& preprocessing,
                                                      Executor& executor);

/// Appends observations to a memory file, which is created if it does not exist:
///   panonav::Memoriser memoriser("office.panonav", {.source = source});
///   memoriser.add(observation);
///   memoriser.finish();
/// A new file appears with the `scale_views`th observation; from then on a view is on the disk when
/// `add` returns. The stored views depend neither on the size of batches nor on the number of
/// threads. One thread at a time.
///
/// A new view continues a path if the observation before it is the last view of the memory and
/// their names show no other video or folder; otherwise it begins a path (`read_path_starts`). The
/// only observation of a `Memoriser` continues that of the last view, so that images can also be
/// added one at a time.
class Memoriser {
 public:
  /// Number of observations from which the full scale of a new memory is computed.
  static constexpr std::size_t scale_views = 32;

  /// Throws FileError like `MemoryFile::open`; ContractError like `ViewEncoder`, and if a new file
  /// has no source.
  explicit Memoriser(const std::filesystem::path& memory, MemoriserOptions options = {});

  /// Adds an observation; its name becomes the view's. An observation with a known name must have
  /// the same pose, stamp and picture, and is not stored again. Throws ContractError on an empty
  /// name; FileError if the name belongs to a different view; else like `ViewEncoder::panorama`.
  void add(Observation observation);
  /// Adds observations: encodes them on all threads and stores them in one transaction. If one is
  /// rejected, those before it are stored.
  void add(std::vector<Observation> observations, Executor& executor);

  /// Numbers of observations by their outcome.
  struct Counts {
    std::size_t appended = 0;      ///< views added to the file
    std::size_t known_before = 0;  ///< observations that were in the file already
    std::optional<MemoryMap> map;  ///< from which the views have their positions
  };
  /// Writes observations that wait for a new file's full scale, makes or extends the map
  /// (`map_views`), and learns and stores the models (`learn_and_store_models`). More observations
  /// may be added afterwards. Throws FileError; ContractError if a new file got no observation.
  Counts finish();
  /// Finishes on all threads. Calls `mapped` after each view of the map.
  Counts finish(Executor& executor, const std::function<void()>& mapped = {});

  /// Reports an observation that the file already has, without its image, in its turn: its odometry
  /// is used for the map, and a new view may follow it.
  void recall(const std::string& name, const std::optional<Pose2>& odometry);
  /// Finds images of a recording whose views were renamed, so that they are not stored again: the
  /// view is next to that of a neighbouring image, has a name that the recording lacks, and the
  /// same picture, stamp and (if the image has one) pose. Cost: reads images beside known ones.
  void recognise_renamed(const Dataset& recording);
  /// Returns the view of the observation, also a renamed one; nullopt if the file has none.
  [[nodiscard]] std::optional<ViewId> find(const std::string& name) const;

  /// Returns the file; null while a new file waits for its full scale.
  [[nodiscard]] MemoryFile* file() noexcept { return file_ ? &*file_ : nullptr; }
  /// Returns the encoder that makes views of pictures; null if `file()` is null.
  [[nodiscard]] const ViewEncoder* encoder() const noexcept {
    return encoder_ ? &*encoder_ : nullptr;
  }

 private:
  void convert_large_waiting(Executor& executor);
  void make_file(Executor& executor);
  void make_encoders(const PictureSource& source);
  [[nodiscard]] MemoryHeader make_header_from_waiting(Executor& executor) const;
  void store(std::span<const Observation> observations, Executor& executor);
  void require_same_view(const Observation& observation, const PackedSignature& signature,
                         ViewId view);
  void append(std::vector<NewView>& views, std::vector<std::size_t>& path_starts);
  [[nodiscard]] bool does_begin_path(const std::string& name, bool is_first_of_batch) const;
  [[nodiscard]] bool is_on_path_of_last_view(const std::string& name) const;

  std::filesystem::path path_;
  MemoriserOptions options_;
  std::vector<Observation> waiting_;
  std::optional<MemoryFile> file_;
  std::optional<ViewEncoder> encoder_;
  std::optional<FeatureEncoder> feature_encoder_;
  Counts counts_;
  std::map<std::string, Pose2> odometry_;  // by the name of the view
  std::map<std::string, ViewId> renamed_;  // by the name of the observation
  std::optional<std::string> before_;      // name of the observation before
  std::optional<ViewId> known_before_;     // its view; nullopt: it is new
  bool has_recalled_ = false;              // an observation was in the file
  std::optional<ViewId> lone_start_;       // the only view so far, where a path may begin
};

}  // namespace panonav

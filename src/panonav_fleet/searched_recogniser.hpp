#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <span>
#include <string>

#include "panonav/pipeline/place_recogniser.hpp"

namespace panonav::fleet {

/// What the searches of a recogniser came to so far.
struct SearchCounters {
  std::uint64_t searches = 0;    ///< exact searches, of which a picture needs one or two
  std::uint64_t views_read = 0;  ///< that were read in full for them
  double seconds = 0.0;          ///< that they took, the server's part included
};

/// A `PlaceRecogniser` of a memory that is not held: it keeps sketches of its views (`PlaceSearch`)
/// and reads for each picture the views that its answer looks at: those that the search finds,
/// references around them, and 80 drawn views of chance. For memories on a server that are larger
/// than a machine. What is learnt of a memory takes views of all of it; of up to `learnt_views`
/// views it is as `PlaceRecogniser` has it, and so are the answers, to the bit, but for
/// `bytes_read`. Of larger ones it is what was kept last (`keep_models`), whichever views came
/// since, and where nothing was kept it is learnt from whole areas with that many views in all:
/// then places elsewhere that look alike count less than they should. Several threads may ask at a
/// time, each with a connection of its own.
class SearchedRecogniser {
 public:
  /// Views of which models are learnt at most, where nothing else is said.
  static constexpr std::size_t default_learnt_views = 20000;

  /// Throws as `PlaceSearch` and `PlaceRecogniser`; ContractError where areas are wanted, which are
  /// cut out of the positions of all views.
  explicit SearchedRecogniser(const std::filesystem::path& memory,
                              const PlaceRecogniserOptions& options = {},
                              std::size_t learnt_views = default_learnt_views);
  ~SearchedRecogniser();
  /// What is left of the other may only be destroyed or assigned to.
  SearchedRecogniser(SearchedRecogniser&&) noexcept;
  SearchedRecogniser& operator=(SearchedRecogniser&&) noexcept;

  /// Views called `excluded_names` are not found. Throws as `ViewEncoder::panorama`, FileError when
  /// the server cannot be reached; the next picture may find it again.
  [[nodiscard]] Place localise(const Observation& observation,
                               std::span<const std::string> excluded_names = {}) const;

  /// Takes over which views came and went since, as `PlaceSearch::refresh`, and what was learnt of
  /// them. Pictures are answered meanwhile. Not from two threads at a time.
  bool refresh();

  [[nodiscard]] std::size_t size() const;                     ///< Views that can be found.
  [[nodiscard]] std::uint64_t bytes() const;                  ///< That sketches and ids take.
  [[nodiscard]] SearchCounters counters() const;              ///< Since it was made.
  [[nodiscard]] const ViewEncoder& encoder() const noexcept;  ///< What makes queries of pictures.

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::fleet

#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/ids.hpp"
#include "panonav/geometry/pose2.hpp"
#include "panonav/signature/fourier_signature.hpp"

namespace panonav {

/// Pose of a reference view. The heading is optional, as some recordings contain positions only.
struct ReferencePose {
  double x_m = 0.0;                   ///< in the frame of the memory's positions
  double y_m = 0.0;                   ///< in the frame of the memory's positions
  std::optional<double> heading_rad;  ///< in the same frame, in [-pi, pi); empty: unknown
  [[nodiscard]] Point2 position() const { return {x_m, y_m}; }  ///< The pose without its heading.
  friend bool operator==(const ReferencePose&, const ReferencePose&) = default;
};

/// Name, pose and stamp of a view.
struct ReferenceInfo {
  std::string name;                   ///< unique within a memory; usually the image's file name
  std::optional<ReferencePose> pose;  ///< empty: unknown
  std::optional<double> stamp_s;      ///< when the picture was taken, in seconds; empty: unknown
  friend bool operator==(const ReferenceInfo&, const ReferenceInfo&) = default;
};

/// Two views between which a robot can move.
struct Link {
  /// Reason why two views are linked.
  enum class Kind {
    sequence,   ///< taken one after the other
    neighbour,  ///< adjacent in an arrangement by similarity
    closure     ///< the same place passed at another time
  };

  ViewId a;                    ///< one view
  ViewId b;                    ///< the other; links have no direction
  Kind kind = Kind::sequence;  ///< kind of the last link of both views
  friend bool operator==(const Link&, const Link&) = default;
};

/// A view that a search found.
struct Match {
  ViewId view;  ///< an id of the memory
  std::uint32_t dissimilarity =
      0;  ///< integer L1 of packed magnitudes over the compared components
  friend bool operator==(const Match&, const Match&) = default;
};

/// Number of views that a search finds, and the components that it compares.
struct SearchOptions {
  int top = 10;        ///< number of matches, >= 1
  int components = 0;  ///< 1 .. the memory's; 0 takes all
};

/// Restricts a search. Empty spans restrict nothing.
struct SearchMask {
  std::span<const ViewId> excluded_views;      ///< these are not found
  std::span<const std::uint8_t> allowed_rows;  ///< one entry per row; rows with 0 are ignored
};

/// Views that a search found, and its cost.
struct SearchResult {
  std::vector<Match> matches;       ///< ascending (dissimilarity, view)
  std::uint64_t bytes_read = 0;     ///< signature and index bytes that the search touched
  std::uint64_t bytes_in_full = 0;  ///< what a scan over all views would read
  std::uint64_t views_in_full = 0;  ///< number of views that were compared in full
};

/// The reference views that a robot remembers. Views keep their id for ever; ids grow in the
/// order of appending. Invariant: all signatures have one shape and one full scale. Reading from
/// several threads at once is safe; changing is not.
class VisualMemory {
 public:
  /// One level of hierarchical localisation [M04 section 2.3]: the candidate views that remain
  /// after `components` components have been compared.
  struct HierarchyLevel {
    int components = 0;  ///< compared at this level, m of [M04]
    /// Ascending (partial dissimilarity, view); nested in the level before.
    std::vector<Match> candidates;
    std::uint64_t bytes_read = 0;  ///< by all levels so far
    double limit =
        0.0;  ///< the candidates are all views whose partial dissimilarity is at most this
  };

  /// `full_scale`: magnitude that is packed as 255. Throws ContractError.
  VisualMemory(SignatureShape shape, float full_scale, std::optional<ElevationBand> elevations);
  ~VisualMemory();
  /// A moved-from memory may only be destroyed or assigned to.
  VisualMemory(VisualMemory&&) noexcept;
  VisualMemory& operator=(VisualMemory&&) noexcept;
  /// Copies all views and links.
  VisualMemory(const VisualMemory&);
  VisualMemory& operator=(const VisualMemory&);

  [[nodiscard]] SignatureShape shape() const noexcept;  ///< Rows and components of every view.
  [[nodiscard]] float full_scale() const noexcept;      ///< Magnitude that is packed as 255.
  /// Elevations of the signatures' rows, the same for every view; nullopt: unknown.
  [[nodiscard]] const std::optional<ElevationBand>& elevations() const noexcept;
  [[nodiscard]] std::size_t size() const noexcept;  ///< Number of views.
  /// True if there is no view.
  [[nodiscard]] bool empty() const noexcept { return size() == 0; }

  /// Appends a view and returns its new id. Throws ContractError on another shape, a name that
  /// exists already, or info that `validate` (reference_validation.hpp) rejects; the memory is then
  /// unchanged.
  ViewId append(const PackedSignature& signature, ReferenceInfo info);
  /// Packs the signature (a magnitude of `full_scale()` becomes 255) and appends it as above.
  ViewId append(const FourierSignature& signature, ReferenceInfo info);
  /// Appends a view with this id, which must be larger than all earlier ids; for readers of files.
  void append_with_id(ViewId id, const PackedSignature& signature, ReferenceInfo info);
  /// Does the same with the bytes of a signature (`PackedSignature`).
  void append_with_id(ViewId id, std::span<const std::uint8_t> magnitudes,
                      std::span<const std::uint8_t> phases, ReferenceInfo info);
  /// Removes a view and its links. Throws ContractError if there is no such view.
  void remove(ViewId view);

  /// Ascending.
  [[nodiscard]] std::span<const ViewId> views() const noexcept;
  /// True if the memory has this view. Cost: O(log n).
  [[nodiscard]] bool contains(ViewId view) const noexcept;
  /// Finds the view of that name; nullopt when there is none.
  [[nodiscard]] std::optional<ViewId> find(std::string_view name) const;
  /// Returns name, pose and stamp of a view. This and the next three functions throw ContractError
  /// if there is no such view.
  [[nodiscard]] const ReferenceInfo& info(ViewId view) const;
  /// Replaces the pose of a view; nullopt: unknown. Also throws ContractError if `validate` rejects
  /// the pose.
  void set_pose(ViewId view, std::optional<ReferencePose> pose);
  [[nodiscard]] PackedSignature packed(ViewId view) const;  ///< A copy of the view's bytes.
  /// Returns the unpacked signature of a view, with the precision of the packed form.
  [[nodiscard]] FourierSignature signature(ViewId view) const;

  /// Adds a link, which replaces an earlier link of the same two views. Throws ContractError unless
  /// both views exist and differ.
  void link(const Link& link);
  /// Removes the link between two views, in either order, if there is one.
  void unlink(ViewId a, ViewId b);
  [[nodiscard]] std::span<const Link> links() const noexcept;  ///< All links, each once.
  /// Returns the views that are linked with this view, ascending. Throws ContractError if there is
  /// no such view.
  [[nodiscard]] std::vector<ViewId> neighbours(ViewId view) const;

  /// Finds the nearest views by integer L1 over packed magnitudes: exactly those of a full scan,
  /// ties by id. Throws ContractError on another shape or options out of range.
  [[nodiscard]] SearchResult search(const PackedSignature& query, const SearchOptions& options = {},
                                    const SearchMask& mask = {}) const;

  /// Lists, for m = 1 .. components, the views whose partial dissimilarity is at most (1 +
  /// tolerance) times the best full dissimilarity known so far [M04 section 2.3]. Stops after a
  /// level for which `stop` returns true.
  [[nodiscard]] std::vector<HierarchyLevel> hierarchy(
      const PackedSignature& query, double tolerance, int components = 0,
      const std::function<bool(const HierarchyLevel&)>& stop = {},
      const SearchMask& mask = {}) const;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav

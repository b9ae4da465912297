#pragma once

#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "panonav/localisation/column_ranking.hpp"
#include "panonav/memory/view_index.hpp"

namespace panonav {

/// Gives a particle filter access to the views of a memory: all positions and, for each image, a
/// search and the column profiles of some views. The views may be held in RAM or in storage.
class ComparedViews {
 public:
  /// Callback that receives the profiles of a view and its index in the list of requested views.
  using ProfileCallback = std::function<void(std::size_t, std::shared_ptr<const ColumnProfiles>)>;

  virtual ~ComparedViews() = default;
  [[nodiscard]] virtual SignatureShape shape() const = 0;
  /// Number of Fourier components compared; 0: all.
  [[nodiscard]] virtual int components() const = 0;
  /// Returns all views with positions, ascending.
  [[nodiscard]] virtual std::vector<PosedView> posed_views() = 0;
  /// Returns the most similar views, at most `count`.
  [[nodiscard]] virtual std::vector<Match> search(const PackedSignature& view, int count) = 0;
  /// Passes the column profiles of each of these views that exists to `consume`.
  virtual void load(std::span<const ViewId> views, const ProfileCallback& consume) = 0;
  /// Ends the work with one image; changes by other users become visible at the next image.
  virtual void release() {}
};

/// Returns the views of a ranking's memory.
[[nodiscard]] std::unique_ptr<ComparedViews> make_compared_views(
    std::shared_ptr<const ColumnRanking> ranking);

/// Makes views that are read through an index, which `open_index` opens for each image.
[[nodiscard]] std::unique_ptr<ComparedViews> make_compared_views(
    std::function<std::unique_ptr<ViewIndex>()> open_index, SignatureShape shape);

}  // namespace panonav

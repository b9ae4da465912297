#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <vector>

#include "panonav/geometry/pose2.hpp"

namespace panonav {

/// Relative pose of two views in two pieces of a layout, p and q, that no spring connects.
struct CrossLink {
  std::size_t in_p, in_q;  ///< nodes
  Pose2 step;              ///< in_p_from_in_q
  double length;           ///< of the step, above 0
  double probability;      ///< 0 .. 1, that the step is right (`PairFeatures`)
};

/// One relative pose of two pieces that explains several cross links.
struct PieceJoin {
  Pose2 p_from_q;
  std::vector<std::size_t> agreeing;  ///< numbers of the links that agree with it
};

/// Returns the relative pose of two pieces that their cross links show; nullopt unless at least
/// three links of different views agree on it, at odds of 19 to 1 times `smaller_views`, the number
/// of views in the smaller piece. The odds are those against chance (as in join_evidence.hpp), less
/// those of the best other relative pose. Links that disagree count against it. As pieces are bent,
/// the tolerance of positions grows by a quarter of the distance from the place where they meet.
/// Cost: the square of the number of links.
[[nodiscard]] std::optional<PieceJoin> find_piece_join(std::span<const Pose2> poses,
                                                       std::span<const CrossLink> links,
                                                       std::size_t smaller_views);

/// Two pieces that were joined.
struct JoinedPieces {
  std::size_t smaller_views;          ///< views of the smaller piece
  std::vector<std::size_t> agreeing;  ///< numbers of the links that agree
};

/// Joins the pieces of a layout (`components` of the nodes) by their cross links, those with most
/// agreeing links first: moves the views of the smaller one and gives them the number of the larger
/// one. Links inside a piece are not used; pieces of fewer than `min_views` views are not joined.
[[nodiscard]] std::vector<JoinedPieces> join_pieces(std::span<const CrossLink> links,
                                                    std::vector<Pose2>& poses,
                                                    std::vector<std::size_t>& components,
                                                    std::size_t min_views);

/// Returns the numbers of links by which a robot can cross between two pieces, ascending: at most
/// three for each two pieces, the most probable ones that agree with the relative pose of the
/// largest evidence and are more probable than not.
[[nodiscard]] std::vector<std::size_t> choose_crossings(std::span<const CrossLink> links,
                                                        std::span<const Pose2> poses,
                                                        std::span<const std::size_t> components);

}  // namespace panonav

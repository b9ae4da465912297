#pragma once

#include "panonav/core/options.hpp"

namespace panonav {

/// Number of views that a localisation compares and lists.
struct LocaliserOptions {
  int top = 10;        ///< matches listed
  int components = 0;  ///< Fourier components compared, 0 for all
  /// Views compared column by column when those of least dissimilarity do not explain the query,
  /// because people stand in view or the light has changed. 0: the order of dissimilarity stays,
  /// and columns only decide whether the place is known.
  int reranked_views = 1000;
};
void visit_options(LocaliserOptions& options, OptionVisitor& visitor);

/// When a hierarchical localisation stops.
struct LocalisationAccuracy {
  int components = 0;     ///< at most, 0: the memory's
  double radius_m = 0.0;  ///< stop as soon as the circle is no larger; 0: never
  double tolerance =
      0.0;  ///< candidates are kept up to (1 + tolerance) times the best dissimilarity
};
void visit_options(LocalisationAccuracy& accuracy, OptionVisitor& visitor);

}  // namespace panonav

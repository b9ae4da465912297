#pragma once

#include "panonav/core/options.hpp"

namespace panonav {

/// Options of a localisation: how many views are compared and listed.
struct LocaliserOptions {
  int top = 10;        ///< matches listed
  int components = 0;  ///< Fourier components compared, 0 for all
  /// Number of views compared column by column if the most similar views do not explain the query
  /// because people stand in view or the light has changed. 0 sorts matches by dissimilarity;
  /// columns then decide only whether the place is known.
  int reranked_views = 1000;
};
void visit_options(LocaliserOptions& options, OptionVisitor& visitor);

/// Conditions under which a hierarchical localisation stops.
struct LocalisationAccuracy {
  int components = 0;     ///< largest number of compared Fourier components; 0: all
  double radius_m = 0.0;  ///< stop when the enclosing circle is at most this large; 0: never
  double tolerance =
      0.0;  ///< candidates are kept up to (1 + tolerance) times the best dissimilarity
};
void visit_options(LocalisationAccuracy& accuracy, OptionVisitor& visitor);

}  // namespace panonav

#include "panonav/localisation/localiser_options.hpp"

namespace panonav {

void visit_options(LocaliserOptions& options, OptionVisitor& visitor) {
  using T = LocaliserOptions;
  constexpr OptionTable table{
      option<&T::top>("number of matches to list", 1, 1e6),
      option<&T::components>("number of Fourier components to compare; 0: all", 0),
      option<&T::reranked_views>("if the most similar views do not match the image, compare this "
                                 "number of views column by column; 0: do not compare columns",
                                 0, 1e6),
  };
  table.visit(options, visitor);
}

}  // namespace panonav

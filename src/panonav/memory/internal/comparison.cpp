#include "panonav/memory/internal/comparison.hpp"

#include <string>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

std::string shape_text(SignatureShape shape) {
  return std::to_string(shape.rows) + " rows x " + std::to_string(shape.components) + " components";
}

}  // namespace

void require_signature(const PackedSignature& signature, SignatureShape shape) {
  if (!(signature.shape == shape)) {
    throw ContractError("signature shape", shape_text(signature.shape), shape_text(shape));
  }
  require_signature(signature.magnitudes, signature.phases, shape);
}

void require_signature(std::span<const std::uint8_t> magnitudes,
                       std::span<const std::uint8_t> phases, SignatureShape shape) {
  // The text is made only for an error, as a memory is loaded view by view.
  const auto require_size = [&](std::size_t size, const char* name) {
    if (size == shape.size()) return;
    throw ContractError(name, static_cast<double>(size),
                        to_text(static_cast<double>(shape.size())));
  };
  require_size(magnitudes.size(), "number of packed magnitudes");
  require_size(phases.size(), "number of packed phases");
}

int resolve_components(int components, SignatureShape shape) {
  require(components >= 0 && components <= shape.components, "components", components,
          "0 .. " + std::to_string(shape.components));
  return components == 0 ? shape.components : components;
}

void require_mask(const SearchMask& mask, SignatureShape shape) {
  const auto rows = static_cast<std::size_t>(shape.rows);
  require(mask.allowed_rows.empty() || mask.allowed_rows.size() == rows, "number of allowed rows",
          static_cast<double>(mask.allowed_rows.size()), "0 or " + std::to_string(rows));
}

Comparison::Comparison(const SearchedViews& searched, const PackedSignature& query, int components,
                       const SearchMask& mask, const kernels::DistanceKernels& kernels)
    : store_(searched.store),
      kernels_(kernels),
      components_(resolve_components(components, searched.shape)),
      component_bytes_(static_cast<std::size_t>(searched.shape.rows)) {
  require_signature(query, searched.shape);
  require_mask(mask, searched.shape);
  query_.assign(query.magnitudes.begin(), query.magnitudes.end());
  if (!mask.allowed_rows.empty()) {
    mask_.resize(bytes());
    for (std::size_t i = 0; i < mask_.size(); ++i) {
      mask_[i] = mask.allowed_rows[i % component_bytes_] != 0 ? 255 : 0;
    }
  }
  for (const ViewId view : mask.excluded_views) {
    const auto found = std::ranges::lower_bound(searched.views, view);
    if (found == searched.views.end() || *found != view) continue;
    excluded_rows_.push_back(searched.rows[found - searched.views.begin()]);
  }
  std::ranges::sort(excluded_rows_);
  excluded_rows_.erase(std::unique(excluded_rows_.begin(), excluded_rows_.end()),
                       excluded_rows_.end());
}

}  // namespace panonav

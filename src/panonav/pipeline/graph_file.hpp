#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "panonav/mapping/topological_map.hpp"

namespace panonav {

/// Writes a map as GraphML for graph viewers: nodes with `name`, `x_m`, `y_m`, `heading_rad` and
/// `component`, edges with `kind`, `weight` and the pose of the target in the frame of the source.
/// `name` returns the readable name of a view. Writes the file completely or not at all. Throws
/// ContractError like `validate(map)`; FileError.
void write_graph(const std::filesystem::path& path, const TopologicalMap& map,
                 const std::function<std::string(ViewId)>& name);

}  // namespace panonav

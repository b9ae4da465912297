#pragma once

#include <filesystem>
#include <functional>
#include <string>

#include "panonav/mapping/topological_map.hpp"

namespace panonav {

/// Writes a map as GraphML, which graph viewers read: nodes with `name`, `x_m`, `y_m`,
/// `heading_rad` and `component`, edges with `kind`, `weight` and the pose of the target in the
/// frame of the source. `name` returns the name of a view for people. The file appears whole or not
/// at all. Throws ContractError as `validate(map)`, FileError.
void write_graph(const std::filesystem::path& path, const TopologicalMap& map,
                 const std::function<std::string(ViewId)>& name);

}  // namespace panonav

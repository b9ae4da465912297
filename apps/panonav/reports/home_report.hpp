#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "reports/home_answer.hpp"

namespace panonav::command {

/// Writes index.html with up to four pairs of views, rotated to the same heading, and the direction
/// home. If positions are known, a map shows all home vectors. `current(i)` reads the panorama of
/// answer i. Throws FileError.
void write_home_report(const std::filesystem::path& folder, const Goal& goal,
                       const std::vector<HomeAnswer>& answers,
                       const std::function<Panorama(std::size_t)>& current);

}  // namespace panonav::command

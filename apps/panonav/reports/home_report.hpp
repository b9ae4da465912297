#pragma once

#include <filesystem>
#include <functional>
#include <vector>

#include "reports/home_answer.hpp"

namespace panonav::command {

/// Writes index.html and its pictures: both views turned into one frame with the way home, and
/// where positions are known all home vectors from above. `current(i)` reads the panorama of answer
/// i. Throws FileError.
void write_home_report(const std::filesystem::path& folder, const Goal& goal,
                       const std::vector<HomeAnswer>& answers,
                       const std::function<Panorama(std::size_t)>& current);

}  // namespace panonav::command

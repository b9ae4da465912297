#pragma once

#include <string>
#include <string_view>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "reports/localise_report.hpp"

namespace panonav::command {

/// Returns the answer as a JSON object in the format of docs/formats.md.
[[nodiscard]] ordered_json to_json(const LocalisedQuery& answer, bool areas);
/// The header of the CSV table (docs/formats.md).
inline constexpr std::string_view csv_header =
    "file,answer,known_probability,x_m,y_m,radius_m,heading_deg,best,dissimilarity,column_"
    "difference,turn_deg,next,next_dissimilarity,next_column_difference,error\n";
/// Returns the answer's row of the table; unknown values are empty.
[[nodiscard]] std::string csv_row(const LocalisedQuery& answer);
/// Formats the answer as a line of text, followed by one line for each requested area.
[[nodiscard]] std::string format_line(const LocalisedQuery& answer, Session& session);

}  // namespace panonav::command

#pragma once

#include <string>
#include <string_view>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "reports/localise_report.hpp"

namespace panonav::command {

/// Returns the answer as a JSON object in the format of docs/formats.md.
[[nodiscard]] ordered_json to_json(const LocalisedQuery& answer, bool areas);
/// Returns the header of the CSV table (docs/formats.md).
[[nodiscard]] std::string make_csv_header(LengthUnit unit);
/// Returns the answer's row of the table; unknown values are empty.
[[nodiscard]] std::string csv_row(const LocalisedQuery& answer);
/// Formats what is known of the position's error, as "within 0.10 m"; empty if nothing is.
[[nodiscard]] std::string format_bound(const PositionEstimate& position, LengthUnit unit);
/// Formats the answer as a line of text, followed by one line for each alternative place, followed
/// by one line for each requested area.
[[nodiscard]] std::string format_line(const LocalisedQuery& answer, Session& session);

}  // namespace panonav::command

#pragma once

#include <string>

#include "cli/json.hpp"
#include "cli/session.hpp"
#include "reports/localise_report.hpp"

namespace panonav::command {

/// One object, as docs/formats.md describes it.
[[nodiscard]] ordered_json as_json(const LocalisedQuery& answer, bool areas);
/// A line for people, and one for each area that was asked for.
[[nodiscard]] std::string as_text(const LocalisedQuery& answer, Session& session);

}  // namespace panonav::command

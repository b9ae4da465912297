#pragma once

#include <vector>

#include "cli/verb.hpp"

namespace panonav::command {

/// Makes what this build has beside the library known to it; called once, before a verb runs.
void register_outbuildings();

/// Every verb of this build, in the order in which a newcomer meets them.
[[nodiscard]] std::vector<Verb> all_verbs();

[[nodiscard]] Verb arrange_verb();
[[nodiscard]] Verb calibrate_verb();
[[nodiscard]] Verb catchment_verb();
[[nodiscard]] Verb completion_verb();
[[nodiscard]] Verb demo_verb();
[[nodiscard]] Verb evaluate_verb();
[[nodiscard]] Verb export_verb();
[[nodiscard]] Verb convert_verb();
[[nodiscard]] Verb copy_verb();
[[nodiscard]] Verb forget_verb();
[[nodiscard]] Verb gallery_verb();
[[nodiscard]] Verb help_verb();
[[nodiscard]] Verb home_verb();
[[nodiscard]] Verb info_verb();
[[nodiscard]] Verb list_verb();
[[nodiscard]] Verb localise_verb();
[[nodiscard]] Verb man_verb();
[[nodiscard]] Verb map_verb();
[[nodiscard]] Verb memorise_verb();
[[nodiscard]] Verb navigate_verb();
[[nodiscard]] Verb merge_verb();
[[nodiscard]] Verb prune_verb();
[[nodiscard]] Verb rename_verb();
[[nodiscard]] Verb reproduce_verb();
[[nodiscard]] Verb ros2_verb();
[[nodiscard]] Verb route_follow_verb();
[[nodiscard]] Verb route_record_verb();
[[nodiscard]] Verb serve_verb();
[[nodiscard]] Verb show_verb();
[[nodiscard]] Verb simulate_verb();
[[nodiscard]] Verb synchronise_verb();
[[nodiscard]] Verb track_verb();
[[nodiscard]] Verb run_verb();
[[nodiscard]] Verb undo_verb();
[[nodiscard]] Verb history_verb();
[[nodiscard]] Verb unwrap_verb();
[[nodiscard]] Verb verify_verb();

}  // namespace panonav::command

#include "cli/verbs.hpp"

namespace panonav::command {

std::vector<Verb> all_verbs() {
  return {
#ifdef PANONAV_COMMAND_SIMULATES
      demo_verb(),         simulate_verb(),
#endif
      calibrate_verb(),    unwrap_verb(),       memorise_verb(),    info_verb(),
      list_verb(),         show_verb(),         gallery_verb(),     export_verb(),
      convert_verb(),      verify_verb(),       rename_verb(),      forget_verb(),
      merge_verb(),        copy_verb(),         synchronise_verb(), prune_verb(),
      undo_verb(),         history_verb(),      localise_verb(),    track_verb(),
      run_verb(),          map_verb(),          arrange_verb(),     home_verb(),
      route_record_verb(), route_follow_verb(), serve_verb(),       ros2_verb(),
#ifdef PANONAV_COMMAND_SIMULATES
      navigate_verb(),     catchment_verb(),    evaluate_verb(),    reproduce_verb(),
#endif
      sweep_verb(),        help_verb(),         completion_verb(),  man_verb(),
  };
}

}  // namespace panonav::command

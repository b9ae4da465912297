#include <algorithm>
#include <map>

#include "cli/verbs.hpp"
#include "panonav/core/number_text.hpp"
#include "panonav/mapping/sparse_memory.hpp"
#include "panonav/pipeline/known_views.hpp"
#include "panonav/pipeline/learnt_models.hpp"
#include "panonav/pipeline/memory_map.hpp"

namespace panonav::command {

namespace {

struct PruneArguments {
  std::string memory;
  SparseMemoryOptions options;
  bool dry_run = false;
};

ordered_json to_json(const std::optional<SparseSelection::Loss::Positions>& positions) {
  if (!positions) return nullptr;
  return {{"median_before_m", positions->median_before_m},
          {"p95_before_m", positions->p95_before_m},
          {"median_after_m", positions->median_after_m},
          {"p95_after_m", positions->p95_after_m}};
}

/// Throws FileError if another program has changed views or links since the memory was loaded.
void require_unchanged(const MemoryFile& file, const VisualMemory& memory) {
  const auto views = memory.views();
  if (!std::ranges::equal(file.views(), views) || file.links().size() != memory.links().size()) {
    throw FileError(file.path().string(),
                    "was changed by another program during this command; try again");
  }
}

/// Rejects options for positions if no view has one, and options for links if all views have
/// positions.
void reject_options_without_effect(const Arguments& arguments, const std::string& file,
                                   const VisualMemory& memory) {
  const auto position_count = std::ranges::count_if(
      memory.views(), [&](ViewId view) { return memory.info(view).pose.has_value(); });
  if (position_count == 0) {
    arguments.reject_options({"--reach-m", "--outdated-within-m"},
                             "as " + file + " contains no positions");
  } else if (position_count == std::ssize(memory.views())) {
    arguments.reject_options({"--reach-links"},
                             "as " + file + " contains the positions of all views");
  }
}

/// Prints how many views were kept and how much the distance or difference to the nearest view
/// grows.
void print_loss(const PruneArguments& arguments, const SparseSelection::Loss& loss,
                std::size_t before, std::size_t kept, double factor, std::size_t outdated,
                const std::vector<std::string>& names, Session& session) {
  session.print(std::string(arguments.dry_run ? "would keep " : "kept ") +
                session.bold(std::to_string(kept)) + " of " + format_count(before, "view") + ": " +
                format_fixed(factor, 1) + " times fewer" +
                (outdated > 0 ? "; " + std::to_string(outdated) + " outdated" : ""));
  if (arguments.dry_run) {
    for (const std::string& name : names) session.print("  would delete  " + name);
  }
  if (loss.positions) {
    session.print("nearest reference of a deleted view  median " +
                  session.format_length(loss.positions->median_after_m, 3) + " (before " +
                  format_fixed(loss.positions->median_before_m, 3) + ")  95 % within " +
                  session.format_length(loss.positions->p95_after_m, 3) + " (before " +
                  format_fixed(loss.positions->p95_before_m, 3) + ")");
  } else if (loss.queries > 0) {
    session.print("deleted views differ from similar kept views by " +
                  format_fixed(loss.median_difference, 3) + " (median)");
  }
}

ExitCode prune(const Arguments& declared, const PruneArguments& arguments, Session& session) {
  auto file = MemoryFile::open(arguments.memory,
                               arguments.dry_run ? Access::read_only : Access::read_write);
  session.set_length_unit(read_length_unit(file));
  const VisualMemory memory = file.load();
  session.detail(format_count(memory.size(), "view") + " loaded");
  reject_options_without_effect(declared, arguments.memory, memory);
  const SparseSelection selection = select_references(memory, arguments.options);
  session.detail("redundant views: " + std::to_string(selection.redundant.size()));
  const SparseSelection::Loss loss = measure_loss(memory, selection);
  std::vector<ViewId> dropped;
  std::vector<std::string> names;
  std::size_t outdated = 0;
  for (const SparseSelection::Redundant& redundant : selection.redundant) {
    dropped.push_back(redundant.view);
    names.push_back(memory.info(redundant.view).name);
    outdated += redundant.outdated ? 1 : 0;
  }
  if (!arguments.dry_run && !dropped.empty()) {
    file.change(
        [&] {
          require_unchanged(file, memory);
          std::map<std::string, TopologicalMap> maps;
          for (const std::string& name : file.map_names()) {
            if (const auto map = file.map(name)) maps.emplace(name, contract_map(*map, selection));
          }
          forget_recordings(file);
          file.remove(dropped);
          file.link(contract_links(memory.links(), selection));
          for (const auto& [name, map] : maps) file.save_map(name, map);
          learn_and_store_models(file);
        },
        "prune: " + format_count(dropped.size(), "view") + " deleted");
  }
  const double factor = selection.kept.empty() ? 1.0
                                               : static_cast<double>(memory.size()) /
                                                     static_cast<double>(selection.kept.size());
  if (session.json()) {
    session.print(session.json_line(ordered_json{{"memory", arguments.memory},
                                                 {"dry_run", arguments.dry_run},
                                                 {"views_before", memory.size()},
                                                 {"views", selection.kept.size()},
                                                 {"dropped", names},
                                                 {"outdated", outdated},
                                                 {"factor", factor},
                                                 {"median_difference", loss.median_difference},
                                                 {"queries", loss.queries},
                                                 {"position_error", to_json(loss.positions)}}));
    return ExitCode::done;
  }
  print_loss(arguments, loss, memory.size(), selection.kept.size(), factor, outdated, names,
             session);
  if (!arguments.dry_run && !dropped.empty()) {
    session.suggest({"panonav", "undo", arguments.memory}, "To restore them:");
  }
  return ExitCode::done;
}

Run declare_prune(Arguments& arguments) {
  auto values = std::make_shared<PruneArguments>();
  arguments.positional("MEMORY", values->memory, "Memory file");
  arguments.flag("--dry-run", values->dry_run,
                 "List the views that would be deleted, but do not change the memory");
  arguments.options("prune", values->options);
  arguments.show_in_help({"--max-difference", "--reach-m", "--outdated-within-m"});
  arguments.explain_interruption(
      "The memory is as before. To start over, run the same command again.",
      [values] { return !values->dry_run; });
  return [values, &arguments](Session& session) { return prune(arguments, *values, session); };
}

}  // namespace

Verb prune_verb() {
  return {"prune",
          VerbGroup::memory,
          "Delete redundant views of a memory",
          "A view is deleted if a newer view near it differs from it by at most --max-difference. "
          "The verb reports how much smaller the memory becomes, and the distance to the nearest "
          "view before and after the deletion. panonav undo restores deleted views.",
          "  panonav prune office.panonav --dry-run\n"
          "  panonav prune office.panonav --max-difference 0.02\n"
          "  panonav prune office.panonav --outdated-within-m 0.3",
          declare_prune};
}

}  // namespace panonav::command

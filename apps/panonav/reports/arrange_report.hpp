#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

#include "panonav/mapping/lattice.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav_viewer/report_page.hpp"

namespace panonav::command {

/// Keeps how an arrangement unfolds: about a hundred of its steps, evenly chosen.
class LatticeSteps {
 public:
  /// For `arrange`; *this must outlive it.
  [[nodiscard]] LatticeStepCallback watch();
  /// The steps as a map that unfolds. Groups of views are laid over where they end, as they are
  /// turned and deformed then; views alone and in pairs are not drawn. Of long arrangements
  /// fewer steps and the two shortest springs of each view, so that a page stays small.
  [[nodiscard]] viewer::UnfoldingMap unfold(const Lattice& lattice,
                                            const VisualMemory& memory) const;

 private:
  struct Step {
    std::size_t number = 0;
    std::vector<Pose2> poses;
    std::vector<std::size_t> components;
  };
  std::vector<Step> steps_;
  std::size_t count_ = 0;
  std::size_t every_ = 1;
};

/// Writes index.html: the arrangement as it unfolds, beside the true places where they are known,
/// and its components. Throws FileError.
void write_arrange_report(const std::filesystem::path& folder, const std::string& name,
                          const Lattice& lattice, const VisualMemory& memory,
                          const LatticeSteps& steps);

}  // namespace panonav::command

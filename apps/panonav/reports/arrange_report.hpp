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

/// Stores about a hundred steps of an arrangement, at equal intervals.
class LatticeSteps {
 public:
  /// Returns the callback for `arrange` that stores steps. *this must outlive the callback.
  [[nodiscard]] LatticeStepCallback step_callback();
  /// Returns the steps as an animated map. Each group of views is aligned with its final position,
  /// but keeps the shape of the step; groups of one or two views are not drawn. Large arrangements
  /// get fewer steps and only the shortest springs of each view, so that the page stays small.
  [[nodiscard]] viewer::MapAnimation make_animation(const Lattice& lattice,
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

/// Writes index.html with the animated arrangement, the true positions if they are known, and a
/// table of the components. Throws FileError.
void write_arrange_report(const std::filesystem::path& folder, const std::string& name,
                          const Lattice& lattice, const VisualMemory& memory,
                          const LatticeSteps& steps);

}  // namespace panonav::command

#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string_view>
#include <vector>

#include "panonav/memory/view_index.hpp"
#include "panonav/storage/memory_file.hpp"

namespace panonav::fleet {

/// Searches a memory exactly without holding it: keeps a sketch of each view (350 bytes for 80 x
/// 15) and, for each query, reads the few views that can be among the nearest. For memories on a
/// server that do not fit into a machine, and for any number of machines that search one memory; it
/// writes nothing. Memory files can be searched as well. Several threads may use one object; each
/// gets its own connection.
class PlaceSearch final : public IndexedMemory {
 public:
  /// Reads the magnitudes of all views once, with one connection for each core of the machine (at
  /// most 16). Throws FileError as `MemoryFile::open`, and on views of another shape. Checksums
  /// cover whole rows, so only views that a search reads in full are checked.
  explicit PlaceSearch(const std::filesystem::path& memory);
  ~PlaceSearch() override;
  /// A moved-from object may only be destroyed or assigned to.
  PlaceSearch(PlaceSearch&&) noexcept;
  PlaceSearch& operator=(PlaceSearch&&) noexcept;

  [[nodiscard]] const MemoryHeader& header() const noexcept;  ///< Fixed when the memory was made.
  [[nodiscard]] std::size_t size() const override;  ///< Returns the number of sketched views.
  [[nodiscard]] std::vector<ViewId> views() const override;
  [[nodiscard]] std::uint64_t bytes() const override;  ///< Returns the size of sketches and ids.
  [[nodiscard]] SearchCounters counters() const override;

  /// Shows the memory at one moment, for one query; later changes are invisible. Only one thread
  /// may use it, and only briefly, because it holds a transaction open. The PlaceSearch must
  /// outlive it. All functions throw FileError if the server cannot be reached, and for a view that
  /// does not match its checksum.
  class Snapshot final : public ViewIndex {
   public:
    ~Snapshot() override;
    /// A moved-from object may only be destroyed or assigned to.
    Snapshot(Snapshot&&) noexcept;
    Snapshot& operator=(Snapshot&&) noexcept;

    [[nodiscard]] std::size_t size()
        const noexcept override;  ///< Returns the number of sketched views.
    /// Searches, as `VisualMemory::search`, the sketched views that the memory still has. It needs
    /// one or two statements, more if many views look similar. Uses all cores while no other
    /// search of this memory runs.
    [[nodiscard]] SearchResult search(const PackedSignature& query, const SearchOptions& options,
                                      const SearchMask& mask) override;
    /// Loads those of the views that the memory has, without links, by one statement; views that
    /// this snapshot has read before are not read again.
    [[nodiscard]] VisualMemory load(std::span<const ViewId> views) override;
    [[nodiscard]] std::optional<ViewId> find(std::string_view name) override;
    [[nodiscard]] std::vector<ViewId> views_within(std::span<const PositionBounds> bounds) override;
    [[nodiscard]] std::vector<PosedView> posed_views() override;

   private:
    friend class PlaceSearch;
    struct Implementation;
    explicit Snapshot(std::unique_ptr<Implementation> implementation);
    std::unique_ptr<Implementation> implementation_;
  };
  /// Begins a snapshot. Throws FileError if the server cannot be reached; a later call may succeed.
  [[nodiscard]] Snapshot snapshot() const;
  [[nodiscard]] std::unique_ptr<ViewIndex> index() const override;  ///< Begins a snapshot.
  /// Searches in a new snapshot.
  [[nodiscard]] SearchResult search(const PackedSignature& query, const SearchOptions& options = {},
                                    const SearchMask& mask = {}) const;

  /// Updates the sketches: compares the areas that the server reports as changed, or the ids of all
  /// views if it reports none in particular. Searches can continue at the same time. Returns true
  /// if anything changed. Throws FileError; the sketches then stay as they were, and the next call
  /// compares all ids.
  bool refresh() override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::fleet

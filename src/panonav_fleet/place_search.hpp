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

/// Exact search in a memory that is not held: of each view it keeps a sketch (350 bytes for 80 x
/// 15) and reads the few views that can be among the nearest when it is asked. For memories on a
/// server that are larger than a machine, and for any number of machines that search one memory;
/// nothing is written. A memory file is searched the same way. Several threads may use one object,
/// each with a connection of its own.
class PlaceSearch final : public IndexedMemory {
 public:
  /// Reads the magnitudes of all views once, with as many connections as the machine has cores.
  /// Throws FileError as `MemoryFile::open`, and on views of another shape. Checksums cover whole
  /// rows, and only what a search reads in full is checked.
  explicit PlaceSearch(const std::filesystem::path& memory);
  ~PlaceSearch() override;
  /// A moved-from object may only be destroyed or assigned to.
  PlaceSearch(PlaceSearch&&) noexcept;
  PlaceSearch& operator=(PlaceSearch&&) noexcept;

  [[nodiscard]] const MemoryHeader& header() const noexcept;  ///< Fixed when the memory was made.
  [[nodiscard]] std::size_t size() const override;            ///< Views that are sketched.
  [[nodiscard]] std::vector<ViewId> views() const override;
  [[nodiscard]] std::uint64_t bytes() const override;  ///< That sketches and ids take.
  [[nodiscard]] SearchCounters counters() const override;

  /// The memory at one moment, for the questions of one query: what others change meanwhile is not
  /// seen. One thread uses it, and not for longer than it takes: it holds a transaction open. The
  /// search must outlive it. All throw FileError when the server cannot be reached, and on a view
  /// that does not match its checksum.
  class Snapshot final : public ViewIndex {
   public:
    ~Snapshot() override;
    /// A moved-from object may only be destroyed or assigned to.
    Snapshot(Snapshot&&) noexcept;
    Snapshot& operator=(Snapshot&&) noexcept;

    [[nodiscard]] std::size_t size() const noexcept override;  ///< Views that are sketched.
    /// As `VisualMemory::search` over those views that are sketched and that the memory has: one or
    /// two statements to the server, a few where many views look alike. On all cores while no other
    /// search of this memory runs.
    [[nodiscard]] SearchResult search(const PackedSignature& query, const SearchOptions& options,
                                      const SearchMask& mask) override;
    /// Those of the views that the memory has, without links, in one statement; what this snapshot
    /// read before is not read again.
    [[nodiscard]] VisualMemory load(std::span<const ViewId> views) override;
    [[nodiscard]] std::optional<ViewId> find(std::string_view name) override;
    [[nodiscard]] std::vector<ViewId> views_within(std::span<const PositionBounds> bounds) override;

   private:
    friend class PlaceSearch;
    struct Implementation;
    explicit Snapshot(std::unique_ptr<Implementation> implementation);
    std::unique_ptr<Implementation> implementation_;
  };
  /// Throws FileError when the server cannot be reached; the next one may find it again.
  [[nodiscard]] Snapshot snapshot() const;
  [[nodiscard]] std::unique_ptr<ViewIndex> index() const override;  ///< The same.
  /// One search of a snapshot of its own.
  [[nodiscard]] SearchResult search(const PackedSignature& query, const SearchOptions& options = {},
                                    const SearchMask& mask = {}) const;

  /// Takes over which views came and went since: of a server that tells which areas changed, those
  /// areas are compared, otherwise the ids of all views. Searches go on
  /// meanwhile. Returns whether anything changed that others told or that was found. Throws
  /// FileError; then what is sketched stays, and the next call compares all.
  bool refresh() override;

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav::fleet

#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/memory/view_index.hpp"
#include "panonav/memory/visual_memory.hpp"
#include "panonav/panorama/picture.hpp"
#include "panonav/panorama/picture_source.hpp"
#include "panonav/panorama/preprocessing.hpp"

namespace panonav {

class RoutePanorama;
struct TopologicalMap;

/// Properties that all views of a memory share: how a picture becomes a comparable signature. Fixed
/// when the file is made.
struct MemoryHeader {
  SignatureShape shape;                     ///< rows and components of every view
  float full_scale = 1.0F;                  ///< magnitude that is packed as 255
  std::optional<ElevationBand> elevations;  ///< of the signatures' rows; empty: unknown
  int panorama_columns = 512;               ///< of the cylinders that the signatures are taken from
  /// Steps before the transform, the same for views and queries.
  PreprocessingOptions preprocessing;
  PictureSource source;  ///< layout of queries that have no data set
  /// Rows and columns of ready-made panoramas that are resampled to the memory's; empty: they have
  /// the memory's own, or the pictures are of another kind.
  std::optional<PanoramaShape> picture_shape;
  std::optional<double> created_s;  ///< seconds since 1970-01-01 UTC
  friend bool operator==(const MemoryHeader&, const MemoryHeader&) = default;
};

/// A view to be added to a memory file.
struct NewView {
  ReferenceInfo info;                   ///< name, pose and stamp; the name is new to the file
  PackedSignature signature;            ///< of the header's shape, packed with its full scale
  std::vector<std::uint8_t> thumbnail;  ///< a PNG or JPEG file for display; empty: none
  std::vector<std::uint8_t> features;   ///< packed `LocalFeatures`; empty: none
};

/// Access for which a memory file is opened.
enum class Access {
  read_only,  ///< others may write meanwhile
  read_write  ///< one process at a time
};

/// A visual memory on disk: an SQLite file (docs/formats.md), or with the address of a server
/// (memory_address.hpp) the same on PostgreSQL (docs/scale.md), where `path` is the address without
/// a password and a lost connection is a FileError. A change is durable when its member function
/// returns: it survives a killed process and a power failure. One process writes at a time; any
/// number read concurrently, each seeing a state between two changes. A damaged or foreign file or
/// one of another format version is refused and never changed. One object belongs to one thread at
/// a time. All member functions throw FileError; those that change something leave the file as it
/// was when they throw.
class MemoryFile {
 public:
  /// A fault that `verify` found.
  struct Fault {
    std::optional<ViewId> view;  ///< nullopt: the fault concerns the file as a whole
    std::string what;            ///< one line
    friend bool operator==(const Fault&, const Fault&) = default;
  };
  /// A change that was kept so that it can be undone.
  struct KeptChange {
    std::string what;               ///< description for people
    std::optional<double> stamp_s;  ///< seconds since 1970-01-01 UTC; nullopt on a server
    std::uint64_t bytes = 0;        ///< kept for undoing it
    bool undoable = false;          ///< false: too old, only its description is left
    friend bool operator==(const KeptChange&, const KeptChange&) = default;
  };
  /// Counts and sizes.
  struct Info {
    std::uint64_t views = 0;                ///< reference views
    std::uint64_t views_with_position = 0;  ///< of these, with x and y
    std::uint64_t views_with_heading = 0;   ///< of these, with a heading
    std::uint64_t links = 0;                ///< between two views
    std::uint64_t thumbnails = 0;           ///< views stored with a picture file
    std::uint64_t views_with_features = 0;  ///< views stored with local features
    std::uint64_t feature_bytes = 0;        ///< packed local features of all views
    std::uint64_t maps = 0;                 ///< kept by name
    std::uint64_t routes = 0;               ///< kept by name
    std::uint64_t file_bytes = 0;           ///< including the write-ahead log
    int format_version = 0;                 ///< of docs/formats.md
    friend bool operator==(const Info&, const Info&) = default;
  };

  /// Makes an empty memory file, whole or not at all. Throws FileError when something is at `path`
  /// already, ContractError on a header out of range.
  static MemoryFile create(const std::filesystem::path& path, const MemoryHeader& header);
  /// Throws FileError: missing, no memory file, of another format version, damaged; no write
  /// permission with read_write.
  static MemoryFile open(const std::filesystem::path& path, Access access);
  ~MemoryFile();
  /// A moved-from object may only be destroyed or assigned to.
  MemoryFile(MemoryFile&&) noexcept;
  MemoryFile& operator=(MemoryFile&&) noexcept;

  /// Opens the same memory again, for another thread.
  [[nodiscard]] MemoryFile reopen(Access access) const;
  /// Makes a memory at `path`, in a file or on a server, that holds the same under the same ids:
  /// whole or not at all. The history for `undo` is not copied. Throws FileError as `create`, and
  /// on damage.
  void copy_to(const std::filesystem::path& path) const;

  [[nodiscard]] const MemoryHeader& header()
      const noexcept;  ///< Returns the header, fixed when the file was made.
  /// Returns the path of `create` or `open`; of a server, the address without its password.
  [[nodiscard]] const std::filesystem::path& path() const noexcept;

  /// Makes all changes that `changes` makes through the member functions below in one transaction:
  /// all are on the disk when this returns, none when `changes` throws or the process ends before.
  /// With `undo`, a description for people, the replaced and dropped rows are kept in the file for
  /// `undo`. Of changes beyond the newest `max_undo_levels` or `max_history_bytes` only the
  /// description is kept, of those beyond `max_history` nothing; a server keeps one. Throws
  /// FileError when the change itself takes more than 200 MiB.
  void change(const std::function<void()>& changes,
              const std::optional<std::string>& undo = std::nullopt);
  static constexpr std::size_t max_undo_levels = 100;  ///< Number of changes that can be undone.
  /// Their size in the file; the newest is kept whatever its size.
  static constexpr std::uint64_t max_history_bytes = 64U << 20U;
  static constexpr std::size_t max_history =
      1000;  ///< Number of changes whose description is kept.
  /// Returns the changes that were kept for `undo` and not undone, the newest first.
  [[nodiscard]] std::vector<KeptChange> history() const;
  /// Returns the description of the change that `undo` would undo; nullopt: there is none.
  [[nodiscard]] std::optional<std::string> undoable() const;
  /// Undoes the newest kept change, in one transaction; the one before it becomes the newest. Views
  /// added since stay. Throws ContractError when there is none, FileError when later changes are in
  /// the way.
  void undo();

  /// Adds a view and returns once it is on the disk. Throws ContractError on another shape, a known
  /// name, and as `validate` of memory/reference_validation.hpp. Ids grow and are never used twice,
  /// even after a removal.
  ViewId append(const NewView& view);
  /// Adds views in one transaction: all or none. Much faster than one by one.
  std::vector<ViewId> append(std::span<const NewView> views);
  /// Removes views with their links, thumbnails, features and nodes in maps, in one transaction.
  /// Throws ContractError when there is no such view; then nothing is removed.
  void remove(std::span<const ViewId> views);
  /// Replaces the pose of a view; empty: it is unknown. Throws ContractError when there is no such
  /// view, and as `validate`.
  void set_pose(ViewId view, const std::optional<ReferencePose>& pose);
  /// Gives a view another name. Throws ContractError when there is no such view, and on a name that
  /// another view has, is empty, has control characters or more than 4096 bytes.
  void rename(ViewId view, std::string_view name);
  /// Adds links in one transaction. A second link of the same two views replaces the first.
  void link(std::span<const Link> links);
  /// Removes the link of two views, in either order, if there is one.
  void unlink(ViewId a, ViewId b);

  /// Returns the view of that name; nullopt when there is none. Cost: a look-up in an index.
  [[nodiscard]] std::optional<ViewId> find(std::string_view name) const;
  /// Returns the names of all views by ascending id; a resumed recording need not add them again.
  [[nodiscard]] std::vector<std::string> names() const;
  /// Returns the views that a picture file was stored with, ascending.
  [[nodiscard]] std::vector<ViewId> views_with_thumbnail() const;
  /// Returns the picture file that was stored with the view; nullopt if there is none.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> thumbnail(ViewId view) const;

  /// True if any view has local features. Cost: a look-up.
  [[nodiscard]] bool has_features() const;
  /// Returns the packed local features of the view; nullopt if there are none.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> features(ViewId view) const;

  /// Stores a text by name, such as a model or weights that were learnt from the views.
  void set_parameter(std::string_view name, std::string_view value);
  /// Returns the text that `set_parameter` stored under the name; nullopt if there is none.
  [[nodiscard]] std::optional<std::string> parameter(std::string_view name) const;

  /// Stores a map under a name, replacing the map of that name. Throws ContractError on an empty
  /// name, a view that is not in the file, and as `validate`.
  void save_map(std::string_view name, const TopologicalMap& map);
  /// Returns the same bits as were saved; nullopt when there is no such map.
  [[nodiscard]] std::optional<TopologicalMap> map(std::string_view name) const;
  /// Removes a map. Throws ContractError when there is no such map.
  void remove_map(std::string_view name);
  /// Returns the names, ascending.
  [[nodiscard]] std::vector<std::string> map_names() const;

  /// Adds lines to the route of that name, which is made if there is none; all of them or none. The
  /// first lines are left out while they are within a millimetre of the last line there. Returns
  /// the number of added lines. Throws ContractError on an empty name, no lines, and another number
  /// of columns than the route has. Cost: that of the lines and at most 256 more.
  std::size_t append_route(std::string_view name, const RoutePanorama& more);
  /// Returns the same bits as were appended; nullopt when there is no such route.
  [[nodiscard]] std::optional<RoutePanorama> route(std::string_view name) const;
  /// Returns the size of the route's lines and poses as stored, packed without loss. Throws
  /// ContractError when there is no such route.
  [[nodiscard]] std::uint64_t route_bytes(std::string_view name) const;
  /// Removes a route. Throws ContractError when there is no such route.
  void remove_route(std::string_view name);
  /// Gives a route another name. Throws ContractError when there is no such route, and on a new
  /// name as `rename`. Cost: every line is written again.
  void rename_route(std::string_view name, std::string_view new_name);
  /// Returns the names, ascending.
  [[nodiscard]] std::vector<std::string> route_names() const;

  /// Loads all views and links. Checks every row's checksum and values and throws FileError at the
  /// first fault; of a server, where others may write rows, bad ones are left out (`left_out`).
  /// 100,000 views of 80 x 15 take about 0.6 s of processor time.
  [[nodiscard]] VisualMemory load() const;
  /// Loads these views, which must ascend, without links; nothing else of the file is read. Each
  /// view's checksum is checked. Throws ContractError on a view that is not in the file. Cost: some
  /// 10 microseconds a view.
  [[nodiscard]] VisualMemory load(std::span<const ViewId> views) const;
  /// Returns all views, ascending.
  [[nodiscard]] std::vector<ViewId> views() const;
  /// Returns the views whose positions are within these bounds, each included, ascending. On a
  /// server an index of positions is used; a file is read through.
  [[nodiscard]] std::vector<ViewId> views_within(const PositionBounds& bounds) const;
  /// Returns all links, ascending.
  [[nodiscard]] std::vector<Link> links() const;
  /// Returns the rows of a server that the functions above left out since the memory was opened, as
  /// they hold what no program of ours writes, up to 1000; of a file none: it is refused.
  [[nodiscard]] std::vector<Fault> left_out() const;
  /// Returns all faults of the file: of its structure, then view by view. Empty: intact.
  [[nodiscard]] std::vector<Fault> verify() const;
  /// Counts rows and sizes without checks. Cost: a pass over the rows of the tables.
  [[nodiscard]] Info info() const;

 private:
  struct Implementation;
  explicit MemoryFile(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav

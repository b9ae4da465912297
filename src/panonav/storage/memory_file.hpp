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
class SnapshotChain;
struct TopologicalMap;

/// Properties that all views of a memory share: how a picture becomes a signature. They are fixed
/// when the memory is created.
struct MemoryHeader {
  SignatureShape shape;                     ///< rows and components of every view
  float full_scale = 1.0F;                  ///< magnitude that is packed as 255
  std::optional<ElevationBand> elevations;  ///< of the signatures' rows; empty: unknown
  int panorama_columns = 512;               ///< of the panoramas that become signatures
  /// Steps before the transform, the same for views and queries.
  PreprocessingOptions preprocessing;
  PictureSource source;  ///< layout of queries that have no data set
  /// Rows and columns of ready-made panoramas that are resampled to the memory's. nullopt: they
  /// have the memory's own, or the pictures are of another kind.
  std::optional<PanoramaShape> picture_shape;
  std::optional<double> created_s;  ///< seconds since 1970-01-01 UTC
  friend bool operator==(const MemoryHeader&, const MemoryHeader&) = default;
};

/// A view to be added to a memory file.
struct NewView {
  ReferenceInfo info;                   ///< name, pose and stamp; the name must be new
  PackedSignature signature;            ///< of the header's shape, packed with its full scale
  std::vector<std::uint8_t> thumbnail;  ///< a PNG or JPEG file for display; empty: none
  std::vector<std::uint8_t> features;   ///< packed `LocalFeatures`; empty: none
};

/// Access for which a memory file is opened.
enum class Access {
  read_only,  ///< others may write at the same time
  read_write  ///< one process at a time
};

/// Method by which a route is remembered.
enum class RouteMethod {
  panorama,  ///< lines of pixels (`RoutePanorama`)
  chain      ///< small snapshots with odometry between them (`SnapshotChain`)
};

/// A visual memory on disk: an SQLite file (docs/formats.md). Given the address of a server
/// (memory_address.hpp), it is in PostgreSQL instead (docs/scale.md); `path` then returns the
/// address without a password, and a lost connection is a FileError. A change is durable when its
/// member function returns: it survives a killed process and a power failure. One process writes at
/// a time. Any number of processes can read at the same time; each reads a state between two
/// changes. A file that is damaged, of another program or of another format version is refused and
/// never changed. Only one thread at a time may use an object. All member functions throw
/// FileError; a function that throws has not changed the file.
class MemoryFile {
 public:
  /// A fault that `verify` found.
  struct Fault {
    std::optional<ViewId> view;  ///< nullopt: the fault concerns the file as a whole
    std::string what;            ///< one line
    friend bool operator==(const Fault&, const Fault&) = default;
  };
  /// A change that was kept for `undo`.
  struct KeptChange {
    std::string what;               ///< description for people
    std::optional<double> stamp_s;  ///< seconds since 1970-01-01 UTC; nullopt on a server
    std::uint64_t bytes = 0;        ///< size of the rows kept for undoing it
    bool undoable = false;          ///< false: too old, only its description is kept
    friend bool operator==(const KeptChange&, const KeptChange&) = default;
  };
  /// Floor and pose of a view.
  struct ViewPlace {
    ViewId view;                        ///< its id
    std::string floor;                  ///< `floor_of` its name
    std::optional<ReferencePose> pose;  ///< nullopt: unknown
    friend bool operator==(const ViewPlace&, const ViewPlace&) = default;
  };
  /// Numbers of views.
  struct Counts {
    std::uint64_t views = 0;                ///< reference views
    std::uint64_t views_with_position = 0;  ///< of these, with x and y
    std::uint64_t views_with_heading = 0;   ///< of these, with a heading
    std::uint64_t file_bytes = 0;           ///< including the write-ahead log
    friend bool operator==(const Counts&, const Counts&) = default;
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

  /// Creates an empty memory, completely or not at all. Throws FileError if there is something at
  /// `path`, ContractError on a header out of range.
  static MemoryFile create(const std::filesystem::path& path, const MemoryHeader& header);
  /// Opens a memory. Throws FileError if it is missing, damaged, no memory file or of another
  /// format version, or with read_write if it may not be written.
  static MemoryFile open(const std::filesystem::path& path, Access access);
  ~MemoryFile();
  /// A moved-from object may only be destroyed or assigned to.
  MemoryFile(MemoryFile&&) noexcept;
  MemoryFile& operator=(MemoryFile&&) noexcept;

  /// Opens the same memory a second time, for another thread.
  [[nodiscard]] MemoryFile reopen(Access access) const;
  /// Creates a memory at `path`, in a file or on a server, with the same content and ids,
  /// completely or not at all. The history for `undo` is not copied. Throws FileError as `create`,
  /// and on damage.
  void copy_to(const std::filesystem::path& path) const;

  [[nodiscard]] const MemoryHeader& header()
      const noexcept;  ///< Returns the header, fixed when the file was made.
  /// Returns the path of `create` or `open`; for a server, the address without its password.
  [[nodiscard]] const std::filesystem::path& path() const noexcept;

  /// Runs `changes` and makes all changes by the member functions below in one transaction: all are
  /// on the disk when this returns, none if `changes` throws or the process ends before. If `undo`,
  /// a description for people, is set, the replaced and removed rows are kept in the file for
  /// `undo`. For changes beyond the newest `max_undo_levels` or `max_history_bytes` only the
  /// description is kept, and for those beyond `max_history` nothing. A server keeps only one
  /// change. Throws FileError if the change itself needs more than 200 MiB.
  void change(const std::function<void()>& changes,
              const std::optional<std::string>& undo = std::nullopt);
  static constexpr std::size_t max_undo_levels = 100;  ///< Number of changes that can be undone.
  /// Largest size of kept changes in the file, in bytes; the newest change is kept whatever its
  /// size.
  static constexpr std::uint64_t max_history_bytes = 64U << 20U;
  static constexpr std::size_t max_history =
      1000;  ///< Number of changes whose description is kept.
  /// Returns the changes kept for `undo` that were not undone, newest first.
  [[nodiscard]] std::vector<KeptChange> history() const;
  /// Returns the description of the change that `undo` would undo; nullopt if there is none.
  [[nodiscard]] std::optional<std::string> undoable() const;
  /// Undoes the newest kept change, in one transaction; the one before it becomes the newest. Views
  /// added since stay. Throws ContractError if there is none, FileError if later changes conflict
  /// with it.
  void undo();
  /// Throws as `undo` if it would refuse. Changes nothing, but needs the same access to the file.
  void require_undo_possible();

  /// Adds a view and returns once it is on the disk. Throws ContractError on another shape or a
  /// name in use, and as `validate` of memory/reference_validation.hpp. Ids ascend and are never
  /// used twice, even after a removal.
  ViewId append(const NewView& view);
  /// Adds views in one transaction, all or none; much faster than one by one.
  std::vector<ViewId> append(std::span<const NewView> views);
  /// Removes views with their links, thumbnails, features and nodes in maps, in one transaction.
  /// Throws ContractError if one of them does not exist; nothing is removed then.
  void remove(std::span<const ViewId> views);
  /// Replaces the pose of a view; nullopt: unknown. Throws ContractError if there is no such view,
  /// and as `validate`.
  void set_pose(ViewId view, const std::optional<ReferencePose>& pose);
  /// Renames a view. Throws ContractError if there is no such view, if another view has the name,
  /// or if the name is empty, has control characters or more than 4096 bytes.
  void rename(ViewId view, std::string_view name);
  /// Adds links in one transaction. A second link of the same two views replaces the first.
  void link(std::span<const Link> links);
  /// Removes the link of two views, in either order, if there is one.
  void unlink(ViewId a, ViewId b);

  /// Returns the view of that name; nullopt when there is none. Cost: a look-up in an index.
  [[nodiscard]] std::optional<ViewId> find(std::string_view name) const;
  /// Returns the names of all views by ascending id, by which a resumed recording can skip its
  /// known views.
  [[nodiscard]] std::vector<std::string> names() const;
  /// Returns the views that were stored with a picture file, ascending.
  [[nodiscard]] std::vector<ViewId> views_with_thumbnail() const;
  /// Returns the picture file that was stored with the view; nullopt if there is none.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> thumbnail(ViewId view) const;

  /// True if any view has local features. Cost: a look-up.
  [[nodiscard]] bool has_features() const;
  /// Returns the packed local features of the view; nullopt if there are none.
  [[nodiscard]] std::optional<std::vector<std::uint8_t>> features(ViewId view) const;

  /// Stores a text under a name, such as a model or weights that were learnt from the views.
  void set_parameter(std::string_view name, std::string_view value);
  /// Returns the text that `set_parameter` stored under the name; nullopt if there is none.
  [[nodiscard]] std::optional<std::string> parameter(std::string_view name) const;

  /// Stores a map under a name; replaces a map of that name. Throws ContractError on an empty name
  /// or a view that is not in the file, and as `validate`.
  void save_map(std::string_view name, const TopologicalMap& map);
  /// Returns exactly the map that was saved; nullopt if there is none of that name.
  [[nodiscard]] std::optional<TopologicalMap> map(std::string_view name) const;
  /// Removes a map. Throws ContractError when there is no such map.
  void remove_map(std::string_view name);
  /// Returns the names, ascending.
  [[nodiscard]] std::vector<std::string> map_names() const;

  /// Appends the lines of `more` to the route of that name, which is created if it is missing. If
  /// an error occurs, no line is appended. First lines within a millimetre of the last stored line
  /// are skipped. Returns the number of added lines. Throws ContractError on an empty name, no
  /// lines, or another number of columns than the stored route's. Cost: that of writing these lines
  /// and at most 256 stored ones.
  std::size_t append_route(std::string_view name, const RoutePanorama& more);
  /// Returns exactly the lines that were appended; nullopt if there is no route of that name.
  /// Throws FileError on a chain of snapshots.
  [[nodiscard]] std::optional<RoutePanorama> route(std::string_view name) const;
  /// Stores a chain of snapshots as a route, in its packed form. Throws ContractError on a name
  /// that is empty or that a route has.
  void save_chain(std::string_view name, const SnapshotChain& chain);
  /// Returns exactly the chain that was saved; nullopt if there is no route of that name. Throws
  /// FileError on a route panorama.
  [[nodiscard]] std::optional<SnapshotChain> chain(std::string_view name) const;
  /// Returns how the route is remembered; nullopt if there is no route of that name.
  [[nodiscard]] std::optional<RouteMethod> route_method(std::string_view name) const;
  /// Returns the size of the route as stored, in bytes: lines and poses, packed without loss, or
  /// the packed chain.
  /// Throws ContractError when there is no such route.
  [[nodiscard]] std::uint64_t route_bytes(std::string_view name) const;
  /// Removes a route. Throws ContractError when there is no such route.
  void remove_route(std::string_view name);
  /// Renames a route. Throws ContractError if there is no such route, and on a new name as
  /// `rename`. Cost: every line is written again.
  void rename_route(std::string_view name, std::string_view new_name);
  /// Returns the names, ascending.
  [[nodiscard]] std::vector<std::string> route_names() const;

  /// Loads all views and links. Checks every row's checksum and values and throws FileError at the
  /// first fault. On a server, where others may write rows, bad rows are left out instead
  /// (`left_out`). 100,000 views of 80 x 15 take about 0.6 s of processor time.
  [[nodiscard]] VisualMemory load() const;
  /// Loads these views, whose ids must ascend, without links; reads nothing else of the file. Each
  /// view's checksum is checked. Throws ContractError if a view is not in the file. Cost: about 10
  /// microseconds a view.
  [[nodiscard]] VisualMemory load(std::span<const ViewId> views) const;
  /// Calls `consume` with each view, ascending: its id, data and signature, which are valid during
  /// the call. Shows one state of the file and checks it as `load`, but holds one view at a time.
  /// `consume` must not use this object.
  void read_views(const std::function<void(ViewId, const ReferenceInfo&, const PackedSignature&)>&
                      consume) const;
  /// Returns all views, ascending.
  [[nodiscard]] std::vector<ViewId> views() const;
  /// Returns the views whose positions are within these bounds (inclusive), ascending. Servers use
  /// an index of positions; of a file all views are read.
  [[nodiscard]] std::vector<ViewId> views_within(const PositionBounds& bounds) const;
  /// Returns where all views were taken, ascending. A file reads its indexes, not the signatures:
  /// 100,000 views take about 40 ms.
  [[nodiscard]] std::vector<ViewPlace> places() const;
  /// Returns the numbers of views, at a cost as `places`; on a server as `info`.
  [[nodiscard]] Counts counts() const;
  /// Returns all links, ascending.
  [[nodiscard]] std::vector<Link> links() const;
  /// Returns the rows of a server that the functions above left out since the memory was opened,
  /// because our programs never write such content; at most 1000. None for a file, which is refused
  /// instead.
  [[nodiscard]] std::vector<Fault> left_out() const;
  /// Returns all faults of the memory: of its structure, then view by view; none if it is intact.
  [[nodiscard]] std::vector<Fault> verify() const;
  /// Returns numbers of rows and sizes, without checking rows. Cost: a pass over the rows of the
  /// tables.
  [[nodiscard]] Info info() const;

 private:
  struct Implementation;
  explicit MemoryFile(std::unique_ptr<Implementation> implementation);
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace panonav

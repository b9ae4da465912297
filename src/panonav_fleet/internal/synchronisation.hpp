#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "panonav/storage/internal/synchronised_tables.hpp"
#include "panonav_fleet/internal/server_exchange.hpp"
#include "panonav_fleet/memory_synchronisation.hpp"

namespace panonav::fleet {

/// Synchronises an open file once with an open memory on a server. The members hold what is stored
/// in the file or will be; `unsaved_` and `stored_links_` show what is stored. Its functions are in
/// three source files: shared ones, upload and download.
class Synchronisation {
 public:
  Synchronisation(SqliteTables& file, MemoryHeader header, ServerExchange& server,
                  const SynchronisationOptions& options,
                  const std::function<void(std::size_t)>& advance);
  SynchronisationReport run();

 private:
  using Bytes = std::vector<std::uint8_t>;
  using Kind = MemoryTables::Kind;
  static constexpr std::size_t views_per_batch = 256;  ///< chosen: some megabytes in a message
  static constexpr std::size_t rows_per_query = 2000;  ///< chosen: some 100 kB in a message
  struct LocalRow {
    ReferenceInfo info;
    std::int64_t checksum = 0;
    Bytes signature;
  };

  // synchronisation.cpp

  /// Throws FileError if the file belongs to another memory, ContractError if its views cannot be
  /// compared with the server's.
  void match_with_server();
  /// Loads from the local file what it has stored about the views and links on the server, and the
  /// checksums of the file's own views.
  void load_file_state();
  void set_row(ViewId view, const SynchronisedView& row);
  void drop_row(ViewId view);
  /// True if the file has stored all views, links and state that the members hold.
  [[nodiscard]] bool is_stored() const;
  /// Stores the record of the server and commits it with the other changes of the transaction.
  void store_and_commit(MemoryTables::Transaction& writing);
  /// Begins a writing transaction of the file. Throws FileError if another program has synchronised
  /// the file since it was read.
  std::unique_ptr<MemoryTables::Transaction> begin_file_change();
  /// Returns nullopt if the file no longer has the view.
  std::optional<LocalRow> read_local_row(ViewId view);
  void write_local_info(ViewId view, const ReferenceInfo& info, const Bytes& signature);
  /// Empties the parameter with the marks of memorised recordings.
  void clear_recordings();
  /// Returns "ROBOT/NAME", followed by " (COUNT)" if the count is 2 or more.
  [[nodiscard]] std::string robot_prefixed_name(const std::string& name, int count) const;
  /// Returns the last id that the server gave to a view. Throws FileError if the memory is no
  /// longer the one of `match_with_server`.
  std::uint32_t read_last_view_id();
  /// Returns the links of the file between views that the server has, by the server's ids.
  SynchronisedLinks read_local_links();
  [[nodiscard]] bool is_in_file(ViewId server_view) const;
  void forget_server_view(ViewId server_view);

  // synchronisation_upload.cpp

  /// Finds out whether the server accepted earlier uploads that were not acknowledged. The server
  /// answers only when no writer is active, because messages of a killed process may still arrive.
  void resolve_unacknowledged_uploads();
  /// Records that the server has the view. If `is_current_upload`, it accepted what was sent last;
  /// otherwise the file is older than what it once sent, and the server's row is treated as changed
  /// since.
  static void acknowledge(SynchronisedView& row, const Upload& upload, bool is_current_upload);
  /// Decides which views to upload, finds names for them that are free on the server, and stores
  /// both in the file before anything is sent.
  void prepare_upload();
  /// Returns the new and changed views of the file that this login may upload, with their names.
  /// Sets `removed_locally_`.
  std::map<ViewId, std::string> find_local_changes();
  /// Returns the server's views that have one of these names, by name.
  std::map<std::string, ServerView> find_server_views(const std::map<ViewId, std::string>& names);
  /// Records that the view is being sent, or that the server already has it as `same`.
  void mark_as_being_sent(ViewId view, const LocalRow& row, const ServerView* same);
  [[nodiscard]] bool is_synchronised_as(ViewId view, ViewId server_view) const;
  /// True if neither view has a counterpart on the other side yet and their signatures are the
  /// same.
  bool is_same_view(ViewId view, const ServerView& other);
  /// Makes the row of a view that both sides had before they knew of each other.
  SynchronisedView make_adopted_row(ViewId view, const LocalRow& row, ViewId server_view,
                                    const ReferenceInfo& info, std::int64_t checksum);
  /// Finds names "ROBOT/NAME" that neither side has.
  std::map<ViewId, std::string> find_free_names(
      std::vector<std::pair<ViewId, std::string>> without_name);
  /// Returns the views that this synchronisation sends: new ones, or changed ones.
  std::vector<ViewId> find_sent_views(bool are_new) const;
  void upload_views();
  NewView to_new_view(ViewId view, LocalRow row);
  void upload_batch(const std::vector<ViewId>& ids, const std::vector<NewView>& views);
  void upload_changes();
  void upload_removals();
  /// Removes views that still have these checksums. Returns the removed ones, ascending.
  std::vector<ViewId> remove_on_server(const std::map<ViewId, std::int64_t>& checksums);
  void upload_links();

  // synchronisation_download.cpp

  static std::vector<std::int64_t> find_differing_blocks(const Blocks& a, const Blocks& b);
  /// Applies changes of others, from one snapshot of the server.
  void download();
  /// False if the values of a view of the server are out of range; such a view is then left out.
  bool is_acceptable(const ServerView& view);
  /// Sorts views whose rows on the server have changed: into `changes`, or into `reused` if a
  /// restored server has given the id to another view.
  void classify_changed_views(const std::vector<ViewId>& changed, std::vector<ServerView>& changes,
                              std::vector<ViewId>& reused);
  /// Returns those of the removed views that the server has lost, as after a restored backup; other
  /// robots removed the rest.
  std::set<ViewId> find_lost_views(const std::vector<ViewId>& removed);
  void apply_server_changes(const std::vector<ViewId>& removed, const std::set<ViewId>& lost,
                            const std::vector<ServerView>& changes,
                            const std::vector<ViewId>& reused);
  /// Removes views that were removed on the server, and forgets ids that the server lost or gave to
  /// other views. Returns true if any view of the file was removed.
  bool remove_from_file(const std::vector<ViewId>& removed_ids, const std::set<ViewId>& lost,
                        const std::vector<ViewId>& reused);
  /// Sets the names, poses and stamps of views of the file to those of the server. Returns true if
  /// there were any.
  bool update_in_file(const std::vector<ServerView>& changes);
  /// If a view of the file other than `except` has this name, renames it to a free name that is not
  /// in `incoming_names` either; the next synchronisation uploads the new name.
  void free_local_name(const std::string& name, std::optional<ViewId> except,
                       const std::set<std::string>& incoming_names);
  void add_downloaded_views(std::vector<FullServerView> views);
  /// Applies the links of the compared blocks, and stores all remaining changes.
  void finish_download(const std::vector<std::int64_t>& blocks,
                       const ServerLinks& server_view_links, std::int64_t last_view);
  /// Counts changes of the file that the login may not make on the server.
  std::size_t count_withheld_changes();
  /// Returns a condition on the server's ids: true if the links of the view were compared, as they
  /// are for views within the areas.
  [[nodiscard]] std::function<bool(ViewId)> make_link_scope_filter();
  [[nodiscard]] Link to_local_link(const Link& link) const;
  /// Removes from the file the views outside of the areas that the server has. Their rows are
  /// dropped, too, so that this is not uploaded as a removal.
  void drop_views_outside_areas();
  /// True if the position is within the areas; compares as the SQL of the server does.
  [[nodiscard]] bool is_in_kept_areas(const std::pair<double, double>& position) const;

  SqliteTables& file_;
  MemoryHeader header_;
  ServerExchange& server_;
  const std::function<void(std::size_t)>& advance_;
  KeptAreas areas_;  ///< ascending

  SynchronisedState state_, stored_state_;
  std::int64_t upload_number_ = 0;  ///< random number of this synchronisation
  SynchronisedViews synchronised_;  ///< by the file's ids
  SynchronisedLinks links_;
  std::map<ViewId, ViewId> local_by_server_id_;     ///< of rows with a server id
  std::map<ViewId, std::int64_t> local_checksums_;  ///< of the file's views
  std::set<ViewId> unsaved_;                        ///< rows that are not stored in the file yet
  SynchronisedLinks stored_links_;                  ///< links stored in the file
  std::vector<ViewId> removed_locally_;             ///< since the last synchronisation
  bool is_server_older_ = false;    ///< the server is older than what it acknowledged
  bool needs_reupload_ = false;     ///< the server lost views that the file still has
  std::size_t transfer_total_ = 0;  ///< views to transfer, for `advance_`
  RecordBytes scratch_;
  SynchronisationReport report_;
};

}  // namespace panonav::fleet

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

/// One synchronisation of an open file with an open memory. What the members hold is what is in the
/// file or about to be written there; `changed_` and `stored_links_` tell which. Members are in
/// three sources: what both directions need, the upload, and the download.
class Synchronisation {
 public:
  Synchronisation(SqliteTables& file, MemoryHeader header, ServerExchange& server,
                  const SynchronisationOptions& options,
                  const std::function<void(std::size_t)>& advance);
  SynchronisationReport run();

 private:
  using Bytes = std::vector<std::uint8_t>;
  using Kind = MemoryTables::Kind;
  static constexpr std::size_t views_at_once = 256;  // some megabytes on their way
  static constexpr std::size_t rows_at_once = 2000;
  struct LocalRow {
    ReferenceInfo info;
    std::int64_t checksum = 0;
    Bytes signature;
  };

  // synchronisation.cpp

  /// Which memory the file belongs to.
  void join();
  void read_file();
  void put(ViewId view, const SynchronisedView& row);
  void drop(ViewId view);
  [[nodiscard]] bool is_written() const;
  /// What is known now goes into the file, with what else the transaction holds.
  void commit(MemoryTables::Transaction& writing);
  /// A writing transaction of the file that nobody else's synchronisation came before.
  std::unique_ptr<MemoryTables::Transaction> change_file();
  /// Empty where the view is not there any more.
  std::optional<LocalRow> read_row(ViewId view);
  void write_info(ViewId view, const ReferenceInfo& info, const Bytes& signature);
  void clear_recordings();
  [[nodiscard]] std::string own_name(const std::string& name, int count) const;
  /// The memory is still the same. Returns the last id that was given.
  std::uint32_t require_same_memory();
  /// The file's links whose ends the server has, by its ids.
  SynchronisedLinks local_links();
  [[nodiscard]] bool is_in_file(ViewId server_view) const;
  void forget(ViewId server_view);

  // synchronisation_upload.cpp

  /// What was sent before and not answered: whether the server took it. Under the lock, as what a
  /// killed process sent may be on its way still.
  void ask_for_answers();
  /// The server has the view. `of_this_sending`: what it took is what was sent then; otherwise the
  /// file is older than what it once sent, and the server's holds, as if it had changed since.
  static void take_answer(SynchronisedView& row, const Upload& upload, bool of_this_sending);
  /// What there is to upload, under names that are free on the server; noted in the file before it
  /// is sent.
  void prepare();
  /// Finds what has changed in the file and this login may upload: the views with their names. Sets
  /// `removed_`.
  std::map<ViewId, std::string> find_local_changes();
  /// Views of the server that have one of these names, by name.
  std::map<std::string, ServerView> views_with_names(const std::map<ViewId, std::string>& names);
  /// Notes in the file that the view is being sent, or that the server already has it as `same`.
  void note_as_sent(ViewId view, const LocalRow& row, const ServerView* same);
  [[nodiscard]] bool is_at(ViewId view, ViewId server_view) const;
  /// Whether the view of that name on the server is this one, which nothing is known of yet: their
  /// signatures are the same.
  bool adopts(ViewId view, const ServerView& other);
  SynchronisedView adopted(ViewId view, const LocalRow& row, ViewId server_view,
                           const ReferenceInfo& info, std::int64_t checksum);
  /// "ROBOT/NAME", which neither side has.
  std::map<ViewId, std::string> free_names(std::vector<std::pair<ViewId, std::string>> nameless);
  /// Views of this synchronisation: new ones, or changed ones.
  std::vector<ViewId> sent_views(bool are_new) const;
  void upload_views();
  NewView whole(ViewId view, LocalRow row);
  void upload_part(const std::vector<ViewId>& ids, const std::vector<NewView>& views);
  void upload_changes();
  void upload_removals();
  /// Ascending.
  std::vector<ViewId> remove_there(const std::map<ViewId, std::int64_t>& checksums);
  void upload_links();

  // synchronisation_download.cpp

  static std::vector<std::int64_t> differing(const Blocks& a, const Blocks& b);
  /// What others did, as one snapshot of the server shows it.
  void download();
  /// Of views whose rows on the server are others now: what is known of them there, and ids that a
  /// restored server has given to another view.
  void find_changes(const std::vector<ViewId>& changed, std::vector<ServerView>& changes,
                    std::vector<ViewId>& reused);
  /// Of views that are gone: those that the server has lost, instead of somebody having removed
  /// them.
  std::set<ViewId> lost_by_server(const std::vector<ViewId>& gone);
  void take_changes(const std::vector<ViewId>& gone, const std::set<ViewId>& lost,
                    const std::vector<ServerView>& changes, const std::vector<ViewId>& reused);
  /// Removes views that are gone on the server, and forgets ids that it gave again or lost. Returns
  /// whether the file lost any.
  bool remove_from_file(const std::vector<ViewId>& gone, const std::set<ViewId>& lost,
                        const std::vector<ViewId>& reused);
  /// Gives views of the file the names, poses and stamps of the server. Returns whether there were
  /// any.
  bool update_in_file(const std::vector<ServerView>& changes);
  /// A view of the file that has a name of the server's gets another one, which is none of those
  /// that are to come; the next synchronisation uploads it.
  void make_way(const std::string& name, std::optional<ViewId> but,
                const std::set<std::string>& to_come);
  void add_views(std::vector<WholeServerView> views);
  void finish(const std::vector<std::int64_t>& blocks, const std::vector<Link>& there,
              std::int64_t last_view);
  /// Changes of the file that the login may not make on the server.
  std::size_t withheld();
  /// Whether the links of a view were asked for: only of views that lie in the areas.
  [[nodiscard]] std::function<bool(ViewId)> server_links_asked();
  [[nodiscard]] Link local_link(const Link& link) const;
  /// Views that the server has and that lie outside of the areas: dropped from the file, and their
  /// rows with them, so that they do not count as removed.
  void leave_areas();
  /// By the same comparisons as the server's.
  [[nodiscard]] bool keeps(const std::pair<double, double>& position) const;

  SqliteTables& file_;
  MemoryHeader header_;
  ServerExchange& server_;
  const std::function<void(std::size_t)>& advance_;
  KeptAreas areas_;  // ascending

  SynchronisedState state_, stored_state_;
  std::int64_t sent_ = 0;  // number of this synchronisation
  SynchronisedViews views_;
  SynchronisedLinks links_;
  std::map<ViewId, ViewId> by_server_;  // of the rows that have one
  std::map<ViewId, std::int64_t> local_;
  std::set<ViewId> changed_;        // rows that are not in the file yet
  SynchronisedLinks stored_links_;  // those that are
  std::vector<ViewId> removed_;     // from the file
  bool restored_ = false;           // the server is older than what it acknowledged
  bool lost_ = false;               // views of the file are to be uploaded again
  std::size_t expected_ = 0;        // views that are on their way
  RecordBytes scratch_;
  SynchronisationReport report_;
};

}  // namespace panonav::fleet

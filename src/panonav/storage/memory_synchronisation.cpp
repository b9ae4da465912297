#include "panonav/storage/memory_synchronisation.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <set>
#include <string>
#include <utility>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_file_access.hpp"
#include "panonav/storage/internal/memory_rows.hpp"
#include "panonav/storage/internal/postgresql_tables.hpp"
#include "panonav/storage/internal/synchronised_tables.hpp"
#include "panonav/storage/memory_address.hpp"
#ifdef PANONAV_WITH_POSTGRESQL
#include "panonav/storage/internal/server_exchange.hpp"
#endif

namespace panonav {

std::vector<MemoryArea> areas_around(double x_m, double y_m, double radius_m) {
  require(std::isfinite(x_m), "x_m", x_m, "finite");
  require(std::isfinite(y_m), "y_m", y_m, "finite");
  require(std::isfinite(radius_m) && radius_m >= 0.0, "radius_m", radius_m, ">= 0, finite");
  const MemoryArea low = area_of(x_m - radius_m, y_m - radius_m);
  const MemoryArea high = area_of(x_m + radius_m, y_m + radius_m);
  constexpr double max_areas = 1e6;
  const double areas = (high.column - low.column + 1.0) * (high.row - low.row + 1.0);
  require(areas <= max_areas, "areas within radius_m", areas, "up to a million");
  std::vector<MemoryArea> around;
  for (double column = low.column; column <= high.column; ++column) {
    for (double row = low.row; row <= high.row; ++row) {
      const double left_m = column * memory_area_side_m;
      const double bottom_m = row * memory_area_side_m;
      const double dx_m = x_m - std::clamp(x_m, left_m, left_m + memory_area_side_m);
      const double dy_m = y_m - std::clamp(y_m, bottom_m, bottom_m + memory_area_side_m);
      if (std::hypot(dx_m, dy_m) <= radius_m) around.push_back({column, row});
    }
  }
  return around;
}

namespace {

void require_path_and_address(const std::filesystem::path& file,
                              const std::filesystem::path& server) {
  if (is_server_address(file)) {
    throw ContractError("file", without_passwords(file.string()), "the path of a memory file");
  }
  if (!is_server_address(server)) {
    throw ContractError("server", server.string(), "the address of a memory on a server");
  }
}

}  // namespace

#ifdef PANONAV_WITH_POSTGRESQL

namespace {

using Bytes = std::vector<std::uint8_t>;
using Kind = MemoryTables::Kind;

constexpr std::size_t views_at_once = 256;  // some megabytes on their way
constexpr std::size_t rows_at_once = 2000;

void require_comparable(const MemoryHeader& file, const MemoryHeader& server,
                        const std::filesystem::path& path) {
  const auto require_same = [&](const char* what, bool same) {
    if (same) return;
    throw ContractError(std::string(what) + " of the file", "another",
                        "that of " + path.string() +
                            ", as views made in another way cannot be compared; a file that is "
                            "made by synchronising has it");
  };
  require_same("rows and components", file.shape == server.shape);
  require_same("full scale", file.full_scale == server.full_scale);
  require_same("elevations of the rows", file.elevations == server.elevations);
  require_same("number of columns", file.panorama_columns == server.panorama_columns);
  require_same("preprocessing", file.preprocessing == server.preprocessing);
}

template <class Row, class Work>
void in_parts(const std::vector<Row>& rows, std::size_t at_once, const Work& work) {
  for (std::size_t at = 0; at < rows.size(); at += at_once) {
    work(std::span(rows).subspan(at, std::min(at_once, rows.size() - at)));
  }
}

/// One synchronisation of an open file with an open memory. What the members hold is what is in the
/// file or about to be written there; `changed_` and `stored_links_` tell which.
class Synchronisation {
 public:
  Synchronisation(SqliteTables& file, MemoryHeader header, ServerExchange& server,
                  const SynchronisationOptions& options,
                  const std::function<void(std::size_t)>& advance)
      : file_(file), header_(std::move(header)), server_(server), advance_(advance) {
    if (!options.areas) return;
    const std::set<MemoryArea> areas(options.areas->begin(), options.areas->end());
    for (const MemoryArea& area : areas) {
      constexpr double largest = 1e15;  // whole numbers below it are exact
      for (const double value : {area.column, area.row}) {
        require(std::abs(value) <= largest && value == std::floor(value),
                "column or row of an area", value, "whole numbers up to 1e15");
      }
    }
    areas_.emplace(areas.begin(), areas.end());
  }

  SynchronisationReport run() {
    join();
    constexpr int max_rounds = 2;  // the second uploads what a restored server had lost
    for (int round = 0; round < max_rounds; ++round) {
      lost_ = false;
      read_file();
      ask_for_answers();
      prepare();
      if (server_.may_add()) {
        upload_views();
        upload_changes();
        upload_removals();
        upload_links();
      }
      download();
      if (!lost_ || !server_.may_add()) break;
    }
    return report_;
  }

 private:
  struct LocalRow {
    ReferenceInfo info;
    std::int64_t checksum = 0;
    Bytes signature;
  };

  // Which memory the file belongs to.
  void join() {
    stored_state_ = state_ = read_synchronised_state(file_);
    const ServerExchange::State there = server_.state();
    if (state_.memory.empty()) {
      const auto reading = server_.tables().transaction(Kind::reading);
      require_comparable(header_, header_from(server_.tables().settings()),
                         server_.tables().path());
    } else if (state_.memory != there.identity) {
      throw FileError(file_.path().string(),
                      "is synchronised with another memory than " +
                          server_.tables().path().string() +
                          " is now; allowed: the same memory, or a copy of the file (panonav "
                          "copy), which is synchronised with none");
    }
    if (state_.file.empty()) state_.file = random_identity(file_);
    state_.memory = there.identity;
    sent_ = random_number(file_);
    restored_ = there.last_view < state_.last_view;
  }

  void read_file() {
    const auto reading = file_.transaction(Kind::reading);
    views_ = read_synchronised_views(file_);
    stored_links_ = links_ = read_synchronised_links(file_);
    local_ = read_view_checksums(file_);
    by_server_.clear();
    for (const auto& [view, row] : views_) {
      if (row.server_view) by_server_[*row.server_view] = view;
    }
    changed_.clear();
  }

  void put(ViewId view, const SynchronisedView& row) {
    views_[view] = row;
    if (row.server_view) by_server_[*row.server_view] = view;
    changed_.insert(view);
  }

  void drop(ViewId view) {
    const auto found = views_.find(view);
    if (found == views_.end()) return;
    if (found->second.server_view) by_server_.erase(*found->second.server_view);
    views_.erase(found);
    changed_.insert(view);
  }

  [[nodiscard]] bool is_written() const {
    return changed_.empty() && links_ == stored_links_ && state_ == stored_state_;
  }

  /// What is known now goes into the file, with what else the transaction holds.
  void commit(MemoryTables::Transaction& writing) {
    state_.number = random_number(file_);
    write_synchronised_state(file_, state_);
    for (const ViewId view : std::exchange(changed_, {})) {
      const auto found = views_.find(view);
      if (found == views_.end()) {
        erase_synchronised_view(file_, view);
      } else {
        write_synchronised_view(file_, view, found->second);
      }
    }
    for (const auto& [ends, kind] : links_) {
      const auto stored = stored_links_.find(ends);
      if (stored != stored_links_.end() && stored->second == kind) continue;
      write_synchronised_link(file_, {ends.first, ends.second, kind});
    }
    for (const auto& [ends, kind] : stored_links_) {
      if (!links_.contains(ends)) erase_synchronised_link(file_, ends.first, ends.second);
    }
    writing.commit();
    stored_links_ = links_;
    stored_state_ = state_;
  }

  /// A writing transaction of the file that nobody else's synchronisation came before.
  std::unique_ptr<MemoryTables::Transaction> change_file() {
    auto writing = file_.transaction(Kind::writing);
    if (read_synchronised_state(file_).number != stored_state_.number) {
      throw FileError(file_.path().string(), "is being synchronised by another program, too");
    }
    local_ = read_view_checksums(file_);
    return writing;
  }

  /// Empty where the view is not there any more.
  std::optional<LocalRow> read_row(ViewId view) {
    if (!local_.contains(view)) return std::nullopt;
    LocalRow read;
    file_.read_views(std::span(&view, 1), [&](const ViewRow& found) {
      const ViewRow& row = file_.checked(found, header_.shape, scratch_);
      read = {row.info, row.checksum, Bytes(row.signature.begin(), row.signature.end())};
    });
    return read;
  }

  void write_info(ViewId view, const ReferenceInfo& info, const Bytes& signature) {
    const std::int64_t checksum = view_checksum(scratch_, view, info, signature);
    file_.write_info(view, info, checksum);
    local_[view] = checksum;
  }

  void clear_recordings() {
    const std::string key = "parameter." + std::string(recordings_parameter);
    const Settings settings = file_.settings();
    if (settings.contains(key)) file_.write_setting(key, std::string());
  }

  /// What was sent before and not answered: whether the server took it. Under the lock, as what a
  /// killed process sent may be on its way still.
  void ask_for_answers() {
    std::vector<ViewId> asked;
    for (const auto& [view, row] : views_) {
      if (row.sent) asked.push_back(view);
    }
    if (asked.empty()) return;
    std::map<std::pair<ViewId, std::int64_t>, Upload> answers;
    for (const Upload& upload : server_.settled_uploads(state_.file, asked)) {
      answers[{upload.view, upload.signature}] = upload;
    }
    for (const ViewId view : asked) {
      SynchronisedView row = views_.at(view);
      const auto answer = answers.find({view, row.signature});
      const bool is_new = !row.server_view;
      const bool taken = answer != answers.end() && (is_new || answer->second.sent == row.sent);
      const auto sent = std::exchange(row.sent, std::nullopt);
      if (taken) take_answer(row, answer->second, answer->second.sent == sent);
      if (is_new && !taken) {
        drop(view);
      } else {
        put(view, row);
      }
    }
  }

  /// The server has the view. `of_this_sending`: what it took is what was sent then; otherwise the
  /// file is older than what it once sent, and the server's holds, as if it had changed since.
  static void take_answer(SynchronisedView& row, const Upload& upload, bool of_this_sending) {
    row.server_view = upload.server_view;
    if (of_this_sending) row.local_checksum = upload.local_checksum;
    row.server_checksum = of_this_sending ? upload.server_checksum : ~upload.server_checksum;
    row.uploaded = true;
    row.sent.reset();
  }

  /// What there is to upload, under names that are free on the server; noted in the file before it
  /// is sent.
  void prepare() {
    std::vector<ViewId> wanted;
    removed_.clear();
    for (const auto& [view, checksum] : local_) {
      const auto row = views_.find(view);
      const bool is_new = row == views_.end();
      if (!is_new && row->second.local_checksum == checksum) continue;
      if (is_new ? server_.may_add() : server_.may_change()) wanted.push_back(view);
    }
    for (const auto& [view, row] : views_) {
      if (!local_.contains(view) && server_.may_change()) removed_.push_back(view);
    }
    std::map<ViewId, std::string> names;
    {
      const auto reading = file_.transaction(Kind::reading);
      local_ = read_view_checksums(file_);
      for (const ViewId view : wanted) {
        if (const auto row = read_row(view)) names[view] = row->info.name;
      }
    }
    std::map<std::string, ServerView> taken;
    std::map<ViewId, std::string> new_names;
    {
      const auto reading = server_.tables().transaction(Kind::reading);
      std::vector<std::string> asked;
      for (const auto& [view, name] : names) asked.push_back(name);
      in_parts(asked, rows_at_once, [&](std::span<const std::string> part) {
        for (ServerView& view : server_.named(part)) taken[view.info.name] = std::move(view);
      });
      std::vector<std::pair<ViewId, std::string>> nameless;
      for (const auto& [view, name] : names) {
        const auto other = taken.find(name);
        if (other == taken.end() || is_at(view, other->second.id) || adopts(view, other->second)) {
          continue;
        }
        nameless.emplace_back(view, name);
      }
      new_names = free_names(nameless);
    }

    if (names.empty() && is_written()) return;
    const auto writing = change_file();
    for (const auto& [view, name] : names) {
      auto row = read_row(view);
      if (!row || row->info.name != name) continue;  // for the next time
      if (const auto other = new_names.find(view); other != new_names.end()) {
        if (file_.find(other->second)) continue;
        row->info.name = other->second;
        write_info(view, row->info, row->signature);
        ++report_.renamed;
      }
      const auto known = views_.find(view);
      SynchronisedView next;
      if (known != views_.end()) {
        next = known->second;
        next.sent = sent_;
      } else if (const auto same = taken.find(name);
                 same != taken.end() && adopts(view, same->second)) {
        next = adopted(view, *row, same->second.id, same->second.info, same->second.checksum);
      } else {
        next.local_checksum = local_.at(view);
        next.signature = signature_checksum(row->signature);
        next.sent = sent_;
      }
      put(view, next);
    }
    if (report_.renamed > 0) clear_recordings();
    commit(*writing);
  }

  [[nodiscard]] bool is_at(ViewId view, ViewId server_view) const {
    const auto row = views_.find(view);
    return row != views_.end() && row->second.server_view == server_view;
  }

  /// Whether the view of that name on the server is this one, which nothing is known of yet: their
  /// signatures are the same.
  bool adopts(ViewId view, const ServerView& other) {
    if (views_.contains(view) || by_server_.contains(other.id)) return false;
    const auto row = read_row(view);
    return row && view_checksum(scratch_, other.id, other.info, row->signature) == other.checksum;
  }

  SynchronisedView adopted(ViewId view, const LocalRow& row, ViewId server_view,
                           const ReferenceInfo& info, std::int64_t checksum) {
    SynchronisedView next;
    next.server_view = server_view;
    next.local_checksum = local_.at(view);
    // What the server knows of it holds: as if it had changed since.
    next.server_checksum = info == row.info ? checksum : ~checksum;
    next.signature = signature_checksum(row.signature);
    ++report_.adopted;
    return next;
  }

  /// "ROBOT/NAME", which neither side has.
  std::map<ViewId, std::string> free_names(std::vector<std::pair<ViewId, std::string>> nameless) {
    std::map<ViewId, std::string> found;
    std::set<std::string> given;
    for (int count = 1; !nameless.empty(); ++count) {
      std::vector<std::string> wanted;
      for (const auto& [view, name] : nameless) wanted.push_back(own_name(name, count));
      std::set<std::string> taken;
      in_parts(wanted, rows_at_once, [&](std::span<const std::string> part) {
        for (const ServerView& view : server_.named(part)) taken.insert(view.info.name);
      });
      std::vector<std::pair<ViewId, std::string>> left;
      for (std::size_t i = 0; i < wanted.size(); ++i) {
        if (taken.contains(wanted[i]) || file_.find(wanted[i]) || !given.insert(wanted[i]).second) {
          left.push_back(nameless[i]);
        } else {
          found[nameless[i].first] = wanted[i];
        }
      }
      nameless = std::move(left);
    }
    return found;
  }

  [[nodiscard]] std::string own_name(const std::string& name, int count) const {
    return server_.robot() + "/" + name +
           (count == 1 ? std::string() : " (" + std::to_string(count) + ")");
  }

  /// Views of this synchronisation: new ones, or changed ones.
  std::vector<ViewId> sent_views(bool are_new) const {
    std::vector<ViewId> sent;
    for (const auto& [view, row] : views_) {
      if (row.sent == sent_ && row.server_view.has_value() != are_new) sent.push_back(view);
    }
    return sent;
  }

  /// The memory is still the same. Returns the last id that was given.
  std::uint32_t require_same_memory() {
    const ServerExchange::State there = server_.state();
    if (there.identity != state_.memory) {
      throw FileError(server_.tables().path().string(), "was replaced by another memory meanwhile");
    }
    if (there.last_view < 0 || there.last_view >= std::int64_t{UINT32_MAX}) {
      server_.tables().fail_damaged("the last view id is out of range");
    }
    return static_cast<std::uint32_t>(there.last_view);
  }

  void upload_views() {
    const std::vector<ViewId> sent = sent_views(true);
    expected_ = sent.size();
    in_parts(sent, views_at_once, [&](std::span<const ViewId> part) {
      std::vector<ViewId> ids;
      std::vector<NewView> views;
      {
        const auto reading = file_.transaction(Kind::reading);
        local_ = read_view_checksums(file_);
        for (const ViewId view : part) {
          auto row = read_row(view);
          if (!row || row->checksum != views_.at(view).local_checksum) continue;
          ids.push_back(view);
          views.push_back(whole(view, std::move(*row)));
        }
      }
      if (!ids.empty()) upload_part(ids, views);
    });
  }

  NewView whole(ViewId view, LocalRow row) {
    NewView whole{std::move(row.info), {header_.shape, {}, {}}, {}, {}};
    const auto half = static_cast<std::ptrdiff_t>(header_.shape.size());
    whole.signature.magnitudes.assign(row.signature.begin(), row.signature.begin() + half);
    whole.signature.phases.assign(row.signature.begin() + half, row.signature.end());
    const auto read = [&](BesideViews table, Bytes& bytes) {
      auto stored = file_.bytes(table, view);
      if (!stored) return;
      if (stored->checksum != bytes_checksum(view, stored->bytes)) {
        file_.fail_damaged(
            std::string(table == BesideViews::thumbnails ? "thumbnails" : "features") +
            " of view " + std::to_string(view.value) + ": the checksum does not match");
      }
      bytes = std::move(stored->bytes);
    };
    read(BesideViews::thumbnails, whole.thumbnail);
    read(BesideViews::features, whole.features);
    return whole;
  }

  void upload_part(const std::vector<ViewId>& ids, const std::vector<NewView>& views) {
    server_.stage(views);
    std::uint32_t last = server_.reserve_ids(ids.size());
    std::vector<ServerExchange::Staged> staged;
    Bytes signature;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      const SynchronisedView& row = views_.at(ids[i]);
      const NewView& view = views[i];
      const ViewId id{++last};
      pack_signature(view.signature, signature);
      staged.push_back({i,
                        {ids[i], row.signature, id, row.local_checksum,
                         view_checksum(scratch_, id, view.info, signature), sent_},
                        bytes_checksum(id, view.thumbnail),
                        bytes_checksum(id, view.features)});
    }
    // Views whose names were taken just now are not among them: the next time finds other names.
    for (const Upload& upload : server_.take_views(state_.file, sent_, staged)) {
      SynchronisedView row = views_.at(upload.view);
      if (upload.signature != row.signature) continue;
      take_answer(row, upload, upload.sent == sent_);
      put(upload.view, row);
      report_.uploaded += upload.sent == sent_ ? 1 : 0;
      if (advance_) advance_(expected_);
    }
    state_.last_view = std::max(state_.last_view, std::int64_t{last});
  }

  void upload_changes() {
    in_parts(sent_views(false), rows_at_once, [&](std::span<const ViewId> part) {
      std::vector<ViewId> ids, server_ids;
      std::vector<LocalRow> rows;
      {
        const auto reading = file_.transaction(Kind::reading);
        local_ = read_view_checksums(file_);
        for (const ViewId view : part) {
          auto row = read_row(view);
          if (!row) continue;
          ids.push_back(view);
          server_ids.push_back(*views_.at(view).server_view);
          rows.push_back(std::move(*row));
        }
      }
      std::vector<ServerExchange::ChangedView> changes;
      for (std::size_t i = 0; i < ids.size(); ++i) {
        SynchronisedView row = views_.at(ids[i]);
        changes.push_back(
            {{ids[i], row.signature, server_ids[i], rows[i].checksum,
              view_checksum(scratch_, server_ids[i], rows[i].info, rows[i].signature), sent_},
             rows[i].info,
             row.server_checksum});
      }
      if (changes.empty()) return;
      const auto taken = server_.take_changes(state_.file, sent_, changes);
      // Where somebody was first, `download` sees what.
      for (const ViewId view : ids) {
        SynchronisedView row = views_.at(view);
        row.sent.reset();
        put(view, row);
      }
      for (const Upload& upload : taken) {
        SynchronisedView row = views_.at(upload.view);
        if (upload.signature != row.signature) continue;
        take_answer(row, upload, true);
        put(upload.view, row);
      }
      report_.updated_on_server += taken.size();
    });
  }

  void upload_removals() {
    in_parts(removed_, rows_at_once, [&](std::span<const ViewId> part) {
      std::vector<ViewId> server_ids;
      std::map<ViewId, SynchronisedView> rows;
      local_ = read_view_checksums(file_);
      for (const ViewId view : part) {
        const auto row = views_.find(view);
        if (row == views_.end() || !row->second.server_view || local_.contains(view)) continue;
        server_ids.push_back(*row->second.server_view);
        rows[*row->second.server_view] = row->second;
      }
      const auto there = server_.checksums(server_ids);
      // A restored server may have given the id to another view.
      std::map<ViewId, std::int64_t> same;
      std::vector<ViewId> changed;
      for (const auto& [id, checksum] : there) {
        if (checksum == rows.at(id).server_checksum) {
          same[id] = checksum;
        } else {
          changed.push_back(id);
        }
      }
      for (const auto& [id, signature] : server_.signatures(changed)) {
        if (signature == rows.at(id).signature) same[id] = there.at(id);
      }
      const std::vector<ViewId> removed = remove_there(same);
      report_.removed_on_server += removed.size();
      for (const ViewId id : server_ids) {
        // One that was changed just now is for the next time.
        if (same.contains(id) && !std::ranges::binary_search(removed, id)) continue;
        forget(id);
      }
    });
  }

  /// Ascending.
  std::vector<ViewId> remove_there(const std::map<ViewId, std::int64_t>& checksums) {
    std::vector<ViewId> removed;
    if (checksums.empty()) return removed;
    if (server_.tables().map_names().empty()) {
      removed = server_.take_removals(checksums);
    } else {
      // Maps are changed by this program: others wait for its link.
      const auto writing = server_.tables().transaction(Kind::writing);
      std::vector<ViewId> wanted;
      for (const auto& [id, checksum] : checksums) wanted.push_back(id);
      for (const auto& [id, checksum] : server_.checksums(wanted)) {
        if (checksum == checksums.at(id)) removed.push_back(id);
      }
      server_.tables().remove(removed);
      forget_in_maps(server_.tables(), removed);
      const std::string key = "parameter." + std::string(recordings_parameter);
      server_.tables().write_setting(key, std::string());
      writing->commit();
    }
    std::ranges::sort(removed);
    return removed;
  }

  /// The file's links whose ends the server has, by its ids.
  SynchronisedLinks local_links() {
    SynchronisedLinks links;
    file_.read_links([&](const LinkRow& row) {
      const Link link = file_.checked(row);
      const auto a = views_.find(link.a);
      const auto b = views_.find(link.b);
      if (a == views_.end() || b == views_.end()) return;
      if (!a->second.server_view || !b->second.server_view) return;
      links[std::minmax(*a->second.server_view, *b->second.server_view)] = link.kind;
    });
    return links;
  }

  [[nodiscard]] bool is_in_file(ViewId server_view) const {
    const auto found = by_server_.find(server_view);
    return found != by_server_.end() && local_.contains(found->second);
  }

  void upload_links() {
    SynchronisedLinks own;
    {
      const auto reading = file_.transaction(Kind::reading);
      local_ = read_view_checksums(file_);
      own = local_links();
    }
    std::vector<Link> added;
    std::vector<ServerExchange::ChangedLink> others;
    for (const auto& [ends, kind] : own) {
      const auto before = links_.find(ends);
      if (before == links_.end()) {
        added.push_back({ends.first, ends.second, kind});
      } else if (before->second != kind) {
        others.push_back({{ends.first, ends.second, before->second}, kind});
      }
    }
    for (const auto& [ends, kind] : links_) {
      if (own.contains(ends) || !is_in_file(ends.first) || !is_in_file(ends.second)) continue;
      if (server_.may_change()) others.push_back({{ends.first, ends.second, kind}, std::nullopt});
    }
    if (added.empty() && others.empty()) return;
    report_.links_uploaded += server_.take_links(added, others);
    for (const Link& link : added) links_[{link.a, link.b}] = link.kind;
    for (const auto& link : others) {
      if (link.wanted) {
        links_[{link.former.a, link.former.b}] = *link.wanted;
      } else {
        links_.erase({link.former.a, link.former.b});
      }
    }
  }

  static std::vector<std::int64_t> differing(const Blocks& a, const Blocks& b) {
    std::vector<std::int64_t> blocks;
    for (const auto& [number, block] : a) {
      const auto other = b.find(number);
      if (other == b.end() || !(other->second == block)) blocks.push_back(number);
    }
    for (const auto& [number, block] : b) {
      if (!a.contains(number)) blocks.push_back(number);
    }
    return blocks;
  }

  /// What others did, as one snapshot of the server shows it.
  void download() {
    const auto snapshot = server_.tables().transaction(Kind::reading);
    const std::int64_t last_view = require_same_memory();
    restored_ = restored_ || last_view < state_.last_view;

    Blocks own;
    for (const auto& [view, row] : views_) {
      if (row.server_view) add_to_block(own, *row.server_view, row.server_checksum);
    }
    const auto blocks = differing(own, server_.view_blocks(areas_));
    const std::set<std::int64_t> is_differing(blocks.begin(), blocks.end());
    auto there = server_.checksums_in(areas_, blocks);
    std::vector<ViewId> elsewhere;
    for (const auto& [id, view] : by_server_) {
      if (is_differing.contains(id.value >> block_bits) && !there.contains(id)) {
        elsewhere.push_back(id);
      }
    }
    if (areas_) there.merge(server_.checksums(elsewhere));

    std::vector<ViewId> gone, changed, fresh;  // by the server's ids
    for (const ViewId id : elsewhere) {
      if (!there.contains(id)) gone.push_back(id);
    }
    for (const auto& [id, checksum] : there) {
      const auto known = by_server_.find(id);
      if (known == by_server_.end()) {
        fresh.push_back(id);
      } else if (views_.at(known->second).server_checksum != checksum) {
        changed.push_back(id);
      }
    }
    std::vector<ServerView> changes;
    std::vector<ViewId> reused;
    find_changes(changed, changes, reused);
    // Damage is found before anything is taken for another view.
    static_cast<void>(server_.whole(reused));
    fresh.insert(fresh.end(), reused.begin(), reused.end());
    std::ranges::sort(fresh);
    take_changes(gone, lost_by_server(gone), changes, reused);

    expected_ = fresh.size();
    in_parts(fresh, views_at_once,
             [&](std::span<const ViewId> part) { add_views(server_.whole(part)); });

    Blocks own_links;
    for (const auto& [ends, kind] : links_) {
      add_to_block(own_links, ends.first, link_checksum({ends.first, ends.second, kind}));
    }
    const auto link_blocks = differing(own_links, server_.link_blocks(areas_));
    finish(link_blocks, server_.links_in(areas_, link_blocks), last_view);
  }

  /// Of views whose rows on the server are others now: what is known of them there, and ids that a
  /// restored server has given to another view.
  void find_changes(const std::vector<ViewId>& changed, std::vector<ServerView>& changes,
                    std::vector<ViewId>& reused) {
    const auto reading = file_.transaction(Kind::reading);
    local_ = read_view_checksums(file_);
    in_parts(changed, rows_at_once, [&](std::span<const ViewId> part) {
      for (ServerView& view : server_.infos(part)) {
        const auto row = read_row(by_server_.at(view.id));
        if (!row) continue;  // removed from the file
        if (view_checksum(scratch_, view.id, view.info, row->signature) == view.checksum) {
          changes.push_back(std::move(view));
        } else {
          reused.push_back(view.id);
        }
      }
    });
  }

  /// Of views that are gone: those that the server has lost, instead of somebody having removed
  /// them.
  std::set<ViewId> lost_by_server(const std::vector<ViewId>& gone) {
    if (restored_) return {gone.begin(), gone.end()};
    std::set<ViewId> lost;
    std::vector<ViewId> asked;
    for (const ViewId id : gone) {
      const ViewId view = by_server_.at(id);
      if (!views_.at(view).uploaded) continue;
      asked.push_back(view);
      lost.insert(id);
    }
    in_parts(asked, rows_at_once, [&](std::span<const ViewId> part) {
      for (const Upload& upload : server_.uploads(state_.file, part)) {
        const SynchronisedView& row = views_.at(upload.view);
        if (upload.signature == row.signature && upload.server_view == row.server_view) {
          lost.erase(upload.server_view);
        }
      }
    });
    return lost;
  }

  void take_changes(const std::vector<ViewId>& gone, const std::set<ViewId>& lost,
                    const std::vector<ServerView>& changes, const std::vector<ViewId>& reused) {
    if (gone.empty() && changes.empty() && reused.empty()) return;
    const auto writing = change_file();
    std::vector<ViewId> removed;
    for (const ViewId id : gone) {
      const ViewId view = by_server_.at(id);
      if (local_.contains(view)) {
        if (lost.contains(id)) {
          lost_ = true;
        } else {
          removed.push_back(view);
          if (local_.at(view) != views_.at(view).local_checksum) ++report_.conflicts;
        }
      }
      forget(id);
    }
    for (const ViewId id : reused) {
      lost_ = true;
      forget(id);
    }
    report_.restored = report_.restored || restored_ || lost_;
    file_.remove(removed);
    forget_in_maps(file_, removed);
    for (const ViewId view : removed) local_.erase(view);
    report_.removed_in_file += removed.size();

    struct Change {
      ViewId view;
      const ServerView* there;
      LocalRow row;
    };
    std::vector<Change> taken;
    std::set<ViewId> moving;
    for (const ServerView& there : changes) {
      const ViewId view = by_server_.at(there.id);
      auto row = read_row(view);
      if (!row) continue;
      if (row->info != there.info) {
        if (row->checksum != views_.at(view).local_checksum) ++report_.conflicts;
        ++report_.updated_in_file;
      }
      taken.push_back({view, &there, std::move(*row)});
      moving.insert(view);
    }
    // Names that views give each other are free in between.
    for (const Change& change : taken) {
      if (change.row.info.name == change.there->info.name) continue;
      ReferenceInfo between = change.row.info;
      between.name = "\x01" + std::to_string(change.view.value);
      file_.write_info(change.view, between, 0);
    }
    std::set<std::string> names;
    for (const Change& change : taken) names.insert(change.there->info.name);
    for (const Change& change : taken) {
      make_way(change.there->info.name, change.view, names);
      write_info(change.view, change.there->info, change.row.signature);
      SynchronisedView next = views_.at(change.view);
      next.local_checksum = local_.at(change.view);
      next.server_checksum = change.there->checksum;
      next.sent.reset();
      put(change.view, next);
    }
    if (!removed.empty() || !taken.empty()) clear_recordings();
    commit(*writing);
  }

  void forget(ViewId server_view) {
    drop(by_server_.at(server_view));
    std::erase_if(links_, [&](const auto& link) {
      return link.first.first == server_view || link.first.second == server_view;
    });
  }

  /// A view of the file that has a name of the server's gets another one, which is none of those
  /// that are to come; the next synchronisation uploads it.
  void make_way(const std::string& name, std::optional<ViewId> but,
                const std::set<std::string>& to_come) {
    const auto other = file_.find(name);
    if (!other || other == but) return;
    auto row = read_row(*other).value();
    for (int count = 1;; ++count) {
      row.info.name = own_name(name, count);
      if (!file_.find(row.info.name) && !to_come.contains(row.info.name)) break;
    }
    write_info(*other, row.info, row.signature);
    clear_recordings();
    ++report_.renamed;
  }

  void add_views(std::vector<WholeServerView> views) {
    const auto writing = change_file();
    std::vector<ViewId> ids;
    std::vector<NewView> added;
    std::uint32_t last = file_.last_id();
    std::set<std::string> names;
    for (const WholeServerView& whole : views) names.insert(whole.view.info.name);
    for (WholeServerView& whole : views) {
      NewView& view = whole.view;
      if (view.signature.magnitudes.size() != header_.shape.size()) {
        server_.tables().fail_damaged("view " + std::to_string(whole.id.value) +
                                      " has a signature of another shape");
      }
      view.signature.shape = header_.shape;
      Bytes signature;
      pack_signature(view.signature, signature);
      SynchronisedView next;
      next.server_view = whole.id;
      next.server_checksum = whole.checksum;
      next.signature = signature_checksum(signature);
      if (advance_) advance_(expected_);
      const auto same = file_.find(view.info.name);
      if (same && (!views_.contains(*same) || !views_.at(*same).server_view) &&
          read_row(*same).value().signature == signature) {
        write_info(*same, view.info, signature);
        next.local_checksum = local_.at(*same);
        put(*same, next);
        ++report_.adopted;
        continue;
      }
      make_way(view.info.name, std::nullopt, names);
      if (last >= UINT32_MAX - 1) file_.fail_damaged("there is no id left for another view");
      const ViewId id{++last};
      next.local_checksum = view_checksum(scratch_, id, view.info, signature);
      put(id, next);
      ids.push_back(id);
      added.push_back(std::move(view));
    }
    file_.insert(ids, added);
    commit(*writing);
    report_.downloaded += added.size();
  }

  void finish(const std::vector<std::int64_t>& blocks, const std::vector<Link>& there,
              std::int64_t last_view) {
    const auto writing = change_file();
    const SynchronisedLinks own = local_links();
    SynchronisedLinks server_links;
    std::vector<Link> wanted;
    for (const Link& link : there) {
      const std::pair ends(link.a, link.b);
      server_links[ends] = link.kind;
      if (!is_in_file(link.a) || !is_in_file(link.b)) continue;
      const auto before = links_.find(ends);
      if (before != links_.end() && before->second == link.kind) continue;
      links_[ends] = link.kind;
      const auto known = own.find(ends);
      if (known != own.end() && known->second == link.kind) continue;
      wanted.push_back(local_link(link));
    }
    file_.write_links(wanted);
    report_.links_downloaded += wanted.size();
    bool changes_anything = !wanted.empty();
    const std::set<std::int64_t> is_differing(blocks.begin(), blocks.end());
    const auto was_asked = server_links_asked();
    std::erase_if(links_, [&](const auto& entry) {
      const auto& ends = entry.first;
      if (!is_differing.contains(ends.first.value >> block_bits) || server_links.contains(ends) ||
          !was_asked(ends.first) || !was_asked(ends.second)) {
        return false;
      }
      if (own.contains(ends)) {
        const Link link = local_link({ends.first, ends.second, entry.second});
        file_.erase_link(link.a, link.b);
        ++report_.links_downloaded;
        changes_anything = true;
      }
      return true;
    });
    leave_areas();
    state_.last_view = lost_ || restored_ ? last_view : std::max(state_.last_view, last_view);
    restored_ = false;
    if (changes_anything || !is_written()) commit(*writing);
    report_.views = local_.size();
    report_.withheld = withheld();
  }

  /// Changes of the file that the login may not make on the server.
  std::size_t withheld() {
    std::size_t count = 0;
    if (!server_.may_add()) {
      for (const auto& [view, checksum] : local_) count += views_.contains(view) ? 0 : 1;
    }
    if (server_.may_change()) return count;
    for (const auto& [view, row] : views_) {
      const auto found = local_.find(view);
      count += found == local_.end() || found->second != row.local_checksum ? 1 : 0;
    }
    const SynchronisedLinks own = local_links();
    for (const auto& [ends, kind] : links_) {
      const bool is_there = is_in_file(ends.first) && is_in_file(ends.second);
      count += is_there && !own.contains(ends) ? 1 : 0;
    }
    return count;
  }

  /// Whether the links of a view were asked for: only of views that lie in the areas.
  [[nodiscard]] std::function<bool(ViewId)> server_links_asked() {
    if (!areas_) return [](ViewId) { return true; };
    return [this, positions = read_positions(file_)](ViewId server_view) {
      const ViewId view = by_server_.at(server_view);
      const auto position = positions.find(view);
      return position != positions.end() && keeps(position->second) &&
             local_.at(view) == views_.at(view).local_checksum;
    };
  }

  [[nodiscard]] Link local_link(const Link& link) const {
    const auto [a, b] = std::minmax(by_server_.at(link.a), by_server_.at(link.b));
    return {a, b, link.kind};
  }

  /// Views that the server has and that lie outside of the areas: dropped from the file, and their
  /// rows with them, so that they do not count as removed.
  void leave_areas() {
    if (!areas_) return;
    std::vector<ViewId> left;
    for (const auto& [view, position] : read_positions(file_)) {
      const auto row = views_.find(view);
      if (row == views_.end() || !row->second.server_view || row->second.sent ||
          row->second.local_checksum != local_.at(view) || keeps(position)) {
        continue;
      }
      left.push_back(view);
    }
    file_.remove(left);
    forget_in_maps(file_, left);
    for (const ViewId view : left) {
      forget(*views_.at(view).server_view);
      local_.erase(view);
    }
    if (!left.empty()) clear_recordings();
    report_.left += left.size();
  }

  /// By the same comparisons as the server's.
  [[nodiscard]] bool keeps(const std::pair<double, double>& position) const {
    const auto cell = [](double value) {
      double number = std::floor(value / memory_area_side_m);
      while (value < memory_area_side_m * number) --number;
      while (value >= memory_area_side_m * number + memory_area_side_m) ++number;
      return number;
    };
    return std::ranges::binary_search(*areas_,
                                      MemoryArea{cell(position.first), cell(position.second)});
  }

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

/// The memory on the server, made like the file where there is none.
std::unique_ptr<ServerExchange> connect_or_make(const ServerAddress& address,
                                                const MemoryHeader& header) {
  if (auto found = ServerExchange::connect(address)) return found;
  try {
    make_postgresql_memory(address, header, {});
  } catch (const FileError&) {
    if (auto found = ServerExchange::connect(address)) return found;  // somebody was first
    throw;
  }
  auto made = ServerExchange::connect(address);
  if (!made) refuse_no_memory(address);
  return made;
}

}  // namespace

SynchronisationReport synchronise_memory(const std::filesystem::path& file,
                                         const std::filesystem::path& server,
                                         const SynchronisationOptions& options,
                                         const std::function<void(std::size_t)>& advance) {
  const auto begin = std::chrono::steady_clock::now();
  require_path_and_address(file, server);
  const ServerAddress address = parse_server_address(server);
  std::unique_ptr<ServerExchange> exchange;
  std::error_code ignored;
  if (!std::filesystem::exists(std::filesystem::symlink_status(file, ignored))) {
    exchange = ServerExchange::connect(address);
    if (!exchange) refuse_no_memory(address);
    make_memory_tables(file, header_from(exchange->tables().settings()), {});
  }
  OpenedMemory opened = open_memory_tables(file, Access::read_write);
  if (!exchange) exchange = connect_or_make(address, opened.header);
  Synchronisation synchronisation(static_cast<SqliteTables&>(*opened.tables),
                                  std::move(opened.header), *exchange, options, advance);
  SynchronisationReport report = synchronisation.run();
  report.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return report;
}

#else

SynchronisationReport synchronise_memory(const std::filesystem::path& file,
                                         const std::filesystem::path& server,
                                         const SynchronisationOptions&,
                                         const std::function<void(std::size_t)>&) {
  require_path_and_address(file, server);
  (void)postgresql_memory_exists(parse_server_address(server));  // says that there is no libpq
  return {};
}

#endif

}  // namespace panonav


#include "panonav_fleet/internal/synchronisation.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_rows.hpp"

namespace panonav::fleet {

std::vector<std::int64_t> Synchronisation::differing(const Blocks& a, const Blocks& b) {
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

void Synchronisation::download() {
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

void Synchronisation::find_changes(const std::vector<ViewId>& changed,
                                   std::vector<ServerView>& changes, std::vector<ViewId>& reused) {
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

std::set<ViewId> Synchronisation::lost_by_server(const std::vector<ViewId>& gone) {
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

void Synchronisation::take_changes(const std::vector<ViewId>& gone, const std::set<ViewId>& lost,
                                   const std::vector<ServerView>& changes,
                                   const std::vector<ViewId>& reused) {
  if (gone.empty() && changes.empty() && reused.empty()) return;
  const auto writing = change_file();
  const bool removed = remove_from_file(gone, lost, reused);
  const bool updated = update_in_file(changes);
  if (removed || updated) clear_recordings();
  commit(*writing);
}

bool Synchronisation::remove_from_file(const std::vector<ViewId>& gone,
                                       const std::set<ViewId>& lost,
                                       const std::vector<ViewId>& reused) {
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
  return !removed.empty();
}

bool Synchronisation::update_in_file(const std::vector<ServerView>& changes) {
  struct Change {
    ViewId view;
    const ServerView* there;
    LocalRow row;
  };
  std::vector<Change> taken;
  for (const ServerView& there : changes) {
    const ViewId view = by_server_.at(there.id);
    auto row = read_row(view);
    if (!row) continue;
    if (row->info != there.info) {
      if (row->checksum != views_.at(view).local_checksum) ++report_.conflicts;
      ++report_.updated_in_file;
    }
    taken.push_back({view, &there, std::move(*row)});
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
  return !taken.empty();
}

void Synchronisation::make_way(const std::string& name, std::optional<ViewId> but,
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

void Synchronisation::add_views(std::vector<WholeServerView> views) {
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

void Synchronisation::finish(const std::vector<std::int64_t>& blocks,
                             const std::vector<Link>& there, std::int64_t last_view) {
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

std::size_t Synchronisation::withheld() {
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

std::function<bool(ViewId)> Synchronisation::server_links_asked() {
  if (!areas_) return [](ViewId) { return true; };
  return [this, positions = read_positions(file_)](ViewId server_view) {
    const ViewId view = by_server_.at(server_view);
    const auto position = positions.find(view);
    return position != positions.end() && keeps(position->second) &&
           local_.at(view) == views_.at(view).local_checksum;
  };
}

Link Synchronisation::local_link(const Link& link) const {
  const auto [a, b] = std::minmax(by_server_.at(link.a), by_server_.at(link.b));
  return {a, b, link.kind};
}

void Synchronisation::leave_areas() {
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

bool Synchronisation::keeps(const std::pair<double, double>& position) const {
  const auto cell = [](double value) {
    double number = std::floor(value / memory_area_side_m);
    while (value < memory_area_side_m * number) --number;
    while (value >= memory_area_side_m * number + memory_area_side_m) ++number;
    return number;
  };
  return std::ranges::binary_search(*areas_,
                                    MemoryArea{cell(position.first), cell(position.second)});
}

}  // namespace panonav::fleet

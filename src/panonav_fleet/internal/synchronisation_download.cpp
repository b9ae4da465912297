#include "panonav_fleet/internal/synchronisation.hpp"

#include <algorithm>
#include <cmath>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_rows.hpp"

namespace panonav::fleet {

std::vector<std::int64_t> Synchronisation::find_differing_blocks(const Blocks& a, const Blocks& b) {
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
  const std::int64_t last_view = read_last_view_id();
  is_server_older_ = is_server_older_ || last_view < state_.last_view;

  Blocks local_blocks;
  for (const auto& [view, row] : synchronised_) {
    if (row.server_view) add_to_block(local_blocks, *row.server_view, row.server_checksum);
  }
  const auto blocks = find_differing_blocks(local_blocks, server_.compute_view_blocks(areas_));
  const std::set<std::int64_t> differing_blocks(blocks.begin(), blocks.end());
  auto server_checksums = server_.read_checksums_in_blocks(areas_, blocks);
  std::vector<ViewId> missing;
  for (const auto& [id, view] : local_by_server_id_) {
    if (differing_blocks.contains(id.value >> block_bits) && !server_checksums.contains(id)) {
      missing.push_back(id);
    }
  }
  if (areas_) server_checksums.merge(server_.read_checksums(missing));

  std::vector<ViewId> removed, changed, added;  // by the server's ids
  for (const ViewId id : missing) {
    if (!server_checksums.contains(id)) removed.push_back(id);
  }
  for (const auto& [id, checksum] : server_checksums) {
    const auto known = local_by_server_id_.find(id);
    if (known == local_by_server_id_.end()) {
      added.push_back(id);
    } else if (synchronised_.at(known->second).server_checksum != checksum) {
      changed.push_back(id);
    }
  }
  std::vector<ServerView> changes;
  std::vector<ViewId> reused;
  classify_changed_views(changed, changes, reused);
  // Damaged rows must be left out before a row is matched with another view.
  static_cast<void>(server_.read_full_views(reused, header_.shape));
  std::erase_if(reused, [this](ViewId id) { return server_.tables().is_left_out(id); });
  added.insert(added.end(), reused.begin(), reused.end());
  std::ranges::sort(added);
  apply_server_changes(removed, find_lost_views(removed), changes, reused);

  transfer_total_ = added.size();
  for_each_batch(added, views_per_batch, [&](std::span<const ViewId> part) {
    add_downloaded_views(server_.read_full_views(part, header_.shape));
  });

  Blocks local_link_blocks;
  for (const auto& [ends, kind] : links_) {
    add_to_block(local_link_blocks, ends.first, link_checksum({ends.first, ends.second, kind}));
  }
  const auto link_blocks =
      find_differing_blocks(local_link_blocks, server_.compute_link_blocks(areas_));
  finish_download(link_blocks, server_.read_links_in_blocks(areas_, link_blocks), last_view);
}

void Synchronisation::classify_changed_views(const std::vector<ViewId>& changed,
                                             std::vector<ServerView>& changes,
                                             std::vector<ViewId>& reused) {
  const auto reading = file_.transaction(Kind::reading);
  local_checksums_ = read_view_checksums(file_);
  for_each_batch(changed, rows_per_query, [&](std::span<const ViewId> part) {
    for (ServerView& view : server_.read_infos(part)) {
      const auto row = read_local_row(local_by_server_id_.at(view.id));
      if (!row || !is_acceptable(view)) continue;  // removed from the file, or a bad row
      if (view_checksum(scratch_, view.id, view.info, row->signature) == view.checksum) {
        changes.push_back(std::move(view));
      } else {
        reused.push_back(view.id);
      }
    }
  });
}

bool Synchronisation::is_acceptable(const ServerView& view) {
  return server_.tables().accept_row(view.id,
                                     [&] { server_.tables().check_info(view.id, view.info); });
}

std::set<ViewId> Synchronisation::find_lost_views(const std::vector<ViewId>& removed) {
  if (is_server_older_) return {removed.begin(), removed.end()};
  std::set<ViewId> lost;
  std::vector<ViewId> uploaded;
  for (const ViewId id : removed) {
    const ViewId view = local_by_server_id_.at(id);
    if (!synchronised_.at(view).uploaded) continue;
    uploaded.push_back(view);
    lost.insert(id);
  }
  for_each_batch(uploaded, rows_per_query, [&](std::span<const ViewId> part) {
    for (const Upload& upload : server_.read_uploads(state_.file, part)) {
      const SynchronisedView& row = synchronised_.at(upload.view);
      if (upload.signature == row.signature && upload.server_view == row.server_view) {
        lost.erase(upload.server_view);
      }
    }
  });
  return lost;
}

void Synchronisation::apply_server_changes(const std::vector<ViewId>& removed,
                                           const std::set<ViewId>& lost,
                                           const std::vector<ServerView>& changes,
                                           const std::vector<ViewId>& reused) {
  if (removed.empty() && changes.empty() && reused.empty()) return;
  const auto writing = begin_file_change();
  const bool has_removed = remove_from_file(removed, lost, reused);
  const bool has_updated = update_in_file(changes);
  if (has_removed || has_updated) clear_recordings();
  store_and_commit(*writing);
}

bool Synchronisation::remove_from_file(const std::vector<ViewId>& removed_ids,
                                       const std::set<ViewId>& lost,
                                       const std::vector<ViewId>& reused) {
  std::vector<ViewId> removed;
  for (const ViewId id : removed_ids) {
    const ViewId view = local_by_server_id_.at(id);
    if (local_checksums_.contains(view)) {
      if (lost.contains(id)) {
        needs_reupload_ = true;
      } else {
        removed.push_back(view);
        if (local_checksums_.at(view) != synchronised_.at(view).local_checksum) ++report_.conflicts;
      }
    }
    forget_server_view(id);
  }
  for (const ViewId id : reused) {
    needs_reupload_ = true;
    forget_server_view(id);
  }
  report_.restored = report_.restored || is_server_older_ || needs_reupload_;
  file_.remove(removed);
  erase_views_from_maps(file_, removed);
  for (const ViewId view : removed) local_checksums_.erase(view);
  report_.removed_in_file += removed.size();
  return !removed.empty();
}

bool Synchronisation::update_in_file(const std::vector<ServerView>& changes) {
  struct Change {
    ViewId view;
    const ServerView* target;
    LocalRow row;
  };
  std::vector<Change> accepted;
  for (const ServerView& there : changes) {
    const ViewId view = local_by_server_id_.at(there.id);
    auto row = read_local_row(view);
    if (!row) continue;
    if (row->info != there.info) {
      if (row->checksum != synchronised_.at(view).local_checksum) ++report_.conflicts;
      ++report_.updated_in_file;
    }
    accepted.push_back({view, &there, std::move(*row)});
  }
  // Temporary names, because views may exchange their names.
  for (const Change& change : accepted) {
    if (change.row.info.name == change.target->info.name) continue;
    ReferenceInfo between = change.row.info;
    between.name = "\x01" + std::to_string(change.view.value);
    file_.write_info(change.view, between, 0);
  }
  std::set<std::string> names;
  for (const Change& change : accepted) names.insert(change.target->info.name);
  for (const Change& change : accepted) {
    free_local_name(change.target->info.name, change.view, names);
    write_local_info(change.view, change.target->info, change.row.signature);
    SynchronisedView next = synchronised_.at(change.view);
    next.local_checksum = local_checksums_.at(change.view);
    next.server_checksum = change.target->checksum;
    next.sent.reset();
    set_row(change.view, next);
  }
  return !accepted.empty();
}

void Synchronisation::free_local_name(const std::string& name, std::optional<ViewId> except,
                                      const std::set<std::string>& incoming_names) {
  const auto owner = file_.find(name);
  if (!owner || owner == except) return;
  auto row = read_local_row(*owner).value();
  for (int count = 1;; ++count) {
    row.info.name = robot_prefixed_name(name, count);
    if (!file_.find(row.info.name) && !incoming_names.contains(row.info.name)) break;
  }
  write_local_info(*owner, row.info, row.signature);
  clear_recordings();
  ++report_.renamed;
}

void Synchronisation::add_downloaded_views(std::vector<FullServerView> views) {
  const auto writing = begin_file_change();
  std::vector<ViewId> ids;
  std::vector<NewView> added;
  std::uint32_t last = file_.last_id();
  std::set<std::string> names;
  for (const FullServerView& whole : views) names.insert(whole.view.info.name);
  for (FullServerView& whole : views) {
    NewView& view = whole.view;
    Bytes signature;
    pack_signature(view.signature, signature);
    SynchronisedView next;
    next.server_view = whole.id;
    next.server_checksum = whole.checksum;
    next.signature = signature_checksum(signature);
    if (advance_) advance_(transfer_total_);
    const auto same = file_.find(view.info.name);
    if (same && (!synchronised_.contains(*same) || !synchronised_.at(*same).server_view) &&
        read_local_row(*same).value().signature == signature) {
      write_local_info(*same, view.info, signature);
      next.local_checksum = local_checksums_.at(*same);
      set_row(*same, next);
      ++report_.adopted;
      continue;
    }
    free_local_name(view.info.name, std::nullopt, names);
    if (last >= UINT32_MAX - 1) file_.fail_damaged("there is no id left for another view");
    const ViewId id{++last};
    next.local_checksum = view_checksum(scratch_, id, view.info, signature);
    set_row(id, next);
    ids.push_back(id);
    added.push_back(std::move(view));
  }
  file_.insert(ids, added);
  store_and_commit(*writing);
  report_.downloaded += added.size();
}

void Synchronisation::finish_download(const std::vector<std::int64_t>& blocks,
                                      const ServerLinks& server_view_links,
                                      std::int64_t last_view) {
  const auto writing = begin_file_change();
  const SynchronisedLinks local = read_local_links();
  SynchronisedLinks server_links;
  std::vector<Link> changed_links;
  for (const Link& link : server_view_links.accepted) {
    const std::pair ends(link.a, link.b);
    server_links[ends] = link.kind;
    if (!is_in_file(link.a) || !is_in_file(link.b)) continue;
    const auto before = links_.find(ends);
    if (before != links_.end() && before->second == link.kind) continue;
    links_[ends] = link.kind;
    const auto known = local.find(ends);
    if (known != local.end() && known->second == link.kind) continue;
    changed_links.push_back(to_local_link(link));
  }
  file_.write_links(changed_links);
  report_.links_downloaded += changed_links.size();
  bool changes_anything = !changed_links.empty();
  const std::set<std::int64_t> differing_blocks(blocks.begin(), blocks.end());
  const auto is_in_scope = make_link_scope_filter();
  std::erase_if(links_, [&](const auto& entry) {
    const auto& ends = entry.first;
    if (!differing_blocks.contains(ends.first.value >> block_bits) || server_links.contains(ends) ||
        server_view_links.left_out.contains(ends) || !is_in_scope(ends.first) ||
        !is_in_scope(ends.second)) {
      return false;
    }
    if (local.contains(ends)) {
      const Link link = to_local_link({ends.first, ends.second, entry.second});
      file_.erase_link(link.a, link.b);
      ++report_.links_downloaded;
      changes_anything = true;
    }
    return true;
  });
  drop_views_outside_areas();
  state_.last_view =
      needs_reupload_ || is_server_older_ ? last_view : std::max(state_.last_view, last_view);
  is_server_older_ = false;
  if (changes_anything || !is_stored()) store_and_commit(*writing);
  report_.views = local_checksums_.size();
  report_.withheld = count_withheld_changes();
}

std::size_t Synchronisation::count_withheld_changes() {
  std::size_t count = 0;
  if (!server_.can_add()) {
    for (const auto& [view, checksum] : local_checksums_)
      count += synchronised_.contains(view) ? 0 : 1;
  }
  if (server_.can_change()) return count;
  for (const auto& [view, row] : synchronised_) {
    const auto found = local_checksums_.find(view);
    count += found == local_checksums_.end() || found->second != row.local_checksum ? 1 : 0;
  }
  const SynchronisedLinks own = read_local_links();
  for (const auto& [ends, kind] : links_) {
    const bool is_there = is_in_file(ends.first) && is_in_file(ends.second);
    count += is_there && !own.contains(ends) ? 1 : 0;
  }
  return count;
}

std::function<bool(ViewId)> Synchronisation::make_link_scope_filter() {
  if (!areas_) return [](ViewId) { return true; };
  return [this, positions = read_positions(file_)](ViewId server_view) {
    const ViewId view = local_by_server_id_.at(server_view);
    const auto position = positions.find(view);
    return position != positions.end() && is_in_kept_areas(position->second) &&
           local_checksums_.at(view) == synchronised_.at(view).local_checksum;
  };
}

Link Synchronisation::to_local_link(const Link& link) const {
  const auto [a, b] = std::minmax(local_by_server_id_.at(link.a), local_by_server_id_.at(link.b));
  return {a, b, link.kind};
}

void Synchronisation::drop_views_outside_areas() {
  if (!areas_) return;
  std::vector<ViewId> outside;
  for (const auto& [view, position] : read_positions(file_)) {
    const auto row = synchronised_.find(view);
    if (row == synchronised_.end() || !row->second.server_view || row->second.sent ||
        row->second.local_checksum != local_checksums_.at(view) || is_in_kept_areas(position)) {
      continue;
    }
    outside.push_back(view);
  }
  file_.remove(outside);
  erase_views_from_maps(file_, outside);
  for (const ViewId view : outside) {
    forget_server_view(*synchronised_.at(view).server_view);
    local_checksums_.erase(view);
  }
  if (!outside.empty()) clear_recordings();
  report_.left += outside.size();
}

bool Synchronisation::is_in_kept_areas(const std::pair<double, double>& position) const {
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

#include "panonav_fleet/internal/synchronisation.hpp"

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_rows.hpp"

namespace panonav::fleet {

void Synchronisation::resolve_unacknowledged_uploads() {
  std::vector<ViewId> unacknowledged;
  for (const auto& [view, row] : synchronised_) {
    if (row.sent) unacknowledged.push_back(view);
  }
  if (unacknowledged.empty()) return;
  std::map<std::pair<ViewId, std::int64_t>, Upload> answers;
  for (const Upload& upload : server_.read_settled_uploads(state_.file, unacknowledged)) {
    answers[{upload.view, upload.signature}] = upload;
  }
  for (const ViewId view : unacknowledged) {
    SynchronisedView row = synchronised_.at(view);
    const auto answer = answers.find({view, row.signature});
    const bool is_new = !row.server_view;
    const bool is_acknowledged =
        answer != answers.end() && (is_new || answer->second.sent == row.sent);
    const auto sent = std::exchange(row.sent, std::nullopt);
    if (is_acknowledged) acknowledge(row, answer->second, answer->second.sent == sent);
    if (is_new && !is_acknowledged) {
      drop_row(view);
    } else {
      set_row(view, row);
    }
  }
}

void Synchronisation::acknowledge(SynchronisedView& row, const Upload& upload,
                                  bool is_current_upload) {
  row.server_view = upload.server_view;
  if (is_current_upload) row.local_checksum = upload.local_checksum;
  row.server_checksum = is_current_upload ? upload.server_checksum : ~upload.server_checksum;
  row.uploaded = true;
  row.sent.reset();
}

std::map<ViewId, std::string> Synchronisation::find_local_changes() {
  std::vector<ViewId> changed;
  removed_locally_.clear();
  for (const auto& [view, checksum] : local_checksums_) {
    const auto row = synchronised_.find(view);
    const bool is_new = row == synchronised_.end();
    if (!is_new && row->second.local_checksum == checksum) continue;
    if (is_new ? server_.can_add() : server_.can_change()) changed.push_back(view);
  }
  for (const auto& [view, row] : synchronised_) {
    if (!local_checksums_.contains(view) && server_.can_change()) removed_locally_.push_back(view);
  }
  std::map<ViewId, std::string> names;
  const auto reading = file_.transaction(Kind::reading);
  local_checksums_ = read_view_checksums(file_);
  for (const ViewId view : changed) {
    if (const auto row = read_local_row(view)) names[view] = row->info.name;
  }
  return names;
}

std::map<std::string, ServerView> Synchronisation::find_server_views(
    const std::map<ViewId, std::string>& names) {
  std::vector<std::string> all_names;
  for (const auto& [view, name] : names) all_names.push_back(name);
  std::map<std::string, ServerView> views;
  for_each_batch(all_names, rows_per_query, [&](std::span<const std::string> part) {
    for (ServerView& view : server_.find_views_by_name(part))
      views[view.info.name] = std::move(view);
  });
  return views;
}

void Synchronisation::mark_as_being_sent(ViewId view, const LocalRow& row, const ServerView* same) {
  const auto known = synchronised_.find(view);
  SynchronisedView next;
  if (known != synchronised_.end()) {
    next = known->second;
    next.sent = upload_number_;
  } else if (same != nullptr && is_same_view(view, *same)) {
    next = make_adopted_row(view, row, same->id, same->info, same->checksum);
  } else {
    next.local_checksum = local_checksums_.at(view);
    next.signature = signature_checksum(row.signature);
    next.sent = upload_number_;
  }
  set_row(view, next);
}

void Synchronisation::prepare_upload() {
  const std::map<ViewId, std::string> names = find_local_changes();
  std::map<std::string, ServerView> server_views;
  std::map<ViewId, std::string> new_names;
  {
    const auto reading = server_.tables().transaction(Kind::reading);
    server_views = find_server_views(names);
    std::vector<std::pair<ViewId, std::string>> without_free_name;
    for (const auto& [view, name] : names) {
      const auto found = server_views.find(name);
      if (found == server_views.end() || is_synchronised_as(view, found->second.id) ||
          is_same_view(view, found->second)) {
        continue;
      }
      without_free_name.emplace_back(view, name);
    }
    new_names = find_free_names(without_free_name);
  }

  if (names.empty() && is_stored()) return;
  const auto writing = begin_file_change();
  for (const auto& [view, name] : names) {
    auto row = read_local_row(view);
    if (!row || row->info.name != name) continue;  // left for the next time
    if (const auto found = new_names.find(view); found != new_names.end()) {
      if (file_.find(found->second)) continue;
      row->info.name = found->second;
      write_local_info(view, row->info, row->signature);
      ++report_.renamed;
    }
    const auto same = server_views.find(name);
    mark_as_being_sent(view, *row, same == server_views.end() ? nullptr : &same->second);
  }
  if (report_.renamed > 0) clear_recordings();
  store_and_commit(*writing);
}

bool Synchronisation::is_synchronised_as(ViewId view, ViewId server_view) const {
  const auto row = synchronised_.find(view);
  return row != synchronised_.end() && row->second.server_view == server_view;
}

bool Synchronisation::is_same_view(ViewId view, const ServerView& other) {
  if (synchronised_.contains(view) || local_by_server_id_.contains(other.id)) return false;
  const auto row = read_local_row(view);
  return row && is_acceptable(other) &&
         view_checksum(scratch_, other.id, other.info, row->signature) == other.checksum;
}

SynchronisedView Synchronisation::make_adopted_row(ViewId view, const LocalRow& row,
                                                   ViewId server_view, const ReferenceInfo& info,
                                                   std::int64_t checksum) {
  SynchronisedView next;
  next.server_view = server_view;
  next.local_checksum = local_checksums_.at(view);
  // If they differ, the server's name, pose and stamp are used, as if they had been changed later.
  next.server_checksum = info == row.info ? checksum : ~checksum;
  next.signature = signature_checksum(row.signature);
  ++report_.adopted;
  return next;
}

std::map<ViewId, std::string> Synchronisation::find_free_names(
    std::vector<std::pair<ViewId, std::string>> without_name) {
  std::map<ViewId, std::string> free_names;
  std::set<std::string> chosen;
  for (int count = 1; !without_name.empty(); ++count) {
    std::vector<std::string> candidates;
    for (const auto& [view, name] : without_name)
      candidates.push_back(robot_prefixed_name(name, count));
    std::set<std::string> occupied;
    for_each_batch(candidates, rows_per_query, [&](std::span<const std::string> part) {
      for (const ServerView& view : server_.find_views_by_name(part))
        occupied.insert(view.info.name);
    });
    std::vector<std::pair<ViewId, std::string>> remaining;
    for (std::size_t i = 0; i < candidates.size(); ++i) {
      if (occupied.contains(candidates[i]) || file_.find(candidates[i]) ||
          !chosen.insert(candidates[i]).second) {
        remaining.push_back(without_name[i]);
      } else {
        free_names[without_name[i].first] = candidates[i];
      }
    }
    without_name = std::move(remaining);
  }
  return free_names;
}

std::vector<ViewId> Synchronisation::find_sent_views(bool are_new) const {
  std::vector<ViewId> sent;
  for (const auto& [view, row] : synchronised_) {
    if (row.sent == upload_number_ && row.server_view.has_value() != are_new) sent.push_back(view);
  }
  return sent;
}

void Synchronisation::upload_views() {
  const std::vector<ViewId> sent = find_sent_views(true);
  transfer_total_ = sent.size();
  for_each_batch(sent, views_per_batch, [&](std::span<const ViewId> part) {
    std::vector<ViewId> ids;
    std::vector<NewView> views;
    {
      const auto reading = file_.transaction(Kind::reading);
      local_checksums_ = read_view_checksums(file_);
      for (const ViewId view : part) {
        auto row = read_local_row(view);
        if (!row || row->checksum != synchronised_.at(view).local_checksum) continue;
        ids.push_back(view);
        views.push_back(to_new_view(view, std::move(*row)));
      }
    }
    if (!ids.empty()) upload_batch(ids, views);
  });
}

NewView Synchronisation::to_new_view(ViewId view, LocalRow row) {
  NewView whole{std::move(row.info), {}, {}, {}};
  unpack_signature(row.signature, header_.shape, whole.signature);
  const auto read = [&](ViewAttachment table, Bytes& bytes) {
    auto stored = file_.bytes(table, view);
    if (!stored) return;
    file_.check_attachment(table, view, *stored);
    bytes = std::move(stored->bytes);
  };
  read(ViewAttachment::thumbnails, whole.thumbnail);
  read(ViewAttachment::features, whole.features);
  return whole;
}

void Synchronisation::upload_batch(const std::vector<ViewId>& ids,
                                   const std::vector<NewView>& views) {
  server_.stage_views(views);
  std::uint32_t last = server_.reserve_ids(ids.size());
  std::vector<ServerExchange::Staged> staged;
  Bytes signature;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    const SynchronisedView& row = synchronised_.at(ids[i]);
    const NewView& view = views[i];
    const ViewId id{++last};
    pack_signature(view.signature, signature);
    staged.push_back({i,
                      {ids[i], row.signature, id, row.local_checksum,
                       view_checksum(scratch_, id, view.info, signature), upload_number_},
                      attachment_checksum(id, view.thumbnail),
                      attachment_checksum(id, view.features)});
  }
  // Views whose names were taken in the meantime are not in the result; the next synchronisation
  // finds other names.
  for (const Upload& upload : server_.submit_views(state_.file, upload_number_, staged)) {
    SynchronisedView row = synchronised_.at(upload.view);
    if (upload.signature != row.signature) continue;
    acknowledge(row, upload, upload.sent == upload_number_);
    set_row(upload.view, row);
    report_.uploaded += upload.sent == upload_number_ ? 1 : 0;
    if (advance_) advance_(transfer_total_);
  }
  state_.last_view = std::max(state_.last_view, std::int64_t{last});
}

void Synchronisation::upload_changes() {
  for_each_batch(find_sent_views(false), rows_per_query, [&](std::span<const ViewId> part) {
    std::vector<ViewId> ids, server_ids;
    std::vector<LocalRow> rows;
    {
      const auto reading = file_.transaction(Kind::reading);
      local_checksums_ = read_view_checksums(file_);
      for (const ViewId view : part) {
        auto row = read_local_row(view);
        if (!row) continue;
        ids.push_back(view);
        server_ids.push_back(*synchronised_.at(view).server_view);
        rows.push_back(std::move(*row));
      }
    }
    std::vector<ServerExchange::ChangedView> changes;
    for (std::size_t i = 0; i < ids.size(); ++i) {
      SynchronisedView row = synchronised_.at(ids[i]);
      changes.push_back({{ids[i], row.signature, server_ids[i], rows[i].checksum,
                          view_checksum(scratch_, server_ids[i], rows[i].info, rows[i].signature),
                          upload_number_},
                         rows[i].info,
                         row.server_checksum});
    }
    if (changes.empty()) return;
    const auto accepted = server_.submit_changes(state_.file, upload_number_, changes);
    // If another robot has changed a view first, `download` gets its change.
    for (const ViewId view : ids) {
      SynchronisedView row = synchronised_.at(view);
      row.sent.reset();
      set_row(view, row);
    }
    for (const Upload& upload : accepted) {
      SynchronisedView row = synchronised_.at(upload.view);
      if (upload.signature != row.signature) continue;
      acknowledge(row, upload, true);
      set_row(upload.view, row);
    }
    report_.updated_on_server += accepted.size();
  });
}

void Synchronisation::upload_removals() {
  for_each_batch(removed_locally_, rows_per_query, [&](std::span<const ViewId> part) {
    std::vector<ViewId> server_ids;
    std::map<ViewId, SynchronisedView> rows;
    local_checksums_ = read_view_checksums(file_);
    for (const ViewId view : part) {
      const auto row = synchronised_.find(view);
      if (row == synchronised_.end() || !row->second.server_view || local_checksums_.contains(view))
        continue;
      server_ids.push_back(*row->second.server_view);
      rows[*row->second.server_view] = row->second;
    }
    const auto server_checksums = server_.read_checksums(server_ids);
    // A restored server may have given the id to another view.
    std::map<ViewId, std::int64_t> unchanged;
    std::vector<ViewId> changed;
    for (const auto& [id, checksum] : server_checksums) {
      if (checksum == rows.at(id).server_checksum) {
        unchanged[id] = checksum;
      } else {
        changed.push_back(id);
      }
    }
    for (const auto& [id, signature] : server_.read_signature_checksums(changed)) {
      if (signature == rows.at(id).signature) unchanged[id] = server_checksums.at(id);
    }
    const std::vector<ViewId> removed = remove_on_server(unchanged);
    report_.removed_on_server += removed.size();
    for (const ViewId id : server_ids) {
      // A view that another robot has just changed is left for the next synchronisation.
      if (unchanged.contains(id) && !std::ranges::binary_search(removed, id)) continue;
      forget_server_view(id);
    }
  });
}

std::vector<ViewId> Synchronisation::remove_on_server(
    const std::map<ViewId, std::int64_t>& checksums) {
  std::vector<ViewId> removed;
  if (checksums.empty()) return removed;
  if (server_.tables().map_names().empty()) {
    removed = server_.submit_removals(checksums);
  } else {
    // This program also changes the maps, so other clients wait for its network.
    const auto writing = server_.tables().transaction(Kind::writing);
    std::vector<ViewId> ids;
    for (const auto& [id, checksum] : checksums) ids.push_back(id);
    for (const auto& [id, checksum] : server_.read_checksums(ids)) {
      if (checksum == checksums.at(id)) removed.push_back(id);
    }
    server_.tables().remove(removed);
    erase_views_from_maps(server_.tables(), removed);
    const std::string key = "parameter." + std::string(recordings_parameter);
    server_.tables().write_setting(key, std::string());
    writing->commit();
  }
  std::ranges::sort(removed);
  return removed;
}

void Synchronisation::upload_links() {
  SynchronisedLinks local;
  {
    const auto reading = file_.transaction(Kind::reading);
    local_checksums_ = read_view_checksums(file_);
    local = read_local_links();
  }
  std::vector<Link> added;
  std::vector<ServerExchange::ChangedLink> changed;
  for (const auto& [ends, kind] : local) {
    const auto former = links_.find(ends);
    if (former == links_.end()) {
      added.push_back({ends.first, ends.second, kind});
    } else if (former->second != kind) {
      changed.push_back({{ends.first, ends.second, former->second}, kind});
    }
  }
  for (const auto& [ends, kind] : links_) {
    if (local.contains(ends) || !is_in_file(ends.first) || !is_in_file(ends.second)) continue;
    if (server_.can_change()) changed.push_back({{ends.first, ends.second, kind}, std::nullopt});
  }
  if (added.empty() && changed.empty()) return;
  report_.links_uploaded += server_.submit_links(added, changed);
  for (const Link& link : added) links_[{link.a, link.b}] = link.kind;
  for (const auto& link : changed) {
    if (link.new_kind) {
      links_[{link.former.a, link.former.b}] = *link.new_kind;
    } else {
      links_.erase({link.former.a, link.former.b});
    }
  }
}

}  // namespace panonav::fleet

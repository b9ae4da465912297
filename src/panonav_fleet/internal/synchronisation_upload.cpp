
#include "panonav_fleet/internal/synchronisation.hpp"

#include <algorithm>

#include "panonav/core/error.hpp"
#include "panonav/storage/internal/map_tables.hpp"
#include "panonav/storage/internal/memory_rows.hpp"

namespace panonav::fleet {

void Synchronisation::ask_for_answers() {
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

void Synchronisation::take_answer(SynchronisedView& row, const Upload& upload,
                                  bool of_this_sending) {
  row.server_view = upload.server_view;
  if (of_this_sending) row.local_checksum = upload.local_checksum;
  row.server_checksum = of_this_sending ? upload.server_checksum : ~upload.server_checksum;
  row.uploaded = true;
  row.sent.reset();
}

std::map<ViewId, std::string> Synchronisation::find_local_changes() {
  std::vector<ViewId> changed;
  removed_.clear();
  for (const auto& [view, checksum] : local_) {
    const auto row = views_.find(view);
    const bool is_new = row == views_.end();
    if (!is_new && row->second.local_checksum == checksum) continue;
    if (is_new ? server_.may_add() : server_.may_change()) changed.push_back(view);
  }
  for (const auto& [view, row] : views_) {
    if (!local_.contains(view) && server_.may_change()) removed_.push_back(view);
  }
  std::map<ViewId, std::string> names;
  const auto reading = file_.transaction(Kind::reading);
  local_ = read_view_checksums(file_);
  for (const ViewId view : changed) {
    if (const auto row = read_row(view)) names[view] = row->info.name;
  }
  return names;
}

std::map<std::string, ServerView> Synchronisation::views_with_names(
    const std::map<ViewId, std::string>& names) {
  std::vector<std::string> asked;
  for (const auto& [view, name] : names) asked.push_back(name);
  std::map<std::string, ServerView> views;
  in_parts(asked, rows_at_once, [&](std::span<const std::string> part) {
    for (ServerView& view : server_.named(part)) views[view.info.name] = std::move(view);
  });
  return views;
}

void Synchronisation::note_as_sent(ViewId view, const LocalRow& row, const ServerView* same) {
  const auto known = views_.find(view);
  SynchronisedView next;
  if (known != views_.end()) {
    next = known->second;
    next.sent = sent_;
  } else if (same != nullptr && adopts(view, *same)) {
    next = adopted(view, row, same->id, same->info, same->checksum);
  } else {
    next.local_checksum = local_.at(view);
    next.signature = signature_checksum(row.signature);
    next.sent = sent_;
  }
  put(view, next);
}

void Synchronisation::prepare() {
  const std::map<ViewId, std::string> names = find_local_changes();
  std::map<std::string, ServerView> taken;
  std::map<ViewId, std::string> new_names;
  {
    const auto reading = server_.tables().transaction(Kind::reading);
    taken = views_with_names(names);
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
    const auto same = taken.find(name);
    note_as_sent(view, *row, same == taken.end() ? nullptr : &same->second);
  }
  if (report_.renamed > 0) clear_recordings();
  commit(*writing);
}

bool Synchronisation::is_at(ViewId view, ViewId server_view) const {
  const auto row = views_.find(view);
  return row != views_.end() && row->second.server_view == server_view;
}

bool Synchronisation::adopts(ViewId view, const ServerView& other) {
  if (views_.contains(view) || by_server_.contains(other.id)) return false;
  const auto row = read_row(view);
  return row && view_checksum(scratch_, other.id, other.info, row->signature) == other.checksum;
}

SynchronisedView Synchronisation::adopted(ViewId view, const LocalRow& row, ViewId server_view,
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

std::map<ViewId, std::string> Synchronisation::free_names(
    std::vector<std::pair<ViewId, std::string>> nameless) {
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

std::vector<ViewId> Synchronisation::sent_views(bool are_new) const {
  std::vector<ViewId> sent;
  for (const auto& [view, row] : views_) {
    if (row.sent == sent_ && row.server_view.has_value() != are_new) sent.push_back(view);
  }
  return sent;
}

void Synchronisation::upload_views() {
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

NewView Synchronisation::whole(ViewId view, LocalRow row) {
  NewView whole{std::move(row.info), {header_.shape, {}, {}}, {}, {}};
  const auto half = static_cast<std::ptrdiff_t>(header_.shape.size());
  whole.signature.magnitudes.assign(row.signature.begin(), row.signature.begin() + half);
  whole.signature.phases.assign(row.signature.begin() + half, row.signature.end());
  const auto read = [&](BesideViews table, Bytes& bytes) {
    auto stored = file_.bytes(table, view);
    if (!stored) return;
    if (stored->checksum != bytes_checksum(view, stored->bytes)) {
      file_.fail_damaged(std::string(table == BesideViews::thumbnails ? "thumbnails" : "features") +
                         " of view " + std::to_string(view.value) +
                         ": the checksum does not match");
    }
    bytes = std::move(stored->bytes);
  };
  read(BesideViews::thumbnails, whole.thumbnail);
  read(BesideViews::features, whole.features);
  return whole;
}

void Synchronisation::upload_part(const std::vector<ViewId>& ids,
                                  const std::vector<NewView>& views) {
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

void Synchronisation::upload_changes() {
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

void Synchronisation::upload_removals() {
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

std::vector<ViewId> Synchronisation::remove_there(const std::map<ViewId, std::int64_t>& checksums) {
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

void Synchronisation::upload_links() {
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

}  // namespace panonav::fleet

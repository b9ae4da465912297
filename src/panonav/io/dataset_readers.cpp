#include "panonav/io/dataset_readers.hpp"

#include <algorithm>
#include <mutex>

#include "panonav/core/error.hpp"
#include "panonav/io/media_kind.hpp"

namespace panonav {

namespace {

struct ReaderTable {
  std::mutex mutex;
  std::vector<DatasetReader> readers;  ///< in the order of registration
  ForeignPictureStoreMaker make_foreign_picture_store = nullptr;
};

ReaderTable& reader_table() {
  static ReaderTable table;
  return table;
}

}  // namespace

void register_dataset_reader(const DatasetReader& reader) {
  if (reader.name.empty() || reader.recognises == nullptr || reader.read == nullptr) {
    throw ContractError("data set reader", "incomplete", "a name and both functions");
  }
  ReaderTable& table = reader_table();
  const std::lock_guard lock(table.mutex);
  const auto same = std::ranges::find(table.readers, reader.name, &DatasetReader::name);
  if (same == table.readers.end()) {
    table.readers.push_back(reader);
  } else {
    *same = reader;
  }
}

std::optional<DatasetReader> find_dataset_reader(const std::filesystem::path& path) {
  ReaderTable& table = reader_table();
  const std::lock_guard lock(table.mutex);
  const auto found = std::ranges::find_if(
      table.readers, [&](const DatasetReader& reader) { return reader.recognises(path); });
  return found == table.readers.end() ? std::nullopt : std::optional(*found);
}

void register_foreign_picture_store(ForeignPictureStoreMaker maker) {
  ReaderTable& table = reader_table();
  const std::lock_guard lock(table.mutex);
  table.make_foreign_picture_store = maker;
}

bool can_read_foreign_pictures() {
  ReaderTable& table = reader_table();
  const std::lock_guard lock(table.mutex);
  return table.make_foreign_picture_store != nullptr;
}

void set_foreign_picture_stores(std::vector<DatasetEntry>& entries) {
  if (!can_read_foreign_pictures()) return;
  std::vector<DatasetEntry*> foreign;
  std::vector<std::filesystem::path> files;
  for (DatasetEntry& entry : entries) {
    if (identify_media_file(entry.path) != MediaKind::foreign_picture) continue;
    foreign.push_back(&entry);
    files.push_back(entry.path);
  }
  if (files.empty()) return;
  const auto store = reader_table().make_foreign_picture_store(std::move(files));
  for (std::size_t i = 0; i < foreign.size(); ++i) {
    foreign[i]->store = store;
    foreign[i]->store_index = i;
  }
}

bool has_dataset_reader(const std::string& name) {
  ReaderTable& table = reader_table();
  const std::lock_guard lock(table.mutex);
  return std::ranges::find(table.readers, name, &DatasetReader::name) != table.readers.end();
}

}  // namespace panonav

#include "panonav/io/dataset_readers.hpp"

#include <algorithm>
#include <mutex>

#include "panonav/core/error.hpp"

namespace panonav {

namespace {

struct ReaderTable {
  std::mutex mutex;
  std::vector<DatasetReader> readers;  ///< in the order of registration
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

bool has_dataset_reader(const std::string& name) {
  ReaderTable& table = reader_table();
  const std::lock_guard lock(table.mutex);
  return std::ranges::find(table.readers, name, &DatasetReader::name) != table.readers.end();
}

}  // namespace panonav

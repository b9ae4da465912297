#include "panonav/io/rig_pictures.hpp"

#include <memory>
#include <system_error>
#include <utility>
#include <variant>

#include "panonav/core/error.hpp"
#include "panonav/io/image_file.hpp"

namespace panonav {

namespace {

namespace fs = std::filesystem;

void set_pictures(Dataset& dataset, const RigModel& rig, std::vector<fs::path> files) {
  const auto pictures = std::make_shared<const RigPictures>(rig, std::move(files));
  for (std::size_t i = 0; i < dataset.entries.size(); ++i) {
    dataset.entries[i].store = pictures;
    dataset.entries[i].store_index = i;
  }
}

}  // namespace

RigPictures::RigPictures(RigModel rig, std::vector<fs::path> files)
    : rig_(std::move(rig)), files_(std::move(files)) {
  const std::size_t cameras = rig_.cameras.size();
  require(files_.size() % cameras == 0, "images of a rig", static_cast<double>(files_.size()),
          "a multiple of its " + std::to_string(cameras) + " cameras, one after the other");
}

Image RigPictures::read(std::size_t index) const {
  const std::size_t cameras = rig_.cameras.size();
  std::vector<Image> images;
  std::vector<ImageView> views;
  images.reserve(cameras);
  for (std::size_t i = 0; i < cameras; ++i) {
    images.push_back(read_image(files_.at(index * cameras + i)));
    views.push_back(images.back().view());
  }
  try {
    return join_pictures(rig_, views);
  } catch (const ContractError& error) {
    throw FileError(files_[index * cameras].string(), error.what());
  }
}

void join_entries(Dataset& dataset) {
  const auto& camera = dataset.source.camera;
  const auto* const rig = camera ? std::get_if<RigModel>(&camera->model) : nullptr;
  if (rig == nullptr || read_image_size(dataset.entries.at(0).path) == camera->image_size) return;
  std::vector<fs::path> files;
  std::vector<DatasetEntry> joined;
  for (std::size_t i = 0; i < dataset.entries.size(); ++i) {
    files.push_back(dataset.entries[i].path);
    if (i % rig->cameras.size() == 0) joined.push_back(std::move(dataset.entries[i]));
  }
  dataset.entries = std::move(joined);
  set_pictures(dataset, *rig, std::move(files));
}

void join_folders(Dataset& dataset, const RigModel& rig, std::span<const std::string> folders) {
  std::vector<fs::path> files;
  for (const DatasetEntry& entry : dataset.entries) {
    const fs::path name = entry.path.lexically_relative(dataset.folder / folders.front());
    if (name.empty() || *name.begin() == "..") {
      throw FileError(entry.path.string(),
                      "is not in the folder of the rig's first camera, '" + folders.front() + "'");
    }
    for (const std::string& folder : folders) {
      files.push_back(dataset.folder / folder / name);
      std::error_code ignored;
      if (!fs::is_regular_file(files.back(), ignored)) {
        throw FileError(files.back().string(),
                        "does not exist; each camera of a rig needs an image of this name");
      }
    }
  }
  set_pictures(dataset, rig, std::move(files));
}

}  // namespace panonav

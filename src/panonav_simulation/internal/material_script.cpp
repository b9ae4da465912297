#include "panonav_simulation/internal/material_script.hpp"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <utility>

#include "panonav/core/number_text.hpp"
#include "panonav_simulation/internal/gazebo_files.hpp"

namespace panonav::simulation {

namespace {

namespace fs = std::filesystem;

struct NamedColour {
  std::string_view name;
  std::array<float, 3> colour;
};

// Diffuse colours of Gazebo's material file.
constexpr std::array<NamedColour, 21> gazebo_colours{{
    {"Gazebo/Grey", {0.7F, 0.7F, 0.7F}},
    {"Gazebo/Gray", {0.7F, 0.7F, 0.7F}},
    {"Gazebo/DarkGrey", {0.175F, 0.175F, 0.175F}},
    {"Gazebo/DarkGray", {0.175F, 0.175F, 0.175F}},
    {"Gazebo/White", {1.0F, 1.0F, 1.0F}},
    {"Gazebo/FlatBlack", {0.1F, 0.1F, 0.1F}},
    {"Gazebo/Black", {0.0F, 0.0F, 0.0F}},
    {"Gazebo/Red", {1.0F, 0.0F, 0.0F}},
    {"Gazebo/RedBright", {0.87F, 0.26F, 0.07F}},
    {"Gazebo/Green", {0.0F, 1.0F, 0.0F}},
    {"Gazebo/Blue", {0.0F, 0.0F, 1.0F}},
    {"Gazebo/SkyBlue", {0.13F, 0.44F, 0.7F}},
    {"Gazebo/Yellow", {1.0F, 1.0F, 0.0F}},
    {"Gazebo/ZincYellow", {0.9725F, 0.9529F, 0.2078F}},
    {"Gazebo/DarkYellow", {0.7F, 0.7F, 0.0F}},
    {"Gazebo/Purple", {1.0F, 0.0F, 1.0F}},
    {"Gazebo/Turquoise", {0.0F, 1.0F, 1.0F}},
    {"Gazebo/Orange", {1.0F, 0.5088F, 0.0468F}},
    {"Gazebo/Indigo", {0.33F, 0.0F, 0.5F}},
    {"Gazebo/Gold", {0.8F, 0.64F, 0.12F}},
    {"Gazebo/Wood", {0.55F, 0.38F, 0.21F}},
}};

// Splits a script into words; braces are separate words, comments are omitted.
std::vector<std::string> read_words(const fs::path& file) {
  require_scene_file(file);
  std::ifstream stream(file);
  std::vector<std::string> words;
  std::string line;
  while (std::getline(stream, line)) {
    if (const auto comment = line.find("//"); comment != std::string::npos) line.erase(comment);
    std::string spaced;
    for (const char c : line) {
      if (c == '{' || c == '}') {
        spaced += ' ';
        spaced += c;
        spaced += ' ';
      } else {
        spaced += c;
      }
    }
    for (std::string& word : panonav::split_words(spaced)) words.push_back(std::move(word));
  }
  return words;
}

std::optional<std::array<float, 3>> parse_colour(const std::vector<std::string>& words,
                                                 std::size_t first) {
  std::array<float, 3> colour{};
  for (std::size_t i = 0; i < 3; ++i) {
    if (first + i >= words.size()) return std::nullopt;
    const std::string& word = words[first + i];
    const auto result = std::from_chars(word.data(), word.data() + word.size(), colour[i]);
    if (result.ec != std::errc() || !(colour[i] >= 0.0F && colour[i] <= 1.0F)) return std::nullopt;
  }
  return colour;
}

std::optional<ScriptMaterial> find_in_file(std::string_view name, const fs::path& file) {
  const std::vector<std::string> words = read_words(file);
  for (std::size_t i = 0; i + 1 < words.size(); ++i) {
    if (words[i] != "material" || words[i + 1] != name) continue;
    ScriptMaterial material;
    material.texture_directory = file.parent_path();
    int depth = 0;
    for (std::size_t k = i + 2; k < words.size(); ++k) {
      if (words[k] == "{") ++depth;
      if (words[k] == "}" && --depth <= 0) break;
      if (k + 1 >= words.size()) break;
      if (words[k] == "diffuse" && !material.diffuse) material.diffuse = parse_colour(words, k + 1);
      if (words[k] == "emissive" && !material.emissive)
        material.emissive = parse_colour(words, k + 1);
      if (words[k] == "texture" && material.texture.empty()) material.texture = words[k + 1];
    }
    return material;
  }
  return std::nullopt;
}

}  // namespace

std::optional<ScriptMaterial> find_script_material(std::string_view name,
                                                   const std::vector<fs::path>& places) {
  for (const fs::path& place : places) {
    std::error_code error;
    std::vector<fs::path> files;
    if (fs::is_regular_file(place, error)) files.push_back(place);
    for (fs::directory_iterator it(place, error), end; !error && it != end; it.increment(error)) {
      if (it->path().extension() == ".material") files.push_back(it->path());
    }
    std::sort(files.begin(), files.end());
    for (const fs::path& file : files) {
      if (auto material = find_in_file(name, file)) return material;
    }
  }
  for (const NamedColour& known : gazebo_colours) {
    if (known.name == name) return ScriptMaterial{known.colour, {}, {}, {}};
  }
  return std::nullopt;
}

}  // namespace panonav::simulation

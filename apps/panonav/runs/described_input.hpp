#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "panonav/core/image.hpp"

namespace panonav::command {

/// The verbs that take an input, and the next command.
struct InputUse {
  std::vector<std::string> verbs;  ///< verbs of this build that take it, in the order of the help
  std::vector<std::string> next;   ///< words of the most useful next command; empty: there is none
};

/// Kinds of inputs with the same uses.
enum class InputKind {
  memory,
  dataset,         ///< with dataset.toml
  narrow_dataset,  ///< with dataset.toml, of pictures that show a part of the azimuth
  pictures,
  picture,
  video,
  recording,
  live,
  camera_file,
  narrow_camera_file,  ///< of a pinhole camera
  trajectory,
  scene
};

/// A kind of images guessed by their shape.
struct GuessedKind {
  std::string_view kind;  ///< value of --kind; empty: unknown
  std::string_view text;  ///< the reason, and what to do
};
[[nodiscard]] GuessedKind guess_kind(ImageSize size);

/// Returns the names of the verbs of this build that take the kind, with the option if they take it
/// by an option: "unwrap --camera".
[[nodiscard]] std::vector<std::string> list_verbs_that_take(InputKind kind);
/// Returns the words of the command that stores the images of an input in a new memory, which gets
/// the name of the input. `image_kind`: value of --kind; empty: the input states it.
[[nodiscard]] std::vector<std::string> make_memorise_command(const std::string& input,
                                                             std::string_view image_kind);

/// An input that is neither a memory, a recording of topics, a video nor a camera.
struct DescribedInput {
  std::string type;                ///< "data set", "folder of images", "image", ...
  std::string summary;             ///< the rest of the first line: "117 images of 1024 x 512 px"
  std::uint64_t bytes = 0;         ///< of its files; 0: not known
  std::uint64_t images = 0;        ///< number of its images
  std::vector<std::string> facts;  ///< further lines
  std::string posed_dataset;       ///< folder of a data set with poses or odometry; else empty
  InputUse use;
};

/// Describes a file, a folder or a live source. Reads the heads of files and the tables of data
/// sets; decodes no image and opens no live source. Throws FileError with one line that describes
/// the content if no verb takes it, and on a data set or camera file that cannot be read.
[[nodiscard]] DescribedInput describe_input(const std::string& input);

}  // namespace panonav::command

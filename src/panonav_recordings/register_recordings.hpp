#pragma once

namespace panonav::recordings {

/// Registers the readers (`register_dataset_reader`) of recordings of topics (`read_recording`), of
/// videos (`read_video`) and of JPEG pictures on standard input, whose path is "-"
/// (`read_jpeg_stream`). May be called again.
void register_recordings();

}  // namespace panonav::recordings

#pragma once

#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>

namespace panonav::command {

/// Divides jobs among processes that write into one folder: those that mpirun or srun started, or
/// several that go on with one piece of work by hand. A job belongs to the process that holds a
/// lock on its byte of the file `.panonav-jobs`; the system takes the lock back when the process
/// ends, so a job whose process was lost is free again. Which jobs are done is told by what they
/// write. The folder may lie on a file system of several machines, where that has locks (NFS 4
/// has).
class SharedJobs {
 public:
  /// Joins the work in the folder, which is made where it is not there. `begin` is called alone, by
  /// one process: with true by the first of a run, with false by each that joins it (processes of
  /// one mpirun, or `continues`). Throws what `begin` throws, and FileError.
  SharedJobs(const std::filesystem::path& folder, bool continues,
             const std::function<void(bool first)>& begin);
  ~SharedJobs();
  SharedJobs(const SharedJobs&) = delete;
  SharedJobs& operator=(const SharedJobs&) = delete;

  /// False where another process holds the job. Claim it before asking whether it is done.
  [[nodiscard]] bool claim(std::size_t job);
  void release(std::size_t job);

 private:
  int file_ = -1;
};

/// What mpirun or srun call the run that this process belongs to; empty: it was started alone.
[[nodiscard]] std::string parallel_run();

}  // namespace panonav::command

#include "verbs/shared_jobs.hpp"

#include <fcntl.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstdlib>
#include <system_error>

#include "panonav/core/error.hpp"

namespace panonav::command {

namespace {

constexpr std::size_t max_run_bytes = 4096;

/// Byte 0 is held while a process joins; those of the jobs follow.
bool lock_byte(int file, std::size_t byte, short kind, bool wait) {
  struct flock wanted {};
  wanted.l_type = kind;
  wanted.l_whence = SEEK_SET;
  wanted.l_start = static_cast<off_t>(byte);
  wanted.l_len = 1;
  int result = 0;
  do {
    result = fcntl(file, wait ? F_OFD_SETLKW : F_OFD_SETLK, &wanted);
  } while (result != 0 && errno == EINTR);
  return result == 0;
}

}  // namespace

std::string parallel_run() {
  std::string run;
  for (const char* const name : {"OMPI_MCA_orte_precondition_transports", "PMIX_NAMESPACE",
                                 "SLURM_JOB_ID", "SLURM_STEP_ID"}) {
    // NOLINTNEXTLINE(concurrency-mt-unsafe): nothing here changes the environment
    const char* const value = std::getenv(name);
    if (value != nullptr) run += std::string(name) + "=" + value + ";";
  }
  // A batch job's own script is no step of it.
  const bool alone = run.find("OMPI") == std::string::npos &&
                     run.find("PMIX") == std::string::npos && run.find("STEP") == std::string::npos;
  return alone ? std::string() : run.substr(0, max_run_bytes);
}

SharedJobs::SharedJobs(const std::filesystem::path& folder, bool continues,
                       const std::function<void(bool first)>& begin) {
  std::error_code error;
  std::filesystem::create_directories(folder, error);
  if (error) throw FileError(folder.string(), "cannot be made: " + error.message());
  const std::filesystem::path path = folder / ".panonav-jobs";
  file_ = open(path.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (file_ < 0) {
    throw FileError(path.string(), "cannot be written: " + std::generic_category().message(errno));
  }
  try {
    if (!lock_byte(file_, 0, F_WRLCK, true)) {
      throw FileError(path.string(), "cannot be locked: " + std::generic_category().message(errno) +
                                         "; allowed: a file system that has locks");
    }
    std::array<char, max_run_bytes> bytes{};
    const ssize_t count = pread(file_, bytes.data(), bytes.size(), 0);
    const std::string joined(bytes.data(), static_cast<std::size_t>(count < 0 ? 0 : count));
    const std::string own = parallel_run();
    const bool first = !continues && (own.empty() || own != joined);
    begin(first);
    // Written last: where `begin` fails in one process, it fails in all.
    if (first || continues) {
      if (ftruncate(file_, 0) != 0 ||
          pwrite(file_, own.data(), own.size(), 0) != static_cast<ssize_t>(own.size())) {
        throw FileError(path.string(),
                        "cannot be written: " + std::generic_category().message(errno));
      }
    }
    (void)lock_byte(file_, 0, F_UNLCK, false);
  } catch (...) {
    close(file_);
    throw;
  }
}

SharedJobs::~SharedJobs() {
  close(file_);
}

bool SharedJobs::claim(std::size_t job) {
  return lock_byte(file_, job + 1, F_WRLCK, false);
}

void SharedJobs::release(std::size_t job) {
  (void)lock_byte(file_, job + 1, F_UNLCK, false);
}

}  // namespace panonav::command

#include <fcntl.h>
#include <sys/prctl.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <memory>
#include <set>
#include <system_error>
#include <utility>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/json.hpp"
#include "cli/session.hpp"
#include "cli/stop_signals.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/io/atomic_file.hpp"
#include "panonav/io/csv_table.hpp"
#include "verbs/shared_jobs.hpp"

namespace panonav::command {

namespace {

namespace fs = std::filesystem;

constexpr std::size_t max_sweep_bytes = 256 << 20;

struct SweepArguments {
  std::string table;
  std::string out;
  std::vector<std::string> command;
  bool continues = false;
};

/// A table and what is done with each of its rows.
struct Sweep {
  SweepArguments wanted;
  CsvTable table;

  [[nodiscard]] std::size_t jobs() const { return table.rows(); }
  /// "out/000001" and, with an ending, the files beside it.
  [[nodiscard]] fs::path path(std::size_t job, const std::string& ending = "") const {
    const std::string number = std::to_string(job + 1);
    return fs::path(wanted.out) /
           (std::string(6 - std::min<std::size_t>(6, number.size()), '0') + number + ending);
  }
  [[nodiscard]] bool done(std::size_t job) const {
    std::error_code ignored;
    return fs::exists(path(job, ".json"), ignored);
  }
  [[nodiscard]] ordered_json values(std::size_t job) const {
    ordered_json json{{"job", job + 1}};
    for (const std::string& column : table.columns()) json[column] = table.text(job, column);
    return json;
  }
};

/// The word with what stands for its names in braces; "{{" and "}}" are braces. `value` throws for
/// a name that there is not.
std::string filled(const std::string& word,
                   const std::function<std::string(const std::string& name)>& value) {
  std::string text;
  for (std::size_t i = 0; i < word.size(); ++i) {
    const char c = word[i];
    if ((c == '{' || c == '}') && word.substr(i + 1, 1) == std::string(1, c)) {
      text += c;
      ++i;
    } else if (c == '{') {
      const std::size_t end = word.find('}', i);
      if (end == std::string::npos) {
        throw UsageError("'" + readable_line(word) +
                         "' has a '{' without '}'; allowed: {NAME}, "
                         "and {{ for a brace");
      }
      text += value(word.substr(i + 1, end - i - 1));
      i = end;
    } else {
      text += c;
    }
  }
  return text;
}

std::vector<std::string> command_of(const Sweep& sweep, std::size_t job) {
  std::vector<std::string> words;
  for (const std::string& word : sweep.wanted.command) {
    words.push_back(filled(word, [&](const std::string& name) {
      if (name == "out") return sweep.path(job).string();
      if (name == "job") return std::to_string(job + 1);
      return sweep.table.text(job, name);
    }));
  }
  return words;
}

/// Throws UsageError where the command and the table do not fit.
void check(const Sweep& sweep) {
  const SweepArguments& wanted = sweep.wanted;
  const CsvTable& table = sweep.table;
  if (table.rows() == 0)
    throw FileError(wanted.table, "it has no rows; allowed: a row for each job");
  const auto verbs = all_verbs();
  const Verb* const verb = verb_in(verbs, wanted.command);
  if (verb == nullptr || verb->name == "sweep") {
    throw UsageError("'" + readable_line(wanted.command.front()) +
                     "' cannot be swept; allowed: any verb of panonav --help but sweep");
  }
  std::string allowed = "{job}, {out}";
  for (const std::string& column : table.columns()) {
    if (column == "job" || column == "out" || column == "exit_code") {
      throw FileError(wanted.table, "a column is called " + column +
                                        "; allowed: names other than job, out and exit_code");
    }
    allowed += ", {" + readable_line(column) + "}";
  }
  std::set<std::string> used;
  for (const std::string& word : wanted.command) {
    (void)filled(word, [&](const std::string& name) {
      if (name != "job" && name != "out" && !table.has(name)) {
        throw UsageError("there is no {" + readable_line(name) + "}; allowed: " + allowed);
      }
      used.insert(name);
      return name;
    });
  }
  for (const std::string& column : table.columns()) {
    if (!used.contains(column)) {
      throw UsageError("column " + readable_line(column) + " of " + wanted.table +
                       " stands nowhere in the command; allowed: a command with {" +
                       readable_line(column) + "}");
    }
  }
}

ordered_json record_of(const Sweep& sweep) {
  ordered_json rows = ordered_json::array();
  for (std::size_t job = 0; job < sweep.jobs(); ++job) rows.push_back(sweep.values(job));
  return {{"version", PANONAV_VERSION}, {"command", sweep.wanted.command}, {"jobs", rows}};
}

/// What the first process writes and the others must find.
void begin(const Sweep& sweep, bool first) {
  const fs::path file = fs::path(sweep.wanted.out) / "sweep.json";
  const std::string record = record_of(sweep).dump(1) + "\n";
  if (first) {
    for (const auto& entry : fs::directory_iterator(sweep.wanted.out)) {
      if (entry.path().filename() != ".panonav-jobs") {
        throw FileError(sweep.wanted.out,
                        "is not empty; allowed: a new folder, or --continue for a sweep that was "
                        "stopped");
      }
    }
    write_file(file, std::string_view(record));
    return;
  }
  if (!fs::exists(file)) throw FileError(file.string(), "is not there: no sweep to continue");
  const auto bytes = read_file(file, max_sweep_bytes);
  if (!std::ranges::equal(bytes, record, {}, {},
                          [](char c) { return static_cast<std::uint8_t>(c); })) {
    throw FileError(file.string(),
                    "tells of another sweep; allowed: the same table, command and version");
  }
  if (!sweep.wanted.continues) return;
  for (std::size_t job = 0; job < sweep.jobs(); ++job) {  // what failed is tried again
    if (!sweep.done(job)) continue;
    const auto json = ordered_json::parse(std::ifstream(sweep.path(job, ".json")), nullptr, false);
    if (!json.is_object() || json.value("exit_code", 3) > 1) fs::remove(sweep.path(job, ".json"));
  }
}

void redirect(const char* path, int number) {
  const int file = open(path, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0666);
  if (file < 0 || dup2(file, number) < 0) _exit(126);
}

/// Starts the command; it ends when this process does.
pid_t start(const Sweep& sweep, std::size_t job) {
  std::vector<std::string> words = command_of(sweep, job);
  words.insert(words.begin(), "panonav");
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  const std::string out = sweep.path(job, ".out").string();
  const std::string err = sweep.path(job, ".err").string();
  const pid_t parent = getpid();
  const pid_t child = fork();
  if (child < 0) throw Error("no process can be started for job " + std::to_string(job + 1));
  if (child > 0) return child;
  prctl(PR_SET_PDEATHSIG, SIGKILL);
  if (getppid() != parent) _exit(126);
  redirect("/dev/null", STDIN_FILENO);
  redirect(out.c_str(), STDOUT_FILENO);
  redirect(err.c_str(), STDERR_FILENO);
  execv("/proc/self/exe", argv.data());
  _exit(126);
}

/// Exit code, or 128 and the signal that ended it.
int wait_for(pid_t child) {
  int status = 0;
  while (waitpid(child, &status, 0) < 0 && errno == EINTR) {
  }
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

/// Tables of all jobs: how each ended, and what each printed as JSON. Gives how many failed.
std::size_t summarise(const Sweep& sweep) {
  std::size_t failed = 0;
  std::string jobs = "job";
  for (const std::string& column : sweep.table.columns()) jobs += "," + csv_field(column);
  jobs += ",exit_code\n";
  std::string results;
  for (std::size_t job = 0; job < sweep.jobs(); ++job) {
    const auto ended = ordered_json::parse(std::ifstream(sweep.path(job, ".json")), nullptr, false);
    const int code = ended.is_object() ? ended.value("exit_code", 3) : 3;
    if (code > 1) ++failed;
    jobs += std::to_string(job + 1);
    for (const std::string& column : sweep.table.columns()) {
      jobs += "," + csv_field(sweep.table.text(job, column));
    }
    jobs += "," + std::to_string(code) + "\n";
    std::ifstream printed(sweep.path(job, ".out"));
    for (std::string line; std::getline(printed, line);) {
      const auto json = ordered_json::parse(line, nullptr, false);
      if (!json.is_object()) continue;
      ordered_json result = sweep.values(job);
      result["output"] = json;
      results += json_line(result) + "\n";
    }
  }
  const fs::path out(sweep.wanted.out);
  write_file(out / "jobs.csv", std::string_view(jobs));
  if (std::ranges::find(sweep.wanted.command, "--json") != sweep.wanted.command.end()) {
    write_file(out / "results.jsonl", std::string_view(results));
  }
  return failed;
}

/// Runs the job in an empty folder of its own, which is made where the command names it.
int run_job(const Sweep& sweep, std::size_t job, std::atomic<pid_t>& running,
            const std::atomic<bool>& stopped) {
  fs::remove_all(sweep.path(job));
  const bool has_folder = std::ranges::any_of(sweep.wanted.command, [](const std::string& word) {
    return word.find("{out}") != std::string::npos;
  });
  if (has_folder) fs::create_directory(sweep.path(job));
  running = start(sweep, job);
  if (stopped) kill(running, SIGTERM);  // the request came before there was a process
  const int code = wait_for(running);
  running = 0;
  return code;
}

ExitCode sweep(const SweepArguments& wanted, Session& session) {
  const Sweep sweep{wanted, CsvTable::read(wanted.table)};
  check(sweep);
  const fs::path out(wanted.out);
  if (fs::exists(out) && !fs::exists(out / ".panonav-jobs") &&
      !(fs::is_directory(out) && fs::is_empty(out))) {
    throw FileError(wanted.out, "is there and no sweep; allowed: a new or empty folder");
  }
  if (wanted.continues && !fs::exists(out)) {
    throw FileError(wanted.out, "no such file or folder: no sweep to continue");
  }
  SharedJobs shared(out, wanted.continues, [&](bool first) { begin(sweep, first); });

  std::atomic<bool> stopped = false;
  std::atomic<pid_t> running = 0;
  const StopSignals signals([&] {
    stopped = true;
    if (const pid_t child = running; child > 0) kill(child, SIGTERM);
  });
  std::size_t mine = 0;
  {
    Progress progress(session, "sweeping", sweep.jobs());
    for (std::size_t job = 0; job < sweep.jobs() && !stopped; ++job) {
      if (!sweep.done(job) && shared.claim(job)) {
        if (!sweep.done(job)) {  // nobody finished it meanwhile
          const int code = run_job(sweep, job, running, stopped);
          if (stopped) break;
          ordered_json ended = sweep.values(job);
          ended["exit_code"] = code;
          write_file(sweep.path(job, ".json"), std::string_view(json_line(ended) + "\n"));
          ++mine;
          if (code > 1) {
            progress.clear();
            session.note("job " + std::to_string(job + 1) + " ended with exit code " +
                         std::to_string(code) + "; why: " + sweep.path(job, ".err").string());
          }
        }
        shared.release(job);
      }
      progress.advance();
    }
  }
  const auto tell = [&](ExitCode code, const ordered_json& json, const std::string& text) {
    session.print(session.json() ? json_line(json) : text);
    return code;
  };
  ordered_json json{{"out", wanted.out}, {"jobs", sweep.jobs()}, {"run_here", mine}};
  const std::string here = std::to_string(mine) + " of " + std::to_string(sweep.jobs()) +
                           " jobs were run by this process";
  if (stopped) {
    json["failed"] = nullptr;
    session.note("stopped; --continue goes on");
    return tell(ExitCode::no_answer, json, here);
  }
  for (std::size_t job = 0; job < sweep.jobs(); ++job) {
    if (sweep.done(job)) continue;
    json["failed"] = nullptr;
    return tell(ExitCode::done, json, here + "; other processes finish the rest");
  }
  const std::size_t failed = summarise(sweep);
  json["failed"] = failed;
  return tell(failed == 0 ? ExitCode::done : ExitCode::no_answer, json,
              here + "; " + std::to_string(failed) +
                  " of all failed; the table: " + (out / "jobs.csv").string());
}

Run declare_sweep(Arguments& arguments) {
  auto wanted = std::make_shared<SweepArguments>();
  arguments.positional("TABLE", wanted->table,
                       "CSV file with a row for each job and a column for each value");
  arguments.positional("OUT", wanted->out, "Folder for what the jobs write; new or empty");
  arguments.positionals("COMMAND", wanted->command,
                        "A verb and its arguments behind --: {COLUMN} stands for the value in the "
                        "row, {out} for a folder of the job, {job} for its number");
  arguments.flag("--continue", wanted->continues,
                 "Go on with a sweep that was stopped, or help one that runs: jobs that are done "
                 "are not run again, those that failed are");
  arguments.used_only(
      {"--threads"}, [] { return false; },
      "before --: one job runs at a time, on the threads that the command behind -- asks for");
  return [wanted](Session& session) { return sweep(*wanted, session); };
}

}  // namespace

Verb sweep_verb() {
  return {
      "sweep", "Run a command for each row of a table, on any number of processes",
      "Processes that mpirun or srun starts divide the jobs among themselves, and so do several\n"
      "that are started with --continue, on machines that share OUT. What a job prints is in\n"
      "OUT/000001.out and OUT/000001.err, how it ended in OUT/000001.json. jobs.csv lists all\n"
      "jobs, results.jsonl what they printed with --json; the same bytes on any number of\n"
      "processes. A job whose process was lost is run again with --continue. The exit code is 1\n"
      "when a job failed.",
      "  panonav sweep drives.csv memories -- memorise {recording} {out}/memory.panonav\n"
      "  mpirun -n 8 panonav sweep drives.csv memories -- memorise {recording} "
      "{out}/memory.panonav\n"
      "  panonav sweep study.csv study -- localise {memory} queries --top {top} --json",
      declare_sweep};
}

}  // namespace panonav::command

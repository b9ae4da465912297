#include <algorithm>
#include <csignal>
#include <filesystem>
#include <iostream>
#include <new>
#include <span>
#include <string>
#include <vector>

#include "cli/arguments.hpp"
#include "cli/option_values.hpp"
#include "cli/session.hpp"
#include "cli/stop_signals.hpp"
#include "cli/verbs.hpp"
#include "panonav/core/address.hpp"
#include "panonav/core/error.hpp"
#include "panonav/core/text.hpp"
#include "panonav/storage/memory_scheme.hpp"
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace {

using panonav::command::ExitCode;

/// Prints the message as one line on standard error; control characters are escaped.
void report(std::string_view verb, std::string_view message) {
  std::cerr << "panonav" << (verb.empty() ? "" : " ") << verb << ": "
            << panonav::to_readable_line(
                   panonav::command::replace_options_by_flags(panonav::mask_passwords(message)))
            << '\n';
}

/// Prints a warning for each damaged row that is skipped while reading a memory on a server. The
/// session must outlive this object.
class LeftOutWarnings {
 public:
  LeftOutWarnings(panonav::command::Session& session, std::string_view verb) {
    panonav::set_skipped_row_handler([&session, verb](const auto& memory, const auto& row) {
      session.note("panonav " + std::string(verb) + ": warning: " +
                   panonav::to_readable_line(memory.string() + ": left out: " + row.what));
    });
  }
  ~LeftOutWarnings() { panonav::set_skipped_row_handler({}); }
  LeftOutWarnings(const LeftOutWarnings&) = delete;
  LeftOutWarnings& operator=(const LeftOutWarnings&) = delete;
};

/// Lets the C library keep up to 32 MB of freed memory for the next image. By default it returns
/// the memory of a large image to the system, and each of its pages costs a page fault again.
void keep_freed_memory() {
#ifdef __GLIBC__
  constexpr int max_kept_bytes = 32 << 20;  // the largest that the library accepts
  mallopt(M_MMAP_THRESHOLD, max_kept_bytes);
  mallopt(M_TRIM_THRESHOLD, max_kept_bytes);
#endif
}

ExitCode run(std::string_view& verb, std::span<const std::string> words) {
  panonav::command::register_components();
  const auto verbs = panonav::command::all_verbs();
  if (const auto* known = panonav::command::find_verb(verbs, words)) verb = known->name;
  const auto command = panonav::command::parse(verbs, words);
  panonav::command::Session session(command.session);
  const LeftOutWarnings warnings(session, verb);
  session.detail("panonav " PANONAV_VERSION " " + std::string(command.verb) + " on " +
                 std::to_string(session.executor().threads()) + " threads");
  panonav::command::InterruptionNotice notice(command.verb, command.interruption_text);
  const ExitCode code = command.run(session);
  notice.cancel();
  session.detail("done");
  session.finish_output();
  return code;
}

}  // namespace

int main(int argc, char** argv) {
  // Ignores the signal for file size limits, so that such a write fails with a message instead of
  // killing the process.
  std::signal(SIGXFSZ, SIG_IGN);
  keep_freed_memory();
  std::string_view verb;
  try {
    const std::vector<std::string> words(argv + std::min(argc, 1), argv + argc);
    for (const std::string& word : words) {
      panonav::remember_address(word);
      if (const auto equals = word.find('='); equals < word.find("://")) {  // NAME=ADDRESS
        panonav::remember_address(std::string_view(word).substr(equals + 1));
      }
    }
    return static_cast<int>(run(verb, words));
  } catch (const panonav::command::UsageError& error) {
    std::string hint = verb.empty() ? "panonav --help" : "panonav " + std::string(verb) + " --help";
    report(verb, std::string(error.what()) + "; see " + hint);
    return static_cast<int>(ExitCode::bad_input);
  } catch (const panonav::Error& error) {
    report(verb, error.what());
    return static_cast<int>(ExitCode::bad_input);
  } catch (const std::filesystem::filesystem_error& error) {
    // The system rejects the path, such as a name of 300 characters.
    report(verb, error.path1().string() + ": cannot be used: " + error.code().message());
    return static_cast<int>(ExitCode::bad_input);
  } catch (const std::bad_alloc&) {
    report(verb, "not enough memory");
    return static_cast<int>(ExitCode::fault);
  } catch (const std::exception& error) {
    report(verb, std::string("internal error of the program: ") + error.what());
    return static_cast<int>(ExitCode::fault);
  }
}

#include <algorithm>
#include <condition_variable>
#include <filesystem>
#include <fstream>
#include <mutex>

#include "cli/stop_signals.hpp"
#include "cli/verbs.hpp"
#include "panonav/storage/memory_address.hpp"
#include "panonav/storage/memory_scheme.hpp"
#include "panonav_server/localisation_server.hpp"
#include "runs/listening_address.hpp"

namespace panonav::command {

namespace {

struct ServeArguments {
  std::vector<std::string> memories;
  std::string listen = "8080";
  std::optional<std::string> token_file;
  int max_waiting = 64;
  int max_held_views = 200000;
  LocaliserOptions localiser;
};

/// Parses "office=/data/monday.panonav". Without a name, the memory gets the name of its file.
server::ServedMemory parse_served_memory(const std::string& text) {
  const std::size_t equals = text.find('=');
  const bool named = equals != std::string::npos && text.find('/') > equals;
  if (named) return {text.substr(0, equals), text.substr(equals + 1)};
  return {std::filesystem::path(memory_name(text)).stem().string(), text};
}

/// Returns the first line of the file. Throws FileError unless it is a valid token.
std::string read_token(const std::string& path) {
  std::ifstream file(path);
  if (!file) throw FileError(path, "no such file, or it cannot be opened");
  std::string token(1026, '\0');
  file.read(token.data(), static_cast<std::streamsize>(token.size()));
  if (file.bad() || (file.fail() && !file.eof())) throw FileError(path, "it cannot be read");
  token.resize(static_cast<std::size_t>(file.gcount()));
  token.resize(std::min(token.find_first_of("\r\n"), token.size()));
  const bool fits = token.size() >= 16 && token.size() <= 1024 &&
                    std::ranges::all_of(token, [](char c) { return c > ' ' && c <= '~'; });
  if (!fits) {
    throw FileError(path,
                    "its first line is not a valid token; allowed: 16 to 1024 visible ASCII "
                    "characters without spaces");
  }
  return token;
}

ExitCode serve(const Arguments& declared, const ServeArguments& arguments, Session& session) {
  std::mutex mutex;
  std::condition_variable stop_requested;
  bool stopped = false;
  const StopSignals signals([&] {
    const std::lock_guard lock(mutex);
    stopped = true;
    stop_requested.notify_all();
  });
  const ListeningAddress listening = parse_listening_address("--listen", arguments.listen);
  server::LocalisationServerOptions options;
  options.address = listening.address;
  options.port = listening.port;
  options.threads = session.executor().threads();
  options.max_waiting = static_cast<std::size_t>(arguments.max_waiting);
  options.max_held_views = static_cast<std::size_t>(arguments.max_held_views);
  if (arguments.token_file) options.token = read_token(*arguments.token_file);
  options.localiser = arguments.localiser;
  options.note = [&](const std::string& line) { session.note(line); };
  std::vector<server::ServedMemory> memories;
  for (const std::string& memory : arguments.memories)
    memories.push_back(parse_served_memory(memory));
  if (std::ranges::none_of(memories, is_server_address, &server::ServedMemory::path)) {
    declared.reject_options({"--max-held-views"}, "if all memories are files");
  }
  if (!listening.is_local() && options.token.empty()) {
    session.note("warning: everybody who can reach " + listening.address +
                 " gets answers and can see thumbnails; with --token-file FILE only clients with a "
                 "token get answers");
  }
  set_reply_timeout(std::chrono::seconds(5));  // the default is too long, as clients wait
  const server::LocalisationServer server(memories, options);
  std::unique_lock lock(mutex);
  if (session.json()) {
    session.print(json_line({{"url", server.url()}}));
  } else {
    session.print(session.bold("serving at " + server.url()) + "; Ctrl-C ends it");
    session.suggest({"curl", "--data-binary", "@view.jpg",
                     server.url() + "/v1/memories/" + memories.front().name + "/localise"},
                    "Try:");
  }
  session.flush();
  stop_requested.wait(lock, [&] { return stopped; });
  set_reply_timeout(std::chrono::seconds(2));
  return ExitCode::done;
}

Run declare_serve(Arguments& arguments) {
  auto values = std::make_shared<ServeArguments>();
  arguments.positionals(
      "MEMORY", values->memories,
      "Memory files, or addresses of memories on a PostgreSQL server. Clients use the file name of "
      "a memory without .panonav; NAME=FILE sets another name");
  arguments.option("--listen PORT", values->listen,
                   "Port for programs on this computer (0: any free port); with ADDRESS:PORT, "
                   "other computers in this network can also connect");
  arguments.option(
      "--token-file FILE", values->token_file,
      "Answer only clients that send the first line of this file as bearer token, or as "
      "password in a browser");
  arguments.option("--max-waiting", values->max_waiting, 1,
                   "Largest number of images that wait for an answer; more images are "
                   "answered with status 503 (retry later)");
  arguments.option("--max-held-views", values->max_held_views, 0,
                   "Load a memory from a PostgreSQL server completely if it has at most this "
                   "number of views (2700 bytes per view); larger memories need only 350 bytes per "
                   "view, but more time per image (docs/scale.md)");
  arguments.options("localiser", values->localiser);
  arguments.show_in_help({"--top"});
  return [values, &arguments](Session& session) { return serve(arguments, *values, session); };
}

}  // namespace

Verb serve_verb() {
  return {
      "serve",
      VerbGroup::localisation,
      "Run an HTTP server that localises robots from images",
      "A browser that opens the address shows a page where you can choose or photograph an image. "
      "Other clients send a PNG or JPEG image with POST to /v1/memories/NAME/localise and receive "
      "the same JSON as panonav localise --json prints. GET /v1/memories lists the memories. "
      "GET /health reports whether the server is ready. GET /metrics returns metrics for "
      "Prometheus. If the file of a memory changes, the server loads it again. The server does "
      "not use encryption. If other computers can reach the server, put a proxy with "
      "encryption in front of it.",
      "  panonav serve office.panonav\n"
      "  panonav serve office.panonav hall=monday.panonav --listen 8090\n"
      "  panonav serve office.panonav --listen 0.0.0.0:8080 --token-file token.txt",
      declare_serve};
}

}  // namespace panonav::command

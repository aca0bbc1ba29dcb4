#include <sysexits.h>

#include <CLI/CLI.hpp>
#include <chrono>
#include <csignal>
#include <cstdint>
#include <cstdio>
#include <limits>
#include <optional>

#include "cli/watch/feed_socket.h"
#include "cli/watch/terminal.h"
#include "cli/watch/watcher.h"
#include "runtime/process/command_line.h"

namespace {

using namespace airworthy::watch;

volatile std::sig_atomic_t stopped = 0;

void print(std::FILE* stream, const std::vector<std::string>& lines) {
  for (const std::string& line : lines) std::fprintf(stream, "%s\n", line.c_str());
  if (!lines.empty()) std::fflush(stream);
}

int run(const WatchOptions& options, FeedSocket& socket) {
  using Clock = std::chrono::steady_clock;
  constexpr std::chrono::milliseconds kLookUp{100};
  std::optional<Terminal> terminal;
  if (!options.json && Terminal::is_there()) terminal.emplace();
  Watcher watcher{options, Clock::now()};
  const auto show = [&](std::FILE* stream, const std::vector<std::string>& lines) {
    if (!terminal) print(stream, lines);
  };
  // With --json standard output holds messages only; what is said about them goes to standard error.
  std::FILE* const remarks = options.json ? stderr : stdout;
  while (stopped == 0 && !watcher.has_enough() && !watcher.has_waited_enough(Clock::now())) {
    if (const auto message = socket.receive(kLookUp)) {
      if (*message) {
        show(stdout, watcher.add(**message, Clock::now()));
      } else {
        show(remarks, watcher.refuse(message->error().text));
      }
    }
    show(remarks, watcher.check(Clock::now()));
    if (terminal) {
      const Terminal::Size size = Terminal::size();
      terminal->draw(screen(watcher.health(), watcher.feed(), size.columns, size.rows, true));
    }
  }
  if (stopped != 0 || watcher.has_enough()) return EX_OK;
  terminal.reset();
  const bool fell_short = options.count > 0 || watcher.feed().messages == 0;
  if (!fell_short) return EX_OK;
  std::fprintf(stderr, "airworthy watch: %lld messages from %s in %g s\n",
               static_cast<long long>(watcher.feed().messages), options.endpoint.c_str(), options.timeout_s);
  return EX_UNAVAILABLE;
}

}  // namespace

int main(int argc, char** argv) {
  WatchOptions options;
  CLI::App app{
      "Shows the health of a vehicle live, from its gateway's feed: a picture on a terminal, else one line "
      "per change.\n"
      "Exit code 0: ended by a signal, --count or --timeout; 69: fewer messages than --count, or none, "
      "within --timeout;"
      " 64: wrong arguments.",
      "airworthy watch"};
  app.set_version_flag("--version", AIRWORTHY_VERSION);
  app.add_option("endpoint", options.endpoint, "feed.endpoint of the gateway; default " + options.endpoint)
      ->type_name("ENDPOINT");
  app.add_flag("--json", options.json, "print every message as one line of JSON");
  app.add_option("--count", options.count, "end after so many messages")
      ->type_name("N")
      ->check(airworthy::rt::is_whole_number(1, std::numeric_limits<std::int64_t>::max()));
  app.add_option("--timeout", options.timeout_s, "end after so many seconds")
      ->type_name("S")
      ->check(airworthy::rt::is_number(airworthy::rt::Range{0.0, 1e9}.without_min()));
  if (const auto ended = airworthy::rt::parse_command_line(app, argc, argv)) return *ended;
  struct sigaction action {};
  action.sa_handler = [](int) { stopped = 1; };  // without SA_RESTART: a waiting receive returns
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  auto socket = FeedSocket::open(options.endpoint);
  if (!socket) {
    std::fprintf(stderr, "airworthy watch: %s\n", socket.error().text.c_str());
    return EX_USAGE;
  }
  return run(options, **socket);
}

// strata-mpi: `strata voxelize` by the ranks of an MPI job, on one machine or on many.

#include <sched.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <string_view>
#include <variant>

#include "apps/commands/command_words.h"
#include "apps/commands/commands.h"
#include "apps/commands/file_uses.h"
#include "apps/mpi/peers.h"
#include "apps/mpi/rank_part.h"
#include "apps/session/process_memory.h"
#include "apps/session/session.h"
#include "apps/voxelize/voxelize_run.h"
#include "core/atomic_file.h"

namespace strata::apps {
namespace {

/// Processors for each rank: those that it is bound to, or its part of the machine's.
int threads_for_rank(const Peers& peers) {
  const auto online = static_cast<int>(sysconf(_SC_NPROCESSORS_ONLN));
  cpu_set_t bound;
  CPU_ZERO(&bound);
  const int mine = sched_getaffinity(0, sizeof bound, &bound) == 0 ? CPU_COUNT(&bound) : online;
  if (!peers.threads_may_call()) return 1;
  return std::max(1, mine < online ? mine : online / peers.on_this_machine());
}

/// The sentence for options that ranks cannot share, or none.
const char* mpi_mistake(const VoxelizeCommand& command) {
  return command.sdf            ? "--sdf cannot be made by several ranks: distances reach from one "
                                  "part of the grid into others"
         : command.colours      ? "--colours cannot be made by several ranks"
         : command.levels != 1  ? "--levels cannot be made by several ranks: coarse voxels reach "
                                  "from one part of the grid into others"
         : command.show         ? "--show cannot be combined with ranks"
         : command.dry_run      ? "--dry-run is for one process: strata voxelize --dry-run"
         : command.list_formats ? "--list-formats is for one process: strata voxelize "
                                  "--list-formats"
         : command.shard        ? "--shard cannot be combined with ranks, which share the grid"
         : command.backend == Backend::kGl ? "--backend gl cannot be combined with ranks"
                                           : nullptr;
}

Result<void> run_rank(VoxelizeCommand& command, RankPart& part, Session& session) {
  try {
    if (const char* mistake = mpi_mistake(command)) return fail(ErrorCode::kUsage, "{}", mistake);
    const std::vector<FileUse> written = outputs_of(command);
    if (auto kept = check_files(inputs_of(command), written); !kept) return kept;
    session.set_outputs(written, true);
    if (auto done = run_voxelize_part(command, part, session); !done) return done;
    return session.commit_outputs();
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "out of memory");
  } catch (const std::exception& failure) {
    return fail(ErrorCode::kInternal, "internal error: {}", failure.what());
  }
}

/// The command as one rank does it. @return the exit code
int run_command(VoxelizeCommand command, Peers& peers, Session::Clock::time_point start) {
  const bool first = peers.rank() == 0;
  command.backend = Backend::kCpu == command.backend || Backend::kAuto == command.backend
                        ? Backend::kCpu
                        : command.backend;
  if (command.common.threads == 0) command.common.threads = threads_for_rank(peers);
  if (command.common.memory_limit == 0) {
    command.common.memory_limit =
        usable_memory_bytes() / 4 * 3 / static_cast<std::uint64_t>(peers.on_this_machine());
  }
  if (!first) {
    command.common.quiet = true;
    command.json.reset();
  }
  Session session(start);
  session.configure(command.common);
  peers.set_stopped([&session] { return session.interrupted() && !session.timed_out(); });
  RankPart part(peers, session);
  Result<void> result = run_rank(command, part, session);
  session.end_progress();
  if (session.interrupted() && !session.timed_out()) {
    if (first) session.complain({ErrorCode::kCancelled, {}});
    peers.leave();
  }
  // Those that are ready wait here for those that are not.
  if (!part.failed_together()) result = part.agree(result);
  peers.set_stopped({});
  if (result) return 0;
  if (first) session.complain(result.error());
  return static_cast<int>(session.timed_out() ? ErrorCode::kLimit : result.error().code);
}

int mpi_main(int argc, char** argv) {
  const auto start = Session::Clock::now();
  auto peers = Peers::join(&argc, &argv);
  if (!peers) {
    std::fprintf(stderr, "strata-mpi: error: %s\n", peers.error().message.c_str());
    return static_cast<int>(peers.error().code);
  }
  const bool first = peers->rank() == 0;
  const std::string_view name = argc > 1 ? argv[1] : "";
  const auto tell = [&](bool error, const std::string& text) {
    if (first) (void)write_text(error ? STDERR_FILENO : STDOUT_FILENO, text, "the terminal");
    return error ? static_cast<int>(ErrorCode::kUsage) : 0;
  };
  if (name == "-h" || name == "--help" || name == "help") return tell(false, kRanksHelp);
  if (name == "-V" || name == "--version") return tell(false, "strata-mpi " STRATA_VERSION "\n");
  if (name != "voxelize") {
    return tell(true, name.empty() ? kRanksHelp
                                   : "strata: error: strata-mpi runs voxelize alone, got " +
                                         std::string(name) + "\n");
  }
  Command command = parse_command_line(argc, argv);
  if (const auto* outcome = std::get_if<ParseOutcome>(&command)) {
    tell(outcome->to_stderr, outcome->text);
    return outcome->exit_code;
  }
  return run_command(std::get<VoxelizeCommand>(std::move(command)), *peers, start);
}

}  // namespace
}  // namespace strata::apps

int main(int argc, char** argv) { return strata::apps::mpi_main(argc, argv); }

// strata: the command-line tool. Results go to standard output, talk to standard error; the exit
// codes are those of ErrorCode.

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <new>
#include <stdexcept>
#include <string_view>
#include <system_error>
#include <type_traits>
#include <variant>

#include <fcntl.h>
#include <poll.h>
#include <unistd.h>

#include "apps/commands/file_uses.h"
#include "apps/session/file_conflicts.h"
#include "apps/session/session.h"
#include "apps/strata/allocation_failures.h"
#include "apps/strata/run_commands.h"
#include "core/atomic_file.h"

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define STRATA_ORDERLY_EXIT 1  // so that leaks and races are reported
#elif defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define STRATA_ORDERLY_EXIT 1
#endif
#endif

namespace strata::apps {
namespace {

/// True if a thread could not be started: oneTBB reports that in words only.
bool is_refused_thread(const std::runtime_error& failure) {
  return std::string_view(failure.what()).find("pthread_create") != std::string_view::npos;
}

/// Where no catch clause can reach, such as in another library's thread: a sentence and a code all
/// the same.
[[noreturn]] void on_terminate() {
  int code = static_cast<int>(ErrorCode::kInternal);
  const char* what = "an unknown exception";
  try {
    if (const auto failure = std::current_exception()) std::rethrow_exception(failure);
  } catch (const std::bad_alloc&) {
    code = static_cast<int>(ErrorCode::kLimit);
    what = kNoMemory;
  } catch (const std::system_error& failure) {  // threads that cannot be started, above all
    code = static_cast<int>(ErrorCode::kLimit);
    what = failure.what();
  } catch (const std::runtime_error& failure) {  // a thread of oneTBB starts others
    if (is_refused_thread(failure)) code = static_cast<int>(ErrorCode::kLimit);
    what = failure.what();
  } catch (const std::exception& failure) {
    what = failure.what();
  } catch (...) {
  }
  std::fprintf(stderr, "strata: error: %s\n", what);
  remove_temporary_files();
  std::_Exit(code);
}

/// Whether standard output is a pipe that nobody reads any more: `strata ... -o - | head`.
bool is_left_alone(const Error& error) {
  if (error.code != ErrorCode::kOutput || !error.message.starts_with("standard output")) {
    return false;
  }
  pollfd out{STDOUT_FILENO, POLLOUT, 0};
  return poll(&out, 1, 0) > 0 && (out.revents & POLLERR) != 0;
}

int exit_code(const Result<void>& result, Session& session) {
  if (result) return 0;
  if (is_left_alone(result.error())) return 128 + SIGPIPE;
  // Whatever an interrupted job ran into, the interrupt is why.
  const ErrorCode code = session.timed_out()     ? ErrorCode::kLimit
                         : session.interrupted() ? ErrorCode::kCancelled
                                                 : result.error().code;
  session.complain({code, result.error().message});
  return static_cast<int>(code);
}

Result<void> run_command(const VoxelizeCommand& command, Session& session) {
  return run_voxelize(command, session);
}
Result<void> run_command(const MergeCommand& command, Session& session) {
  return run_merge(command, session);
}
Result<void> run_command(const MeshCommand& command, Session& session) {
  return run_mesh(command, session);
}
Result<void> run_command(const InfoCommand& command, Session& session) {
  return run_info(command, session);
}
Result<void> run_command(const LdiCommand& command, Session& session) {
  return run_ldi(command, session);
}
Result<void> run_command(const CsgCommand& command, Session& session) {
  return run_csg(command, session);
}
Result<void> run_command(const PictureCommand& command, Session& session) {
  return command.voxels ? run_picture(command, session) : run_csg(command, session);
}
Result<void> run_command(const OitCommand& command, Session& session) {
  return run_oit(command, session);
}

template <class AnyCommand>
Result<void> run(const AnyCommand& command, Session& session) {
  try {
    session.configure(command.common);
    const std::vector<FileUse> written = outputs_of(command);
    const std::vector<FileUse> read = inputs_of(command);
    if (auto kept = check_files(read, written); !kept) return kept;
    if constexpr (!std::is_same_v<AnyCommand, MergeCommand>) {
      if (auto readable = check_no_shard(read); !readable) return readable;
    }
    session.set_outputs(written, true);
    if (auto done = run_command(command, session); !done) return done;
    return commit_outputs(session);
  } catch (const std::bad_alloc&) {
    return fail(ErrorCode::kLimit, "{}", kNoMemory);
  } catch (const std::system_error& failure) {
    // Threads that cannot be started, above all.
    return fail(ErrorCode::kLimit, "the system refused: {}", failure.what());
  } catch (const std::runtime_error& failure) {
    if (is_refused_thread(failure)) {
      return fail(ErrorCode::kLimit, "no thread can be started: {}", failure.what());
    }
    return fail(ErrorCode::kInternal, "internal error: {}", failure.what());
  } catch (const std::exception& failure) {
    return fail(ErrorCode::kInternal, "internal error: {}", failure.what());
  }
}

/// A standard stream that is closed would be the number of the next file that is opened. What
/// stands there instead refuses to be read, or to be written.
void hold_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    if (fcntl(stream, F_GETFD) >= 0 || errno != EBADF) continue;
    const int held = open("/dev/null", stream == STDIN_FILENO ? O_WRONLY : O_RDONLY);
    if (held >= 0 && held != stream) close(held);
  }
}

int strata_main(int argc, char** argv) {
  const auto start = Session::Clock::now();
  std::set_terminate(on_terminate);
  hold_standard_streams();
  if (argc > 1 && std::string_view(argv[1]) == "view") return run_view_program(argv + 2);
  const Command command = parse_command_line(argc, argv);
  if (const auto* outcome = std::get_if<ParseOutcome>(&command)) {
    const bool shown = write_text(outcome->to_stderr ? STDERR_FILENO : STDOUT_FILENO, outcome->text,
                                  "standard output")
                           .has_value();
    return shown || outcome->exit_code != 0 ? outcome->exit_code
                                            : static_cast<int>(ErrorCode::kOutput);
  }
  Session session(start);
  Result<void> result;
  if (const auto* voxelize = std::get_if<VoxelizeCommand>(&command)) {
    result = run(*voxelize, session);
  } else if (const auto* merge = std::get_if<MergeCommand>(&command)) {
    result = run(*merge, session);
  } else if (const auto* mesh = std::get_if<MeshCommand>(&command)) {
    result = run(*mesh, session);
  } else if (const auto* info = std::get_if<InfoCommand>(&command)) {
    result = run(*info, session);
  } else if (const auto* ldi = std::get_if<LdiCommand>(&command)) {
    result = run(*ldi, session);
  } else if (const auto* csg = std::get_if<CsgCommand>(&command)) {
    result = run(*csg, session);
  } else if (const auto* picture = std::get_if<PictureCommand>(&command)) {
    result = run(*picture, session);
  } else if (const auto* oit = std::get_if<OitCommand>(&command)) {
    result = run(*oit, session);
  }
  session.end_progress();
  const int code = exit_code(result, session);
#ifndef STRATA_ORDERLY_EXIT
  if (code != 0) remove_temporary_files();  // those that wait for others
  // All files are committed. Giving memory and threads back one by one would only take time.
  std::_Exit(code);
#endif
  return code;
}

}  // namespace
}  // namespace strata::apps

int main(int argc, char** argv) {
  try {
    return strata::apps::strata_main(argc, argv);
  } catch (const std::bad_alloc&) {
    std::fprintf(stderr, "strata: error: out of memory\n");
    return static_cast<int>(strata::ErrorCode::kLimit);
  } catch (const std::system_error& failure) {  // threads that cannot be started, above all
    std::fprintf(stderr, "strata: error: the system refused: %s\n", failure.what());
    return static_cast<int>(strata::ErrorCode::kLimit);
  } catch (const std::exception& failure) {
    std::fprintf(stderr, "strata: error: %s\n", failure.what());
    return static_cast<int>(strata::ErrorCode::kInternal);
  }
}

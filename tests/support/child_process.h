#pragma once

#include <sys/wait.h>
#include <unistd.h>

namespace strata::testkit {

/// Runs `body` in a child process, so that limits, users, signals and closed streams stay there.
/// @return the child's exit status, or 128 + the signal that ended it
template <class Body>
int in_child(Body body) {
  const pid_t child = fork();
  if (child == 0) _exit(body());
  int status = 0;
  waitpid(child, &status, 0);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace strata::testkit

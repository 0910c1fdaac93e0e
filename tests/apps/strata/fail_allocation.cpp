// A library to preload: one allocation of the program fails, or all from one on. For the tests.
//
// STRATA_FAIL_ALLOCATION=N   the N-th allocation after main() began gives nothing, counted from 1
// STRATA_FAIL_REST=1         so do all that follow it
// STRATA_MOST_THREADS=N      no more than N threads are started besides the first
// STRATA_COUNT_ALLOCATIONS=F the number of allocations is written to the file F when the program
//                            ends
//
// The tool defines malloc() itself, on top of glibc's second names for its functions: these are
// what is replaced here.

#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdio>
#include <cstdlib>
#include <cstring>

namespace {

std::atomic<bool> began{false};
std::atomic<long> count{0};
std::atomic<long> threads{0};
long failing = 0;
bool rest = false;
int (*real_main)(int, char**, char**) = nullptr;

template <class Function>
Function next(const char* name) {
  return reinterpret_cast<Function>(dlsym(RTLD_NEXT, name));
}

// Looking a function up may itself allocate: that comes from here, and is never given back.
alignas(64) char early[1 << 16];
std::size_t early_used = 0;
bool looking_up = false;

void* early_block(std::size_t size) {
  void* const block = early + early_used;
  early_used += (size + 63) / 64 * 64;
  if (early_used > sizeof early) _exit(99);
  return block;
}

struct Functions {
  void* (*malloc)(std::size_t);
  void* (*calloc)(std::size_t, std::size_t);
  void* (*realloc)(void*, std::size_t);
  void* (*memalign)(std::size_t, std::size_t);
};

const Functions* functions() {
  static Functions found{};
  static bool ready = false;
  if (ready) return &found;
  if (looking_up) return nullptr;
  looking_up = true;
  found = {next<void* (*)(std::size_t)>("__libc_malloc"),
           next<void* (*)(std::size_t, std::size_t)>("__libc_calloc"),
           next<void* (*)(void*, std::size_t)>("__libc_realloc"),
           next<void* (*)(std::size_t, std::size_t)>("__libc_memalign")};
  looking_up = false;
  ready = true;
  return &found;
}

bool fails() {
  if (!began.load(std::memory_order_relaxed)) return false;
  const long number = count.fetch_add(1, std::memory_order_relaxed) + 1;
  const bool failed = failing > 0 && (rest ? number >= failing : number == failing);
  if (failed) errno = ENOMEM;
  return failed;
}

int main_with_failures(int argc, char** argv, char** environment) {
  if (const char* const text = std::getenv("STRATA_FAIL_ALLOCATION")) failing = std::atol(text);
  rest = std::getenv("STRATA_FAIL_REST") != nullptr;
  began = true;
  return real_main(argc, argv, environment);
}

void tell_count() {
  const char* const path = std::getenv("STRATA_COUNT_ALLOCATIONS");
  if (path == nullptr) return;
  const int file = ::open(path, O_WRONLY | O_CREAT | O_TRUNC, 0600);
  if (file < 0) return;
  ::dprintf(file, "%ld", count.load());
  ::close(file);
}

}  // namespace

extern "C" {

void* __libc_malloc(std::size_t size) {
  if (fails()) return nullptr;
  const Functions* const real = functions();
  return real != nullptr ? real->malloc(size) : early_block(size);
}
void* __libc_calloc(std::size_t number, std::size_t size) {
  if (fails()) return nullptr;
  const Functions* const real = functions();
  return real != nullptr ? real->calloc(number, size) : early_block(number * size);
}
void* __libc_realloc(void* old, std::size_t size) {
  if (fails()) return nullptr;
  return functions()->realloc(old, size);
}
void* __libc_memalign(std::size_t alignment, std::size_t size) {
  if (fails()) return nullptr;
  return functions()->memalign(alignment, size);
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*body)(void*),
                   void* argument) {
  const char* const most = std::getenv("STRATA_MOST_THREADS");
  if (most != nullptr && threads.fetch_add(1) >= std::atol(most)) return EAGAIN;
  return next<decltype(&pthread_create)>("pthread_create")(thread, attributes, body, argument);
}

/// The tool ends by _Exit, which calls no handler.
void _exit(int code) {
  tell_count();
  next<void (*)(int)>("_exit")(code);
  __builtin_unreachable();
}
void _Exit(int code) { _exit(code); }

int __libc_start_main(int (*main_function)(int, char**, char**), int argc, char** argv,
                      void (*init)(), void (*fini)(), void (*loader_fini)(), void* stack_end) {
  real_main = main_function;
  using Start =
      int (*)(int (*)(int, char**, char**), int, char**, void (*)(), void (*)(), void (*)(), void*);
  return next<Start>("__libc_start_main")(main_with_failures, argc, argv, init, fini, loader_fini,
                                          stack_end);
}

}  // extern "C"

// What happens in the tool when memory runs out. Libraries swallow it: Clipper returns no polygons,
// fontconfig crashes, others leave out what they could not hold, and the picture is another one.
// So the executable defines the allocation functions for all of the process:
//   - C's (malloc and its like), which libraries in C call: the program ends at once, with a
//     sentence, exit code 6 and no temporary files. Nothing of ours calls them.
//   - C++'s (operator new): std::bad_alloc as ever, whose catch clauses have better sentences, and
//     allocation_has_failed() remembers it.
#include "apps/strata/allocation_failures.h"

#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdlib>
#include <cstring>
#include <new>

#include "core/atomic_file.h"
#include "strata/core/result.h"

namespace {
std::atomic<bool> has_failed{false};
}  // namespace

namespace strata::apps {
bool allocation_has_failed() noexcept { return has_failed.load(std::memory_order_relaxed); }

Result<void> commit_outputs(Session& session) {
  if (allocation_has_failed()) return fail(ErrorCode::kLimit, "{}", kNoMemory);
  return session.commit_outputs();
}
}  // namespace strata::apps

#if defined(__has_feature)
#if __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
#define STRATA_SANITIZER_ALLOCATES 1
#endif
#endif
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
#define STRATA_SANITIZER_ALLOCATES 1
#endif

// Other C libraries do not give their own functions a second name.
#if defined(__GLIBC__) && !defined(STRATA_SANITIZER_ALLOCATES)

extern "C" {
void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
}

namespace {

/// Any thread may be here, with any lock held: system calls only.
[[noreturn]] void end_without_memory() noexcept {
  constexpr char kBegin[] = "strata: error: ";
  (void)!write(STDERR_FILENO, kBegin, sizeof kBegin - 1);
  (void)!write(STDERR_FILENO, strata::apps::kNoMemory, std::strlen(strata::apps::kNoMemory));
  (void)!write(STDERR_FILENO, "\n", 1);
  strata::remove_temporary_files();
  _exit(static_cast<int>(strata::ErrorCode::kLimit));
}

void* kept(void* block) noexcept {
  if (block == nullptr) end_without_memory();
  return block;
}

void* thrown_if_none(void* block) {
  if (block != nullptr) return block;
  has_failed.store(true, std::memory_order_relaxed);
  throw std::bad_alloc();
}

}  // namespace

extern "C" {

void* malloc(std::size_t size) { return kept(__libc_malloc(size)); }
void* calloc(std::size_t count, std::size_t size) { return kept(__libc_calloc(count, size)); }
void* realloc(void* block, std::size_t size) {
  void* const moved = __libc_realloc(block, size);
  return size == 0 ? moved : kept(moved);  // of no bytes: the block is freed
}
void* memalign(std::size_t alignment, std::size_t size) {
  return kept(__libc_memalign(alignment, size));
}
void* aligned_alloc(std::size_t alignment, std::size_t size) { return memalign(alignment, size); }
int posix_memalign(void** block, std::size_t alignment, std::size_t size) {
  if (alignment % sizeof(void*) != 0 || (alignment & (alignment - 1)) != 0) return EINVAL;
  *block = memalign(alignment, size);
  return 0;
}

}  // extern "C"

// The other forms of the standard library call these.
void* operator new(std::size_t size) { return thrown_if_none(__libc_malloc(size)); }
void* operator new(std::size_t size, std::align_val_t alignment) {
  return thrown_if_none(__libc_memalign(static_cast<std::size_t>(alignment), size));
}
void operator delete(void* block) noexcept { std::free(block); }
void operator delete(void* block, std::size_t) noexcept { std::free(block); }
void operator delete(void* block, std::align_val_t) noexcept { std::free(block); }
void operator delete(void* block, std::size_t, std::align_val_t) noexcept { std::free(block); }

#endif

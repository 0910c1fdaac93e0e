// Opens a shared library when one of its functions is called first (opened_library.h says how a
// call comes here).

#include "apps/strata/opened_library.h"

#include <dlfcn.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cerrno>
#include <cstdint>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <mutex>
#include <string_view>

#include "core/atomic_file.h"
#include "strata/core/result.h"

namespace strata::apps {
namespace {

/// A field of a record in read-only memory: how far what it means lies from the field.
struct Offset {
  std::int32_t distance;
  [[nodiscard]] char* target() const {
    return const_cast<char*>(reinterpret_cast<const char*>(this)) + distance;
  }
};

struct LibraryRecord {
  Offset copies_begin, copies_end;
  [[nodiscard]] const char* soname() const { return reinterpret_cast<const char*>(this + 1); }
};

struct CallRecord {
  Offset slot, library;
  [[nodiscard]] const char* name() const { return reinterpret_cast<const char*>(this + 1); }
};

struct CopyRecord {
  Offset target;
  std::uint32_t size, read_only;
  [[nodiscard]] const char* name() const { return reinterpret_cast<const char*>(this + 1); }
};

/// The caller expects a function of the library, and no error can be given to it.
[[noreturn]] void give_up(std::string_view what, bool memory) {
  std::fprintf(stderr, "strata: error: a library that this job needs cannot be opened: %.*s\n",
               static_cast<int>(what.size()), what.data());
  remove_temporary_files();
  std::_Exit(static_cast<int>(memory ? ErrorCode::kLimit : ErrorCode::kInternal));
}

/// For the reason that dlerror() tells: file, what failed, error of the system. Nothing else tells
/// of memory that has run out.
[[noreturn]] void give_up_opening() {
  const char* const text = dlerror();
  const std::string_view what = text == nullptr ? "no reason is known" : text;
  give_up(what, what.ends_with(std::strerror(ENOMEM)) || what.ends_with("out of memory") ||
                    what.ends_with("cannot allocate memory in static TLS block") ||
                    what.ends_with("failed to map segment from shared object"));
}

/// Writes into memory that is read-only but for this moment.
void write_protected(char* target, const void* source, std::size_t size) {
  const auto page = static_cast<std::uintptr_t>(sysconf(_SC_PAGESIZE));
  const auto first = reinterpret_cast<std::uintptr_t>(target) & ~(page - 1);
  const std::size_t length = reinterpret_cast<std::uintptr_t>(target) + size - first;
  if (mprotect(reinterpret_cast<void*>(first), length, PROT_READ | PROT_WRITE) != 0) {
    give_up("memory cannot be made writable", errno == ENOMEM);
  }
  if (size == sizeof(void*)) {  // other threads read slots
    void* value = nullptr;
    std::memcpy(&value, source, size);
    std::atomic_ref(*reinterpret_cast<void**>(target)).store(value, std::memory_order_release);
  } else {
    std::memcpy(target, source, size);
  }
  mprotect(reinterpret_cast<void*>(first), length, PROT_READ);
}

void* address_in(void* opened, const char* name) {
  void* address = dlsym(opened, name);
  if (address == nullptr) give_up_opening();
  return address;
}

void copy_tables(const LibraryRecord& library, void* opened) {
  const char* const end = library.copies_end.target();
  for (const char* at = library.copies_begin.target(); at < end;) {
    CopyRecord copy;
    std::memcpy(&copy, at, sizeof(copy));
    char* const target = reinterpret_cast<const Offset*>(at)->target();
    const char* const name = at + sizeof(copy);
    const void* const source = address_in(opened, name);
    if (copy.read_only != 0) {
      write_protected(target, source, copy.size);
    } else {
      std::memcpy(target, source, copy.size);
    }
    at = name + std::strlen(name) + 1;
  }
}

/// Where the function of a call is, or the variable; from now on the slot says so too.
void* open_function(const CallRecord& call) {
  static std::mutex mutex;
  static std::array<const LibraryRecord*, 64> known{};
  static std::size_t known_count = 0;
  const std::lock_guard lock(mutex);
  const auto& library = *reinterpret_cast<const LibraryRecord*>(call.library.target());
  void* const opened = dlopen(library.soname(), RTLD_LAZY | RTLD_LOCAL);  // counted, never closed
  if (opened == nullptr) give_up_opening();
  const auto known_end = known.begin() + static_cast<std::ptrdiff_t>(known_count);
  if (std::find(known.begin(), known_end, &library) == known_end) {
    copy_tables(library, opened);
    if (known_count < known.size()) known[known_count++] = &library;
  }
  void* const address = address_in(opened, call.name());
  write_protected(call.slot.target(), &address, sizeof(address));
  return address;
}

}  // namespace
}  // namespace strata::apps

extern "C" {
/// Called by strata_open_call and strata_open_pointer below alone.
[[gnu::used]] void* strata_find_opened(const void* call) {
  return strata::apps::open_function(*static_cast<const strata::apps::CallRecord*>(call));
}
}

// r11 has the call's record. At the entry of a function rsp + 8 is a multiple of 16.
#define STRATA_FIND_AND_JUMP(name, jump)                                          \
  asm(".text\n.globl " name "\n.hidden " name "\n.type " name ",@function\n" name \
      ":\n .cfi_startproc\n"                                                      \
      " pushq %rdi\n pushq %rsi\n pushq %rdx\n pushq %rcx\n"                      \
      " pushq %r8\n pushq %r9\n pushq %rax\n pushq %r10\n"                        \
      " subq $136,%rsp\n .cfi_def_cfa_offset 208\n"                               \
      " movaps %xmm0,(%rsp)\n movaps %xmm1,16(%rsp)\n movaps %xmm2,32(%rsp)\n"    \
      " movaps %xmm3,48(%rsp)\n movaps %xmm4,64(%rsp)\n movaps %xmm5,80(%rsp)\n"  \
      " movaps %xmm6,96(%rsp)\n movaps %xmm7,112(%rsp)\n"                         \
      " movq %r11,%rdi\n call strata_find_opened\n movq %rax,%r11\n"              \
      " movaps (%rsp),%xmm0\n movaps 16(%rsp),%xmm1\n movaps 32(%rsp),%xmm2\n"    \
      " movaps 48(%rsp),%xmm3\n movaps 64(%rsp),%xmm4\n movaps 80(%rsp),%xmm5\n"  \
      " movaps 96(%rsp),%xmm6\n movaps 112(%rsp),%xmm7\n"                         \
      " addq $136,%rsp\n"                                                         \
      " popq %r10\n popq %rax\n popq %r9\n popq %r8\n"                            \
      " popq %rcx\n popq %rdx\n popq %rsi\n popq %rdi\n .cfi_def_cfa_offset 8\n"  \
      " jmp " jump "\n .cfi_endproc\n.size " name ",.-" name "\n");
STRATA_FIND_AND_JUMP("strata_open_call", "*%r11")
STRATA_FIND_AND_JUMP("strata_open_pointer", "*(%r11)")

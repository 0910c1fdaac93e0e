#pragma once

// What cmake/StrataOpenOnCall.cmake writes sources of: functions of the names of a shared library's
// own, which open the library when they are called first, and jump on. x86-64, ELF, GNU as.
//
// A call reads a slot, in memory that the dynamic linker makes read-only before main() (RELRO), and
// jumps to what the slot holds. While it holds nothing, strata_open_call() asks opened_library.cpp,
// with all registers that may hold arguments kept. What nothing calls leaves the program
// (--gc-sections).

// clang-format off
#define STRATA_OPENED_SECTION(name, flags) ".section " name ",\"" flags "\",@progbits\n"

// Library: [copies_begin:i32 | copies_end:i32 | soname], both offsets from where they stand.
#define STRATA_OPENED_LIBRARY(soname)                                             \
  asm(STRATA_OPENED_SECTION(".rodata.strata_opened", "a") ".balign 4\n"           \
      ".Llibrary: .long .Lcopies_begin - .\n .long .Lcopies_end - .\n"            \
      " .asciz \"" soname "\"\n"                                                  \
      STRATA_OPENED_SECTION(".rodata.strata_copies", "a") ".Lcopies_begin:\n"     \
      ".text\n");
#define STRATA_OPENED_END() \
  asm(STRATA_OPENED_SECTION(".rodata.strata_copies", "a") ".Lcopies_end:\n.text\n");

// Call: [slot:i32 | library:i32 | name], both offsets from where they stand.
#define STRATA_OPENED_STUB(name, label, jump, opener)                             \
  ".type " label ",@function\n"                                                   \
  label ": movq .Lslot." name "(%rip),%r11\n testq %r11,%r11\n je 1f\n"           \
  " jmp " jump "\n"                                                               \
  "1: leaq .Lcall." name "(%rip),%r11\n jmp " opener "\n"                         \
  ".size " label ",.-" label "\n"                                                 \
  STRATA_OPENED_SECTION(".data.rel.ro.strata_slot." name, "aw") ".balign 8\n"     \
  ".Lslot." name ": .quad 0\n"                                                    \
  STRATA_OPENED_SECTION(".rodata.strata_call." name, "a") ".balign 4\n"           \
  ".Lcall." name ": .long .Lslot." name " - .\n .long .Llibrary - .\n"            \
  " .asciz \"" name "\"\n"                                                        \
  ".text\n"
#define STRATA_OPENED_CALL(name)                                                  \
  asm(STRATA_OPENED_SECTION(".text.strata_opened." name, "ax") ".balign 16\n"     \
      ".globl " name "\n.hidden " name "\n"                                       \
      STRATA_OPENED_STUB(name, name, "*%r11", "strata_open_call"));
// A variable that holds a function; the library may put another there.
#define STRATA_OPENED_POINTER(name)                                               \
  asm(STRATA_OPENED_SECTION(".data.rel.ro.strata_pointer." name, "aw")            \
      ".balign 8\n.globl " name "\n.hidden " name "\n.type " name ",@object\n"    \
      ".size " name ",8\n" name ": .quad .Lstub." name "\n"                       \
      STRATA_OPENED_SECTION(".text.strata_opened." name, "ax") ".balign 16\n"     \
      STRATA_OPENED_STUB(name, ".Lstub." name, "*(%r11)", "strata_open_pointer"));

// Copy: [target:i32, offset from where it stands | size:i32 | read-only:i32 | name]
#define STRATA_OPENED_DATA(name, size, binding, section, read_only)               \
  asm(section ".balign 32\n.globl " name "\n" binding ".type " name ",@object\n"  \
      ".size " name "," size "\n" name ": .zero " size "\n"                       \
      STRATA_OPENED_SECTION(".rodata.strata_copies", "a")                         \
      " .long " name " - .\n .long " size "\n .long " read_only "\n"              \
      " .asciz \"" name "\"\n.text\n");
#define STRATA_OPENED_COPY(name, size)                                            \
  STRATA_OPENED_DATA(name, size, ".hidden " name "\n",                            \
    STRATA_OPENED_SECTION(".data.rel.ro.strata_copy." name, "aw"), "1")
#define STRATA_OPENED_VALUE(name, size)                                           \
  STRATA_OPENED_DATA(name, size, "", STRATA_OPENED_SECTION(".data.strata_value." name, "aw"), "0")
// clang-format on

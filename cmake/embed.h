// Files taken into the program by the assembler: a compiler would need minutes and gigabytes for Plotly as an
// array.
#pragma once

#include <cstdint>

/// Declares `name`, the bytes of `file` (a string literal, a path), and `name`_size. At namespace scope.
#define TUNNELRIG_EMBED(name, file)                                                                         \
  asm(".pushsection .rodata\n"                                                                              \
      ".balign 8\n" #name "_size: .quad " #name "_end - " #name "\n" #name ": .incbin \"" file "\"\n" #name \
      "_end:\n"                                                                                             \
      ".popsection\n");                                                                                     \
  extern "C" const std::uint64_t name##_size;                                                               \
  extern "C" const char name[];  // NOLINT(bugprone-macro-parentheses): declares the name

#pragma once

// Compiles a function once for every width of vector register and chooses when the program is loaded. Only on plain functions that hold
// a loop. Not under the sanitisers: their run-time isn't ready when the choice is made.
#if defined(__x86_64__) && defined(__gnu_linux__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define SARFOCUS_MULTIVERSION __attribute__((target_clones("default", "arch=x86-64-v3", "arch=x86-64-v4")))
#else
#define SARFOCUS_MULTIVERSION
#endif

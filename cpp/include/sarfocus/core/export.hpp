#pragma once

// Symbols are hidden by default; what a header declares for others carries SARFOCUS_API.
#if defined(_WIN32)
#define SARFOCUS_API
#else
#define SARFOCUS_API __attribute__((visibility("default")))
#endif

// Counts what a test's program allocates, by taking malloc's place in it: for tests that link
// likeness_allocation_count.

#pragma once

#include <cstdint>

// Sanitizers have a malloc of their own.
#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define LIKENESS_COUNTS_ALLOCATIONS

namespace likeness {

int64_t AllocationCount();  // since the program began, by all threads

}  // namespace likeness

#endif

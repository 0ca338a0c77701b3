#include "likeness/base/allocation_count.h"

#ifdef LIKENESS_COUNTS_ALLOCATIONS

#include <atomic>
#include <cstddef>

namespace {
std::atomic<int64_t> allocations = 0;
}

// NOLINTBEGIN(bugprone-reserved-identifier): the C library's own name.
extern "C" void* __libc_malloc(size_t size);
extern "C" void* malloc(size_t size) {
  allocations.fetch_add(1, std::memory_order_relaxed);
  return __libc_malloc(size);
}
// NOLINTEND(bugprone-reserved-identifier)

int64_t likeness::AllocationCount() { return allocations; }

#endif

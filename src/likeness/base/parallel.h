// Loops over all cores.

#pragma once

#include <cstdint>
#include <functional>

namespace likeness {

// Threads that ParallelFor uses; 0 means one for each core. Set once, by main.
void SetThreadCount(int threads);
int ThreadCount();

// Calls body(i) for every i in [0, count), on all threads, in no fixed order; items are handed out one by one, so make
// each a millisecond or more. Returns when all are done. An exception from a body stops the loop and is thrown here.
// A call from inside a body runs on that thread alone.
void ParallelFor(int64_t count, const std::function<void(int64_t)>& body);

}  // namespace likeness

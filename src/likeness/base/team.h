// Threads that work through the phases of a frame together.

#pragma once

#include <atomic>
#include <functional>
#include <memory>
#include <thread>
#include <vector>

namespace likeness {

// The caller's own pool: calls body(context, i) for every i in [0, count), on any threads, and returns when all are
// done. It must not throw.
using ParallelCallback = void (*)(void* pool, int count, void (*body)(void* context, int index), void* context);

class Team {
 public:
  struct Options {
    int threads = 1;
    bool pin = true;                      // each own thread to a core of its own, where the caller may use as many
    double spin_ms = 2;                   // own threads wait so long for the next frame before they sleep
    ParallelCallback parallel = nullptr;  // takes the place of own threads
    void* pool = nullptr;
  };
  explicit Team(const Options& options);
  ~Team();
  Team(const Team&) = delete;
  Team& operator=(const Team&) = delete;

  int threads() const { return options_.threads; }

  // A frame's work. `run` does one thread's share of one phase; shares of a phase begin when the phase before it is
  // done by all. `enter` and `leave` stand around what a thread does.
  class Work {
   public:
    virtual ~Work() = default;
    virtual unsigned Enter() = 0;
    virtual void Leave(unsigned mode) = 0;
    virtual void Run(int phase, int thread) = 0;
  };

  // Works through phases [0, phases). Neither allocates nor locks; a system call is made only to wake own threads that
  // have gone to sleep, and to yield where a thread waits very long, because it has no core. One call at a time.
  void Run(Work& work, int phases);

 private:
  void Stop();
  void WorkAlong(int thread);
  void Share(Work& work, int phases, int thread);

  const Options options_;
  Work* work_ = nullptr;
  int phases_ = 0;
  // Counters lie on cache lines of their own.
  alignas(64) std::atomic<uint32_t> frame_ = 0;    // grows with each frame; wakes the own threads
  alignas(64) std::atomic<uint32_t> arrived_ = 0;  // at the ends of phases, over all frames
  alignas(64) std::atomic<int> sleepers_ = 0;
  uint32_t base_ = 0;  // arrived_ when the frame began
  std::atomic<bool> stop_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace likeness

#include "likeness/base/team.h"

#include <sched.h>

#include <chrono>

namespace likeness {

namespace {

using Clock = std::chrono::steady_clock;

inline void Pause() {
#if defined(__x86_64__)
  __builtin_ia32_pause();
#elif defined(__aarch64__)
  __asm__ volatile("yield");
#endif
}

// The n-th core that this process may use, for thread n; none where there are fewer cores than threads.
void PinTo(int n, int threads) {
  cpu_set_t allowed;
  CPU_ZERO(&allowed);
  if (sched_getaffinity(0, sizeof(allowed), &allowed) != 0 || CPU_COUNT(&allowed) < threads) return;
  for (int cpu = 0; cpu < CPU_SETSIZE; ++cpu) {
    if (!CPU_ISSET(cpu, &allowed) || n-- > 0) continue;
    cpu_set_t one;
    CPU_ZERO(&one);
    CPU_SET(cpu, &one);
    sched_setaffinity(0, sizeof(one), &one);  // a hint: it may be refused
    return;
  }
}

constexpr int kSpinsBeforeYield = 20'000;  // about a millisecond

}  // namespace

Team::Team(const Options& options) : options_(options) {
  if (options_.parallel != nullptr) return;
  try {
    for (int t = 1; t < options_.threads; ++t) workers_.emplace_back([this, t] { WorkAlong(t); });
  } catch (...) {
    Stop();
    throw;
  }
}

Team::~Team() { Stop(); }

void Team::Stop() {
  stop_ = true;
  frame_.fetch_add(1);
  frame_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void Team::Run(Work& work, int phases) {
  if (options_.parallel != nullptr) {
    struct Context {
      Work& work;
      int phase;
    } context = {work, 0};
    for (; context.phase < phases; ++context.phase) {
      options_.parallel(
          options_.pool, options_.threads,
          [](void* given, int thread) {
            auto& [the_work, phase] = *static_cast<Context*>(given);
            const unsigned mode = the_work.Enter();
            the_work.Run(phase, thread);
            the_work.Leave(mode);
          },
          &context);
    }
    return;
  }
  work_ = &work;
  phases_ = phases;
  base_ = arrived_.load(std::memory_order_relaxed);
  if (!workers_.empty()) {
    frame_.fetch_add(1);
    if (sleepers_.load() > 0) frame_.notify_all();
  }
  Share(work, phases, 0);
}

void Team::Share(Work& work, int phases, int thread) {
  const uint32_t base = base_;
  const unsigned mode = work.Enter();
  for (int phase = 0; phase < phases; ++phase) {
    work.Run(phase, thread);
    arrived_.fetch_add(1, std::memory_order_acq_rel);
    const uint32_t all = static_cast<uint32_t>(phase + 1) * static_cast<uint32_t>(options_.threads);
    const bool last = phase + 1 == phases;
    if (last && thread != 0) break;  // nobody but the caller waits for the end
    for (int spins = 0; arrived_.load(std::memory_order_acquire) - base < all; ++spins) {
      if (spins < kSpinsBeforeYield) {
        Pause();
      } else {
        sched_yield();
      }
    }
  }
  work.Leave(mode);
}

void Team::WorkAlong(int thread) {
  if (options_.pin) PinTo(thread, options_.threads);
  const auto patience =
      std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double, std::milli>(options_.spin_ms));
  uint32_t seen = 0;
  while (true) {
    auto since = Clock::now();
    for (int spins = 0; frame_.load(std::memory_order_acquire) == seen; ++spins) {
      Pause();
      if (spins % 64 != 63 || Clock::now() - since < patience) continue;
      sleepers_.fetch_add(1);
      frame_.wait(seen);
      sleepers_.fetch_sub(1);
      since = Clock::now();
    }
    seen = frame_.load(std::memory_order_acquire);
    if (stop_) return;
    Share(*work_, phases_, thread);
  }
}

}  // namespace likeness

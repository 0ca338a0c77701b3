#include "likeness/decode/memory.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <new>

namespace likeness {

namespace {
constexpr int64_t kLine = 64;
constexpr int64_t kHugePage = int64_t{2} << 20;
constexpr int64_t kChunk = 4 * kHugePage;

int64_t RoundUp(int64_t value, int64_t step) { return (value + step - 1) / step * step; }
}  // namespace

void Memory::Free::operator()(void* chunk) const { std::free(chunk); }

void* Memory::Allocate(int64_t bytes) {
  const int64_t size = RoundUp(std::max<int64_t>(bytes, 1), kLine);
  if (size > left_) {
    const int64_t chunk = RoundUp(std::max(size, kChunk), kHugePage);
    void* const memory = std::aligned_alloc(kHugePage, static_cast<size_t>(chunk));
    if (memory == nullptr) throw std::bad_alloc();
    chunks_.emplace_back(memory);
    madvise(memory, static_cast<size_t>(chunk), MADV_HUGEPAGE);  // a hint: it may be refused
    std::memset(memory, 0, static_cast<size_t>(chunk));
    next_ = static_cast<std::byte*>(memory);
    left_ = chunk;
  }
  void* const result = next_;
  next_ += size;
  left_ -= size;
  total_ += size;
  return result;
}

}  // namespace likeness

// Memory for the decoder: large, aligned, zero, and touched before the first frame, so that no page fault comes later.

#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

namespace likeness {

class Memory {
 public:
  // At a multiple of 64 bytes; lives as long as this object. Throws std::bad_alloc.
  void* Allocate(int64_t bytes);
  int64_t bytes() const { return total_; }

 private:
  struct Free {
    void operator()(void* chunk) const;
  };
  std::vector<std::unique_ptr<void, Free>> chunks_;
  std::byte* next_ = nullptr;
  int64_t left_ = 0;
  int64_t total_ = 0;
};

}  // namespace likeness

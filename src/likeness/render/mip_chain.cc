#include "likeness/render/mip_chain.h"

#include "likeness/base/error.h"

namespace likeness {

MipChain::MipChain(int size) {
  LIKENESS_CHECK(size >= 16 && size <= 2 << (kMostLevels - 1) && (size & (size - 1)) == 0);
  maps_.size = size;
  size_t bytes = 0;
  for (int side = size / 2; side >= 2; side /= 2) bytes += size_t{4} * side * side;
  memory_.resize(bytes);
  uint8_t* next = memory_.data();
  maps_.count = 1;
  for (int side = size / 2; side >= 2; side /= 2) {
    maps_.levels[maps_.count] = levels_[maps_.count] = next;
    ++maps_.count;
    next += size_t{4} * side * side;
  }
}

void MipChain::MakePart(const RasterKernel& kernel, int part) {
  for (int level = 1; maps_.size >> level >= kParts; ++level) {
    const int rows = (maps_.size >> level) / kParts;
    MakeRows(kernel, level, part * rows, (part + 1) * rows);
  }
}

void MipChain::MakeRest(const RasterKernel& kernel) {
  for (int level = maps_.count - 2; level < maps_.count; ++level) MakeRows(kernel, level, 0, maps_.size >> level);
}

void MipChain::MakeRows(const RasterKernel& kernel, int level, int begin, int end) {
  const int side = maps_.size >> level;
  const auto finer_row = static_cast<int64_t>(8) * side;
  for (int y = begin; y < end; ++y) {
    const uint8_t* const from = maps_.levels[level - 1] + 2 * y * finer_row;
    kernel.halve(from, from + finer_row, side, levels_[level] + y * finer_row / 2);
  }
}

}  // namespace likeness

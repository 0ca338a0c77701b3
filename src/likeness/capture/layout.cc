#include "likeness/capture/layout.h"

#include "likeness/base/file.h"

namespace likeness {

std::vector<int> TextureSizes(const std::filesystem::path& capture_root) {
  std::vector<int> sizes;
  const std::string prefix = "unwrapped_uv_";
  for (const std::string& name : ListFolder(capture_root)) {
    if (!name.starts_with(prefix) || name.size() == prefix.size() || name.size() > prefix.size() + 5) continue;
    const std::string digits = name.substr(prefix.size());
    if (std::all_of(digits.begin(), digits.end(), [](char c) { return c >= '0' && c <= '9'; })) {
      sizes.push_back(std::stoi(digits));
    }
  }
  std::sort(sizes.begin(), sizes.end());
  return sizes;
}

}  // namespace likeness

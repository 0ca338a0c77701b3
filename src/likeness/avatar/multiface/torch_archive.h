// Files of torch.save: a zip of stored entries, with a pickle that describes tensors and the tensors' bytes.

#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <string_view>

#include "likeness/avatar/avatar.h"

namespace likeness {

// The tensors of a saved state dictionary by name, row by row, as float32 (from float64, float32, float16 or bfloat16).
// Entries that are no tensors are left out. Nothing in the file is executed. Throws Error naming the file: no such zip
// (the format of PyTorch before 1.6, say), compressed or encrypted entries, big-endian data, a pickle of other things
// than tensors, tensors that reach beyond their storage, or that together have more values than the file has bytes.
std::map<std::string, Tensor> ReadTorchArchive(const std::filesystem::path& path);

// The same of a file in memory; `path` is for error messages only.
std::map<std::string, Tensor> ParseTorchArchive(const std::filesystem::path& path, std::string_view bytes);

}  // namespace likeness

// MakeHuman's .target files: sparse displacements of the base mesh.

#pragma once

#include <Eigen/Core>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

// One shape: moves vertex `vertices[i]` by `deltas[i]`. Weights are linear.
struct Target {
  std::vector<int> vertices;            // indices into the base mesh
  std::vector<Eigen::Vector3f> deltas;  // the file's unit (decimetres in MakeHuman's data)
};

// Reads `vertex dx dy dz` lines; `#` starts a comment. Files that end in .gz are decompressed. Throws Error, naming
// file and line, for malformed lines, vertices outside [0, vertex_count) and numbers that are not finite, and for
// files that unpack to more than 64 MiB.
Target ReadTarget(const std::filesystem::path& path, int vertex_count);
Target ParseTarget(const std::filesystem::path& path_for_errors, std::string_view text, int vertex_count);

// Unpacks gzip data. Throws Error, naming the file, when they are damaged, cut off, or unpack to more than `most`
// bytes.
std::string Gunzip(const std::filesystem::path& path_for_errors, std::string_view bytes, size_t most);

}  // namespace likeness

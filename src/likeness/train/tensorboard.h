// Event files that TensorBoard reads: scalars and pictures over the steps of a run.
//
// A file is a row of TFRecords (length, masked CRC-32C of the length, bytes, masked CRC-32C of the bytes), each one
// protocol-buffer message tensorflow.Event; the few fields that are needed are encoded by hand.

#pragma once

#include <cstdint>
#include <filesystem>
#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "likeness/image/image.h"

namespace likeness {

class TensorBoardWriter {
 public:
  // A new file in the folder, which is made. Throws Error when it cannot be written.
  explicit TensorBoardWriter(const std::filesystem::path& folder);

  // Tags with slashes are grouped by TensorBoard: "loss/texture".
  void WriteScalars(int64_t step, const std::vector<std::pair<std::string, double>>& scalars);
  void WriteImage(int64_t step, const std::string& tag, const ImageU8& image);

  const std::filesystem::path& path() const { return path_; }

 private:
  void WriteRecord(std::string_view bytes);

  std::filesystem::path path_;
  std::ofstream out_;
};

// CRC-32C (Castagnoli), and the form in which TFRecords store it.
uint32_t Crc32c(std::string_view bytes);
uint32_t MaskedCrc32c(std::string_view bytes);

}  // namespace likeness

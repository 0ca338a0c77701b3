// The record of a texture folder, kept while it is filled.

#pragma once

#include <filesystem>
#include <string>

#include "likeness/capture/layout.h"
#include "likeness/texture/unwrap_capture.h"
#include "likeness/texture/unwrap_record.h"

namespace likeness {

// With all that is in it; nothing where there is none.
void RemoveFolder(const std::filesystem::path& path);

// What the files of a folder were made with. Throws Error, naming the folder, where it is not what it should be.
class UnwrapState {
 public:
  UnwrapState(const Capture& capture, const UnwrapOptions& options);

  // Makes the folder hold nothing but what these options make.
  void Prepare(bool redo);

  // Learns what other processes have done since.
  void Refresh() { wanted_.statistics = ReadRecord().statistics; }

  // The statistics that the folder holds were made from what this key stands for.
  bool HasStatistics(const std::string& key) const { return wanted_.statistics == key; }
  void SetStatistics(const std::string& key);

 private:
  void Compare(const std::filesystem::path& folder);
  UnwrapRecord ReadRecord() const;

  const CaptureLayout layout_;
  const int size_;
  const std::filesystem::path path_;
  UnwrapRecord wanted_;
};

}  // namespace likeness

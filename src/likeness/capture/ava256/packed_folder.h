// Numbered files, in a zip or unpacked, as Ava-256 and Goliath keep all that there is one of for every frame.

#pragma once

#include <filesystem>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

// Files whose names are whole numbers ("000123.avif", in any folder of a zip), found by number. What has another name
// or ending is left alone.
//
// A zip is indexed once, when opened, and read through one libzip handle. Such a handle serves one thread at a time, so
// a lock is held while bytes are read out of the zip (published ones store pictures as they are: a copy); what is done
// with the bytes goes on outside of it. Const methods may be called from many threads.
class PackedFolder {
 public:
  // PARENT/NAME.zip; otherwise the folder PARENT/NAME, or PARENT/NAME/NAME as some programs unpack; otherwise, with
  // `flat`, the files in PARENT itself. None where there is no such file with one of the `endings` (".png").
  // Throws Error for a zip that is none, and where two files of it have the same number.
  static std::optional<PackedFolder> Find(const std::filesystem::path& parent, const std::string& name,
                                          std::vector<std::string> endings, bool flat = false);

  // A zip in memory, which must outlive the result.
  static PackedFolder FromZipBytes(const std::filesystem::path& path_for_errors, std::string_view bytes,
                                   std::vector<std::string> endings);

  PackedFolder(PackedFolder&&) noexcept;
  PackedFolder& operator=(PackedFolder&&) noexcept;
  ~PackedFolder();

  const std::filesystem::path& path() const { return path_; }  // of the zip or folder
  bool is_zip() const { return zip_ != nullptr; }
  bool Has(int64_t number) const { return Find(number) != nullptr; }
  size_t size() const { return files_.size(); }
  std::vector<int64_t> Numbers() const;  // ascending

  // What to call a file in messages: "image/cam400940.zip/cam400940/000123.avif"; for an absent one "PATH/000123.avif".
  std::filesystem::path NameOf(int64_t number) const;

  // A whole file. Throws Error when it is absent, damaged, encrypted, or larger than `most` bytes, whatever the zip
  // says about its size, and without making room for more than the packed bytes can hold.
  std::string Read(int64_t number, uint64_t most) const;

 private:
  struct Zip;
  struct File {
    int64_t number = 0;
    uint64_t index = 0;  // in the zip, or in names_
  };

  PackedFolder(std::filesystem::path path, std::vector<std::string> endings);
  void IndexZip();
  void IndexFolder();
  void Add(std::string_view name, uint64_t index);
  void Sort();  // throws Error when two files have the same number
  const File* Find(int64_t number) const;
  std::string InnerName(const File& file) const;

  std::filesystem::path path_;
  std::vector<std::string> endings_;
  std::vector<File> files_;         // by number; kept small, as a capture has a million of them
  std::vector<std::string> names_;  // in a folder
  std::unique_ptr<Zip> zip_;
};

}  // namespace likeness

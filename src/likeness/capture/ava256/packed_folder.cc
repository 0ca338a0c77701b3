#include "likeness/capture/ava256/packed_folder.h"

#include <fmt/format.h>
#include <zip.h>

#include <algorithm>
#include <charconv>

#include "likeness/base/error.h"
#include "likeness/base/file.h"

namespace likeness {

namespace fs = std::filesystem;

namespace {

// Deflate cannot expand by more than 1032.
constexpr uint64_t kMostExpansion = 1040;

std::string ErrorText(zip_error_t* error) {
  std::string text = zip_error_strerror(error);
  zip_error_fini(error);
  return text;
}

// "cam1/000123.avif" to "000123" and ".avif".
std::pair<std::string_view, std::string_view> StemAndEnding(std::string_view name) {
  name.remove_prefix(name.rfind('/') + 1);  // npos + 1 is 0
  const size_t dot = std::min(name.rfind('.'), name.size());
  return {name.substr(0, dot), name.substr(dot)};
}

}  // namespace

struct PackedFolder::Zip {
  zip_t* handle = nullptr;
  std::mutex mutex;

  Zip() = default;
  Zip(const Zip&) = delete;
  Zip& operator=(const Zip&) = delete;
  ~Zip() {
    if (handle != nullptr) zip_discard(handle);
  }
};

PackedFolder::PackedFolder(fs::path path, std::vector<std::string> endings)
    : path_(std::move(path)), endings_(std::move(endings)) {}
PackedFolder::PackedFolder(PackedFolder&&) noexcept = default;
PackedFolder& PackedFolder::operator=(PackedFolder&&) noexcept = default;
PackedFolder::~PackedFolder() = default;

std::optional<PackedFolder> PackedFolder::Find(const fs::path& parent, const std::string& name,
                                               std::vector<std::string> endings, bool flat) {
  std::error_code ignored;
  if (const fs::path path = parent / (name + ".zip"); fs::is_regular_file(path, ignored)) {
    PackedFolder folder(path, std::move(endings));
    folder.zip_ = std::make_unique<Zip>();
    int code = 0;
    folder.zip_->handle = zip_open(path.c_str(), ZIP_RDONLY, &code);
    if (folder.zip_->handle == nullptr) {
      zip_error_t error;
      zip_error_init_with_code(&error, code);
      throw FileError(path, fmt::format("cannot be read as a zip: {}", ErrorText(&error)));
    }
    folder.IndexZip();
    return folder;
  }
  std::vector<fs::path> candidates = {parent / name, parent / name / name};
  if (flat) candidates.push_back(parent);
  for (const fs::path& path : candidates) {
    PackedFolder folder(path, endings);
    folder.IndexFolder();
    if (folder.size() > 0) return folder;
  }
  return std::nullopt;
}

PackedFolder PackedFolder::FromZipBytes(const fs::path& path_for_errors, std::string_view bytes,
                                        std::vector<std::string> endings) {
  PackedFolder folder(path_for_errors, std::move(endings));
  folder.zip_ = std::make_unique<Zip>();
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  if (source != nullptr) {
    folder.zip_->handle = zip_open_from_source(source, ZIP_RDONLY, &error);
    if (folder.zip_->handle == nullptr) zip_source_free(source);
  }
  if (folder.zip_->handle == nullptr) {
    throw FileError(path_for_errors, fmt::format("cannot be read as a zip: {}", ErrorText(&error)));
  }
  zip_error_fini(&error);
  folder.IndexZip();
  return folder;
}

void PackedFolder::IndexZip() {
  const zip_int64_t entries = zip_get_num_entries(zip_->handle, 0);
  files_.reserve(static_cast<size_t>(entries));
  for (zip_int64_t i = 0; i < entries; ++i) {
    const char* name = zip_get_name(zip_->handle, static_cast<zip_uint64_t>(i), 0);
    if (name != nullptr) Add(name, static_cast<uint64_t>(i));
  }
  Sort();
}

void PackedFolder::IndexFolder() {
  names_ = ListFolder(path_);
  for (size_t i = 0; i < names_.size(); ++i) Add(names_[i], i);
  Sort();
}

void PackedFolder::Add(std::string_view name, uint64_t index) {
  const auto [stem, ending] = StemAndEnding(name);
  if (std::find(endings_.begin(), endings_.end(), ending) == endings_.end()) return;
  int64_t number = 0;
  const auto [end, code] = std::from_chars(stem.data(), stem.data() + stem.size(), number);
  if (code == std::errc() && end == stem.data() + stem.size() && number >= 0) files_.push_back({number, index});
}

void PackedFolder::Sort() {
  std::sort(files_.begin(), files_.end(), [](const File& a, const File& b) { return a.number < b.number; });
  const auto twice = std::adjacent_find(files_.begin(), files_.end(),
                                        [](const File& a, const File& b) { return a.number == b.number; });
  if (twice == files_.end()) return;
  throw FileError(path_, fmt::format("holds both {} and {}: which one is frame {}?", InnerName(*twice),
                                     InnerName(*std::next(twice)), twice->number));
}

const PackedFolder::File* PackedFolder::Find(int64_t number) const {
  const auto it = std::lower_bound(files_.begin(), files_.end(), number,
                                   [](const File& file, int64_t wanted) { return file.number < wanted; });
  return it == files_.end() || it->number != number ? nullptr : &*it;
}

std::string PackedFolder::InnerName(const File& file) const {
  if (!is_zip()) return names_[file.index];
  const std::lock_guard lock(zip_->mutex);
  const char* name = zip_get_name(zip_->handle, file.index, 0);
  return name != nullptr ? name : "";
}

std::vector<int64_t> PackedFolder::Numbers() const {
  std::vector<int64_t> numbers;
  for (const File& file : files_) numbers.push_back(file.number);
  return numbers;
}

fs::path PackedFolder::NameOf(int64_t number) const {
  const File* file = Find(number);
  // A zip may hold "/etc/000001.txt", which would hide its own path.
  return path_ / (file == nullptr ? fs::path(fmt::format("{:06}{}", number, endings_.front()))
                                  : fs::path(InnerName(*file)).relative_path());
}

std::string PackedFolder::Read(int64_t number, uint64_t most) const {
  const File* file = Find(number);
  const fs::path name = NameOf(number);
  if (file == nullptr) throw FileError(name, "no such file");
  if (!is_zip()) return ReadFile(name, most);

  const std::lock_guard lock(zip_->mutex);
  zip_stat_t stat;
  zip_stat_init(&stat);
  if (zip_stat_index(zip_->handle, file->index, 0, &stat) != 0 || (stat.valid & ZIP_STAT_SIZE) == 0 ||
      (stat.valid & ZIP_STAT_COMP_SIZE) == 0) {
    throw FileError(name, "its zip does not say how large it is");
  }
  if (stat.size > most) {
    throw FileError(name, fmt::format("is {} bytes large; at most {} were expected", stat.size, most));
  }
  if (stat.size / kMostExpansion > stat.comp_size) {
    throw FileError(name, fmt::format("claims {} bytes in {} packed ones: damaged", stat.size, stat.comp_size));
  }
  const std::unique_ptr<zip_file_t, decltype(&zip_fclose)> opened(zip_fopen_index(zip_->handle, file->index, 0),
                                                                  &zip_fclose);
  if (!opened) throw FileError(name, fmt::format("cannot be read: {}", zip_strerror(zip_->handle)));
  // One byte more than promised: only at the end does libzip compare the checksum, and a longer file is a lie.
  std::string bytes(stat.size + 1, '\0');
  size_t have = 0;
  while (have < bytes.size()) {
    const zip_int64_t got = zip_fread(opened.get(), bytes.data() + have, bytes.size() - have);
    if (got < 0) throw FileError(name, fmt::format("is damaged: {}", zip_file_strerror(opened.get())));
    if (got == 0) break;
    have += static_cast<size_t>(got);
  }
  if (have != stat.size) {
    throw FileError(name,
                    fmt::format("holds {} bytes, but its zip says {}", have > stat.size ? "more" : "fewer", stat.size));
  }
  bytes.pop_back();
  return bytes;
}

}  // namespace likeness

// Text files of numbers and names, read line by line with errors that name file and line.

#pragma once

#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace likeness {

// Walks over the lines of a text. Line ends are \n or \r\n; a byte-order mark is skipped.
class TextLines {
 public:
  // `path` is for error messages only; `text` is borrowed.
  TextLines(std::filesystem::path path, std::string_view text);

  // Moves to the next line; false at the end.
  bool Next();
  std::string_view line() const { return line_; }
  int number() const { return number_; }  // 1-based

  // Words of the current line, parted by blanks (or by `separator`, then kept when empty).
  std::vector<std::string_view> Words() const;
  std::vector<std::string_view> Fields(char separator) const;

  // Numbers of the current line; throws Error unless there are exactly `count` finite ones.
  std::vector<double> Numbers(size_t count) const;

  double Number(std::string_view word) const;  // finite
  float Float(std::string_view word) const;    // finite as a float, too
  int64_t Integer(std::string_view word) const;

  // Throws an Error about the current line.
  [[noreturn]] void Fail(const std::string& message) const;

 private:
  std::filesystem::path path_;
  std::string_view rest_;
  std::string_view line_;
  int number_ = 0;
};

// Strips blanks from both ends.
std::string_view Trim(std::string_view text);

// The known word that is nearest to `word` by edit distance, or "" when none is near.
std::string NearestWord(std::string_view word, const std::vector<std::string>& known);

}  // namespace likeness

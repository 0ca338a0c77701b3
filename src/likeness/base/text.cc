#include "likeness/base/text.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <limits>
#include <numeric>

#include "likeness/base/error.h"

namespace likeness {
namespace {

bool IsBlank(char c) { return c == ' ' || c == '\t' || c == '\r' || c == '\f' || c == '\v'; }

// A word as an error message shows it: short, and without control characters.
std::string Quoted(std::string_view word) {
  std::string shown(word.substr(0, 40));
  std::replace_if(
      shown.begin(), shown.end(), [](unsigned char c) { return c < 32 || c >= 127; }, '?');
  return "'" + shown + (word.size() > 40 ? "...'" : "'");
}

size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  std::iota(row.begin(), row.end(), size_t{0});
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = row[0];
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = diagonal + (a[i - 1] != b[j - 1] ? 1 : 0);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

}  // namespace

std::string_view Trim(std::string_view text) {
  while (!text.empty() && (IsBlank(text.front()) || text.front() == '\n')) text.remove_prefix(1);
  while (!text.empty() && (IsBlank(text.back()) || text.back() == '\n')) text.remove_suffix(1);
  return text;
}

TextLines::TextLines(std::filesystem::path path, std::string_view text) : path_(std::move(path)), rest_(text) {
  if (rest_.starts_with("\xef\xbb\xbf")) rest_.remove_prefix(3);
}

bool TextLines::Next() {
  if (rest_.empty()) return false;
  const size_t end = rest_.find('\n');
  line_ = rest_.substr(0, end);
  rest_.remove_prefix(end == std::string_view::npos ? rest_.size() : end + 1);
  if (line_.ends_with('\r')) line_.remove_suffix(1);
  ++number_;
  return true;
}

std::vector<std::string_view> TextLines::Words() const {
  std::vector<std::string_view> words;
  std::string_view rest = line_;
  while (true) {
    while (!rest.empty() && IsBlank(rest.front())) rest.remove_prefix(1);
    if (rest.empty()) return words;
    const size_t length = std::find_if(rest.begin(), rest.end(), IsBlank) - rest.begin();
    words.push_back(rest.substr(0, length));
    rest.remove_prefix(length);
  }
}

std::vector<std::string_view> TextLines::Fields(char separator) const {
  std::vector<std::string_view> fields;
  std::string_view rest = line_;
  while (true) {
    const size_t end = rest.find(separator);
    fields.push_back(Trim(rest.substr(0, end)));
    if (end == std::string_view::npos) return fields;
    rest.remove_prefix(end + 1);
  }
}

std::vector<double> TextLines::Numbers(size_t count) const {
  const auto words = Words();
  if (words.size() != count) Fail(fmt::format("expected {} numbers, found {}", count, words.size()));
  std::vector<double> numbers;
  for (const std::string_view word : words) numbers.push_back(Number(word));
  return numbers;
}

double TextLines::Number(std::string_view word) const {
  double value = 0;
  if (word.starts_with('+')) word.remove_prefix(1);
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc() || end != word.data() + word.size() || !std::isfinite(value)) {
    Fail(fmt::format("expected a finite number, found {}", Quoted(word)));
  }
  return value;
}

float TextLines::Float(std::string_view word) const {
  const double value = Number(word);
  if (std::abs(value) > double{std::numeric_limits<float>::max()}) {
    Fail(fmt::format("the number {} is too large", Quoted(word)));
  }
  return static_cast<float>(value);
}

int64_t TextLines::Integer(std::string_view word) const {
  int64_t value = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (code != std::errc() || end != word.data() + word.size()) {
    Fail(fmt::format("expected a whole number, found {}", Quoted(word)));
  }
  return value;
}

void TextLines::Fail(const std::string& message) const { throw FileError(path_, number_, message); }

std::string NearestWord(std::string_view word, const std::vector<std::string>& known) {
  std::string nearest;
  size_t best = std::max<size_t>(2, word.size() / 2) + 1;
  for (const std::string& candidate : known) {
    const size_t distance = EditDistance(word, candidate);
    if (distance < best) {
      best = distance;
      nearest = candidate;
    }
  }
  return nearest;
}

}  // namespace likeness

// The three forms of FileStorage as one tree.

#include <fmt/format.h>
#include <yaml-cpp/eventhandler.h>
#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <sstream>

#include "likeness/base/error.h"
#include "likeness/base/text.h"
#include "likeness/capture/calibration_formats/opencv_storage.h"

namespace likeness {
namespace {

constexpr size_t kDeepest = 32;

// Builds the tree from yaml-cpp's events. Not from its nodes: those follow aliases, which may go round in circles.
class TreeBuilder : public YAML::EventHandler {
 public:
  explicit TreeBuilder(const std::filesystem::path& path) : path_(path) {}

  StorageNode root;

  void OnDocumentStart(const YAML::Mark&) override {}
  void OnDocumentEnd() override {}
  void OnNull(const YAML::Mark& mark, YAML::anchor_t anchor) override { OnScalar(mark, "", anchor, ""); }
  void OnAlias(const YAML::Mark& mark, YAML::anchor_t) override { RefuseAnchor(mark); }

  void OnScalar(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor, const std::string& value) override {
    if (anchor != 0) RefuseAnchor(mark);
    StorageNode node;
    node.line = mark.line + 1;
    node.scalar = value;
    Add(std::move(node));
  }

  void OnSequenceStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                       YAML::EmitterStyle::value) override {
    Open(mark, anchor, StorageNode::Kind::kList);
  }
  void OnSequenceEnd() override { Close(); }
  void OnMapStart(const YAML::Mark& mark, const std::string&, YAML::anchor_t anchor,
                  YAML::EmitterStyle::value) override {
    Open(mark, anchor, StorageNode::Kind::kMap);
  }
  void OnMapEnd() override { Close(); }

 private:
  struct Level {
    StorageNode node;
    std::string key;
    bool has_key = false;
  };

  [[noreturn]] void RefuseAnchor(const YAML::Mark& mark) const {
    throw FileError(path_, mark.line + 1, "an anchor or alias; OpenCV writes none, please write the values out");
  }

  void Open(const YAML::Mark& mark, YAML::anchor_t anchor, StorageNode::Kind kind) {
    if (anchor != 0) RefuseAnchor(mark);
    if (levels_.size() >= kDeepest) throw FileError(path_, mark.line + 1, "is nested too deeply to be a calibration");
    levels_.emplace_back();
    levels_.back().node.kind = kind;
    levels_.back().node.line = mark.line + 1;
  }

  void Close() {
    StorageNode node = std::move(levels_.back().node);
    levels_.pop_back();
    Add(std::move(node));
  }

  void Add(StorageNode node) {
    if (levels_.empty()) {
      root = std::move(node);
      return;
    }
    Level& level = levels_.back();
    if (level.node.kind == StorageNode::Kind::kList) {
      level.node.items.push_back(std::move(node));
    } else if (!level.has_key) {
      if (node.kind != StorageNode::Kind::kScalar) throw FileError(path_, node.line, "a key that is no word");
      level.key = std::move(node.scalar);
      level.has_key = true;
    } else {
      level.node.entries.push_back({std::move(level.key), std::move(node)});
      level.has_key = false;
    }
  }

  const std::filesystem::path& path_;
  std::vector<Level> levels_;
};

StorageNode ParseYaml(const std::filesystem::path& path, std::string_view bytes) {
  std::string text(bytes);
  // "%YAML:1.0" is no directive of YAML; as a comment it keeps the line numbers.
  if (text.starts_with('%')) text[0] = '#';
  std::istringstream stream(text);
  TreeBuilder builder(path);
  try {
    YAML::Parser parser(stream);
    parser.HandleNextDocument(builder);
  } catch (const YAML::Exception& error) {
    throw FileError(path, std::max(0, error.mark.line) + 1, "is no YAML: " + error.msg);
  }
  return std::move(builder.root);
}

// The part of XML that FileStorage writes: elements with attributes (skipped), text, comments, a declaration. An
// element with children is a map (a list where they are named "_"), another one a scalar, and one with several words a
// list.
class XmlParser {
 public:
  XmlParser(const std::filesystem::path& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  StorageNode Parse() {
    SkipMiscellaneous();
    std::string name;
    StorageNode root = Element(&name, 0);
    if (name != "opencv_storage") Fail("expected the root element opencv_storage");
    return root;
  }

 private:
  [[noreturn]] void Fail(const std::string& message) const {
    const auto end = bytes_.begin() + static_cast<std::ptrdiff_t>(std::min(at_, bytes_.size()));
    throw FileError(path_, 1 + static_cast<int>(std::count(bytes_.begin(), end, '\n')), message);
  }

  bool At(std::string_view text) const { return bytes_.substr(std::min(at_, bytes_.size())).starts_with(text); }

  void SkipPast(std::string_view text) {
    const size_t found = bytes_.find(text, at_);
    if (found == std::string_view::npos) Fail(fmt::format("the file ends before '{}'", text));
    at_ = found + text.size();
  }

  // Blanks, declarations and comments.
  void SkipMiscellaneous() {
    while (true) {
      at_ = std::min(bytes_.find_first_not_of(" \t\r\n", at_), bytes_.size());
      if (At("<!--")) {
        SkipPast("-->");
      } else if (At("<?")) {
        SkipPast("?>");
      } else {
        return;
      }
    }
  }

  StorageNode Element(std::string* name, size_t depth) {
    if (depth > kDeepest) Fail("is nested too deeply to be a calibration");
    StorageNode node;
    node.line = 0;
    if (!At("<") || At("</")) Fail("expected an element");
    const size_t end = bytes_.find_first_of(" \t\r\n/>", at_ + 1);
    if (end == std::string_view::npos || end == at_ + 1) Fail("an element without a name");
    *name = bytes_.substr(at_ + 1, end - at_ - 1);
    SkipPast(">");
    if (bytes_[at_ - 2] == '/') return node;
    std::string text;
    while (true) {
      const size_t next = bytes_.find('<', at_);
      if (next == std::string_view::npos) Fail(fmt::format("the file ends inside <{}>", *name));
      text += bytes_.substr(at_, next - at_);
      at_ = next;
      SkipMiscellaneous();
      if (At("</")) {
        if (!At("</" + *name)) Fail(fmt::format("expected </{}>", *name));
        SkipPast(">");
        break;
      }
      if (!At("<")) continue;
      std::string child;
      StorageNode value = Element(&child, depth + 1);
      if (child == "_") {
        node.items.push_back(std::move(value));
      } else {
        node.entries.push_back({std::move(child), std::move(value)});
      }
    }
    Finish(&node, text);
    return node;
  }

  static void Finish(StorageNode* node, const std::string& text) {
    if (!node->entries.empty()) {
      node->kind = StorageNode::Kind::kMap;
      return;
    }
    TextLines lines("", text);
    std::vector<std::string> words;
    while (lines.Next()) {
      for (const std::string_view word : lines.Words()) words.emplace_back(word);
    }
    if (node->items.empty() && words.size() == 1) {
      node->scalar = words[0];
      if (node->scalar.size() >= 2 && node->scalar.front() == '"' && node->scalar.back() == '"') {
        node->scalar = node->scalar.substr(1, node->scalar.size() - 2);
      }
      return;
    }
    node->kind = StorageNode::Kind::kList;
    for (std::string& word : words) {
      node->items.emplace_back();
      node->items.back().scalar = std::move(word);
    }
  }

  const std::filesystem::path& path_;
  const std::string_view bytes_;
  size_t at_ = 0;
};

}  // namespace

const StorageNode* StorageNode::Find(std::string_view key) const {
  for (const auto& [name, node] : entries) {
    if (name == key) return &node;
  }
  return nullptr;
}

StorageNode ParseStorage(const std::filesystem::path& path, std::string_view bytes) {
  const std::string_view start = Trim(bytes.substr(0, 1000));
  StorageNode root = start.starts_with('<') ? XmlParser(path, bytes).Parse() : ParseYaml(path, bytes);
  if (root.kind != StorageNode::Kind::kMap) {
    throw FileError(path, "holds no named values; expected OpenCV's YAML, JSON or XML with camera_matrix and the like");
  }
  return root;
}

}  // namespace likeness

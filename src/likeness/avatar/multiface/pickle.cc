#include "likeness/avatar/multiface/pickle.h"

#include <cstring>
#include <unordered_map>

#include "likeness/base/error.h"

namespace likeness {

namespace {

constexpr size_t kMostNodes = 1 << 20;
constexpr size_t kLongestName = 256;

}  // namespace

class PickleMachine {
 public:
  PickleMachine(const std::filesystem::path& path, std::string_view bytes) : path_(path), bytes_(bytes) {}

  Pickle Run() {
    while (!stopped_) {
      opcode_at_ = at_;
      Step(static_cast<uint8_t>(Take(1)[0]));
    }
    return std::move(result_);
  }

 private:
  using Kind = Pickle::Kind;
  using Ref = Pickle::Ref;
  using Node = Pickle::Node;

  [[noreturn]] void Fail(const std::string& what) const {
    throw FileError(path_, fmt::format("its pickle, byte {}: {}", opcode_at_, what));
  }

  std::string_view Take(uint64_t count) {
    if (count > bytes_.size() - at_) Fail("is cut off");
    const std::string_view taken = bytes_.substr(at_, count);
    at_ += count;
    return taken;
  }

  // A little-endian number of `bytes` bytes.
  uint64_t Unsigned(int bytes) {
    const std::string_view digits = Take(bytes);
    uint64_t value = 0;
    for (int i = bytes - 1; i >= 0; --i) value = value << 8 | static_cast<uint8_t>(digits[i]);
    return value;
  }

  std::string_view Line() {
    const size_t end = bytes_.find('\n', at_);
    if (end == std::string_view::npos) Fail("a line is cut off");
    const std::string_view line = Take(end - at_);
    Take(1);
    return line;
  }

  Node& Push(Kind kind) {
    if (result_.nodes_.size() >= kMostNodes) Fail(fmt::format("holds more than {} values", kMostNodes));
    stack_.push_back(static_cast<Ref>(result_.nodes_.size()));
    Node& node = result_.nodes_.emplace_back();
    node.kind = kind;
    return node;
  }

  void PushInteger(int64_t value) { Push(Kind::kInteger).integer = value; }
  void PushText(uint64_t size) {
    const std::string_view text = Take(size);
    Push(Kind::kString).text = text;
  }
  void PushTuple(std::vector<Ref> items) { Push(Kind::kTuple).items = std::move(items); }

  // What lies above the last mark may be taken, nothing below.
  Ref Pop() {
    if (stack_.size() <= (marks_.empty() ? 0 : marks_.back())) Fail("takes a value where none is left");
    const Ref top = stack_.back();
    stack_.pop_back();
    return top;
  }

  std::vector<Ref> PopCount(size_t count) {
    std::vector<Ref> items(count);
    for (size_t i = count; i > 0; --i) items[i - 1] = Pop();
    return items;
  }

  std::vector<Ref> PopToMark() {
    if (marks_.empty()) Fail("takes values up to a mark where there is none");
    const auto mark = stack_.begin() + static_cast<ptrdiff_t>(marks_.back());
    std::vector<Ref> items(mark, stack_.end());
    stack_.erase(mark, stack_.end());
    marks_.pop_back();
    return items;
  }

  Node& Top() {
    if (stack_.size() <= (marks_.empty() ? 0 : marks_.back())) Fail("uses a value where none is left");
    return result_.nodes_[stack_.back()];
  }

  void AddItems(const std::vector<Ref>& items) {
    Node& list = Top();
    if (list.kind != Kind::kList) Fail("adds items to what is no list");
    list.items.insert(list.items.end(), items.begin(), items.end());
  }

  void AddPairs(const std::vector<Ref>& items) {
    Node& dict = Top();
    if (dict.kind != Kind::kDict && dict.kind != Kind::kCall) Fail("adds entries to what is no dictionary");
    if (items.size() % 2 != 0) Fail("adds a key without a value");
    for (size_t i = 0; i < items.size(); i += 2) dict.pairs.emplace_back(items[i], items[i + 1]);
  }

  void PushGlobal(std::string_view module, std::string_view name) {
    if (module.size() + name.size() > kLongestName) Fail("names something by a word of more than 256 letters");
    std::string text = fmt::format("{} {}", module, name);
    Push(Kind::kGlobal).text = std::move(text);
  }

  void Remember(uint64_t index) {
    Top();
    memo_[index] = stack_.back();
  }

  void Recall(uint64_t index) {
    const auto found = memo_.find(index);
    if (found == memo_.end()) Fail(fmt::format("recalls value {}, which was not remembered", index));
    stack_.push_back(found->second);
  }

  void Real() {
    uint64_t bits = 0;
    for (const char byte : Take(8)) bits = bits << 8 | static_cast<uint8_t>(byte);  // big-endian, unlike all else
    std::memcpy(&Push(Kind::kReal).real, &bits, sizeof(bits));
  }

  // Two's complement of up to eight bytes.
  void LongInteger() {
    const int bytes = static_cast<int>(Unsigned(1));
    if (bytes > 8) Fail("an integer has more than 8 bytes");
    uint64_t value = bytes == 0 ? 0 : Unsigned(bytes);
    if (bytes > 0 && bytes < 8 && (value >> (8 * bytes - 1)) != 0) value |= ~uint64_t{0} << (8 * bytes);
    PushInteger(static_cast<int64_t>(value));
  }

  void Step(uint8_t opcode) {
    switch (opcode) {
      case 0x80:  // PROTO
        if (const uint64_t version = Unsigned(1); version < 2 || version > 5) {
          Fail(fmt::format("is of protocol {}; expected 2 to 5", version));
        }
        return;
      case 0x95:  // FRAME
        Take(8);
        return;
      case '.':  // STOP
        result_.root_ = Pop();
        stopped_ = true;
        return;
      case '(':  // MARK
        marks_.push_back(stack_.size());
        return;
      case '0':  // POP
        Pop();
        return;
      case '1':  // POP_MARK
        PopToMark();
        return;

      case 'N':  // NONE
        Push(Kind::kNone);
        return;
      case 0x88:  // NEWTRUE
      case 0x89:  // NEWFALSE
        Push(Kind::kBool).integer = opcode == 0x88 ? 1 : 0;
        return;
      case 'K':  // BININT1
        return PushInteger(static_cast<int64_t>(Unsigned(1)));
      case 'M':  // BININT2
        return PushInteger(static_cast<int64_t>(Unsigned(2)));
      case 'J':  // BININT
        return PushInteger(static_cast<int32_t>(Unsigned(4)));
      case 0x8a:  // LONG1
        return LongInteger();
      case 'G':  // BINFLOAT
        return Real();
      case 0x8c:  // SHORT_BINUNICODE
        return PushText(Unsigned(1));
      case 'X':  // BINUNICODE
        return PushText(Unsigned(4));
      case 0x8d:  // BINUNICODE8
        return PushText(Unsigned(8));

      case ')':  // EMPTY_TUPLE
        return PushTuple({});
      case 0x85:  // TUPLE1
      case 0x86:  // TUPLE2
      case 0x87:  // TUPLE3
        return PushTuple(PopCount(opcode - 0x84));
      case 't':  // TUPLE
        return PushTuple(PopToMark());
      case ']':  // EMPTY_LIST
        Push(Kind::kList);
        return;
      case 'a':  // APPEND
        return AddItems(PopCount(1));
      case 'e':  // APPENDS
        return AddItems(PopToMark());
      case '}':  // EMPTY_DICT
        Push(Kind::kDict);
        return;
      case 's':  // SETITEM
        return AddPairs(PopCount(2));
      case 'u':  // SETITEMS
        return AddPairs(PopToMark());

      case 'q':  // BINPUT
        return Remember(Unsigned(1));
      case 'r':  // LONG_BINPUT
        return Remember(Unsigned(4));
      case 0x94:  // MEMOIZE
        return Remember(memo_.size());
      case 'h':  // BINGET
        return Recall(Unsigned(1));
      case 'j':  // LONG_BINGET
        return Recall(Unsigned(4));

      case 'c': {  // GLOBAL
        const std::string_view module = Line();
        return PushGlobal(module, Line());
      }
      case 0x93: {  // STACK_GLOBAL
        const std::vector<Ref> names = PopCount(2);
        return PushGlobal(result_.nodes_[names[0]].text, result_.nodes_[names[1]].text);
      }
      case 'R': {  // REDUCE
        std::vector<Ref> call = PopCount(2);
        Push(Kind::kCall).items = std::move(call);
        return;
      }
      case 'b':  // BUILD: attributes of the object below, which no tensor needs
        Pop();
        Top();
        return;
      case 'Q': {  // BINPERSID
        std::vector<Ref> identifier = PopCount(1);
        Push(Kind::kPersistent).items = std::move(identifier);
        return;
      }
      default:
        Fail(fmt::format("holds the opcode 0x{:02x}, which PyTorch does not write for tensors", opcode));
    }
  }

  const std::filesystem::path& path_;
  const std::string_view bytes_;
  uint64_t at_ = 0;
  uint64_t opcode_at_ = 0;
  bool stopped_ = false;
  std::vector<Ref> stack_;
  std::vector<size_t> marks_;  // heights of the stack
  std::unordered_map<uint64_t, Ref> memo_;
  Pickle result_;
};

Pickle Pickle::Parse(const std::filesystem::path& path, std::string_view bytes) {
  return PickleMachine(path, bytes).Run();
}

std::optional<std::vector<Pickle::Ref>> Pickle::ArgumentsOf(const Node& node, std::string_view callee) const {
  if (node.kind != Kind::kCall) return std::nullopt;
  const Node &function = at(node.items[0]), &arguments = at(node.items[1]);
  if (function.kind != Kind::kGlobal || function.text != callee || arguments.kind != Kind::kTuple) return std::nullopt;
  return arguments.items;
}

}  // namespace likeness

// Reads the pickles that PyTorch writes, as data: nothing in them is looked up, called or executed.
//
// A pickle is a program for a small stack machine whose result is an object. This interpreter knows the opcodes that
// torch.save uses (protocols 2 to 5) and records what the program would have called; whoever reads the result decides
// which names mean something. An opcode that it does not know is an error.

#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace likeness {

class Pickle {
 public:
  // A value's place among the nodes; containers refer to others, or, in a hostile pickle, to themselves: walk no deeper
  // than the data that you expect.
  using Ref = int;

  enum class Kind {
    kNone,
    kBool,        // integer
    kInteger,     // integer
    kReal,        // real
    kString,      // text
    kTuple,       // items
    kList,        // items
    kDict,        // pairs
    kGlobal,      // text: "module name"
    kCall,        // items: what is called, then its arguments as a tuple; pairs and items may have been added since
    kPersistent,  // items: the identifier of something outside of the pickle
  };

  struct Node {
    Kind kind = Kind::kNone;
    int64_t integer = 0;
    double real = 0;
    std::string text;
    std::vector<Ref> items;
    std::vector<std::pair<Ref, Ref>> pairs;  // of a dict, or of a call that makes one, in the order of writing
  };

  // `path` is for error messages only. Throws Error naming path and byte for an unknown opcode, a pickle that is cut
  // off or inconsistent, and one of more than a million values.
  static Pickle Parse(const std::filesystem::path& path, std::string_view bytes);

  const Node& root() const { return nodes_[root_]; }
  const Node& at(Ref ref) const { return nodes_[ref]; }

  // The arguments of a call of "module name"; none for any other node.
  std::optional<std::vector<Ref>> ArgumentsOf(const Node& node, std::string_view callee) const;

 private:
  friend class PickleMachine;
  std::vector<Node> nodes_;
  Ref root_ = 0;
};

}  // namespace likeness

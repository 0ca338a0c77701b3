// Protocol buffers' wire format, written: a message is a row of fields, each a number and a value. The library of that
// name is not used: LibTorch brings another version of it into the same program.
// https://protobuf.dev/programming-guides/encoding/

#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>

namespace likeness {

class ProtoMessage {
 public:
  void Int(int field, int64_t value);
  void Float(int field, float value);
  void Bytes(int field, std::string_view bytes);  // text, too
  void Message(int field, const ProtoMessage& message) { Bytes(field, message.bytes_); }

  // A message and one more bytes field at its end, without another copy of these in memory.
  void MessageWithBytes(int field, const ProtoMessage& start, int last_field, std::string_view last);

  const std::string& bytes() const { return bytes_; }
  std::string TakeBytes() { return std::move(bytes_); }

 private:
  void Number(uint64_t value);
  void Tag(int field, int wire_type) { Number(static_cast<uint64_t>(field) << 3 | static_cast<uint64_t>(wire_type)); }

  std::string bytes_;
};

}  // namespace likeness

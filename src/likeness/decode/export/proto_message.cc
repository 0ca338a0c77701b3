#include "likeness/decode/export/proto_message.h"

namespace likeness {
namespace {

enum WireType { kVarint = 0, kLengthDelimited = 2, kFixed32 = 5 };

}  // namespace

// Seven bits a byte, the lowest first; all but the last have the eighth bit set.
void ProtoMessage::Number(uint64_t value) {
  for (; value >= 0x80; value >>= 7) bytes_ += static_cast<char>(value | 0x80);
  bytes_ += static_cast<char>(value);
}

void ProtoMessage::Int(int field, int64_t value) {
  Tag(field, kVarint);
  Number(static_cast<uint64_t>(value));
}

void ProtoMessage::Float(int field, float value) {
  Tag(field, kFixed32);
  bytes_.append(reinterpret_cast<const char*>(&value), sizeof(value));
}

void ProtoMessage::Bytes(int field, std::string_view bytes) {
  Tag(field, kLengthDelimited);
  Number(bytes.size());
  bytes_ += bytes;
}

void ProtoMessage::MessageWithBytes(int field, const ProtoMessage& start, int last_field, std::string_view last) {
  ProtoMessage head = start;
  head.Tag(last_field, kLengthDelimited);
  head.Number(last.size());
  Tag(field, kLengthDelimited);
  Number(head.bytes_.size() + last.size());
  bytes_ += head.bytes_;
  bytes_ += last;
}

}  // namespace likeness

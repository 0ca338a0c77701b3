#include "likeness/train/tensorboard.h"

#include <unistd.h>

#include <array>
#include <bit>
#include <chrono>
#include <cstring>

#include "likeness/base/error.h"
#include "likeness/image/image_io.h"

namespace likeness {

namespace {

// Protocol-buffer wire types.
enum class Wire : uint32_t { kVarint = 0, kFixed64 = 1, kBytes = 2, kFixed32 = 5 };

// Builds one message, field by field.
class Message {
 public:
  Message& Integer(uint32_t field, uint64_t value) {
    Key(field, Wire::kVarint);
    Varint(value);
    return *this;
  }
  Message& Double(uint32_t field, double value) {
    Key(field, Wire::kFixed64);
    Raw(std::bit_cast<uint64_t>(value));
    return *this;
  }
  Message& Float(uint32_t field, float value) {
    Key(field, Wire::kFixed32);
    Raw(std::bit_cast<uint32_t>(value));
    return *this;
  }
  Message& Bytes(uint32_t field, std::string_view bytes) {
    Key(field, Wire::kBytes);
    Varint(bytes.size());
    text_.append(bytes);
    return *this;
  }
  const std::string& text() const { return text_; }

 private:
  void Key(uint32_t field, Wire wire) { Varint(field << 3 | static_cast<uint32_t>(wire)); }
  void Varint(uint64_t value) {
    for (; value >= 0x80; value >>= 7) text_.push_back(static_cast<char>(value | 0x80));
    text_.push_back(static_cast<char>(value));
  }
  template <typename T>
  void Raw(T value) {
    char bytes[sizeof(T)];
    std::memcpy(bytes, &value, sizeof(T));
    text_.append(bytes, sizeof(T));
  }

  std::string text_;
};

double WallTime() { return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count(); }

// tensorflow.Event: wall_time = 1, step = 2, file_version = 3, summary = 5.
Message Event(int64_t step) {
  Message event;
  event.Double(1, WallTime()).Integer(2, static_cast<uint64_t>(step));
  return event;
}

}  // namespace

TensorBoardWriter::TensorBoardWriter(const std::filesystem::path& folder) {
  std::error_code code;
  std::filesystem::create_directories(folder, code);
  char host[256] = "";
  gethostname(host, sizeof(host) - 1);
  path_ = folder / fmt::format("events.out.tfevents.{}.{}.{}", static_cast<int64_t>(WallTime()), host, getpid());
  out_.open(path_, std::ios::binary | std::ios::app);
  if (!out_) throw FileError(path_, fmt::format("cannot be written: {}", std::strerror(errno)));
  WriteRecord(Message().Double(1, WallTime()).Bytes(3, "brain.Event:2").text());
}

void TensorBoardWriter::WriteScalars(int64_t step, const std::vector<std::pair<std::string, double>>& scalars) {
  // tensorflow.Summary: value = 1; Summary.Value: tag = 1, simple_value = 2.
  Message summary;
  for (const auto& [tag, value] : scalars) {
    summary.Bytes(1, Message().Bytes(1, tag).Float(2, static_cast<float>(value)).text());
  }
  WriteRecord(Event(step).Bytes(5, summary.text()).text());
}

void TensorBoardWriter::WriteImage(int64_t step, const std::string& tag, const ImageU8& image) {
  // Summary.Value: image = 4; Summary.Image: height = 1, width = 2, colorspace = 3, encoded_image_string = 4.
  Message picture;
  picture.Integer(1, static_cast<uint64_t>(image.height()))
      .Integer(2, static_cast<uint64_t>(image.width()))
      .Integer(3, static_cast<uint64_t>(image.channels()))
      .Bytes(4, EncodePng(image));
  const Message value = Message().Bytes(1, tag).Bytes(4, picture.text());
  WriteRecord(Event(step).Bytes(5, Message().Bytes(1, value.text()).text()).text());
}

void TensorBoardWriter::WriteRecord(std::string_view bytes) {
  const uint64_t length = bytes.size();
  const std::string_view length_bytes(reinterpret_cast<const char*>(&length), sizeof(length));
  const uint32_t length_crc = MaskedCrc32c(length_bytes), crc = MaskedCrc32c(bytes);
  out_.write(length_bytes.data(), sizeof(length));
  out_.write(reinterpret_cast<const char*>(&length_crc), sizeof(length_crc));
  out_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  out_.write(reinterpret_cast<const char*>(&crc), sizeof(crc));
  out_.flush();
  if (!out_) throw FileError(path_, fmt::format("cannot be written: {}", std::strerror(errno)));
}

uint32_t Crc32c(std::string_view bytes) {
  static const std::array<uint32_t, 256> table = [] {
    std::array<uint32_t, 256> rows{};
    for (uint32_t i = 0; i < 256; ++i) {
      uint32_t value = i;
      for (int bit = 0; bit < 8; ++bit) value = value >> 1 ^ ((value & 1) != 0 ? 0x82f63b78u : 0);
      rows[i] = value;
    }
    return rows;
  }();
  uint32_t crc = 0xffffffffu;
  for (const char byte : bytes) crc = crc >> 8 ^ table[(crc ^ static_cast<uint8_t>(byte)) & 0xff];
  return ~crc;
}

uint32_t MaskedCrc32c(std::string_view bytes) {
  const uint32_t crc = Crc32c(bytes);
  return (crc >> 15 | crc << 17) + 0xa282ead8u;
}

}  // namespace likeness

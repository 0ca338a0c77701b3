#include "fuzz.h"
#include "likeness/avatar/safetensors.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  CheckRoundTrip(
      bytes, [](std::string_view text) { return SafetensorsFile(kPath, std::string(text)); },
      [](const SafetensorsFile& file) {
        std::vector<TensorView> tensors;
        for (const std::string& name : file.names()) {
          tensors.push_back({name, file.DTypeOf(name), file.ShapeOf(name), file.Bytes(name)});
          Parsed([&] { return file.Floats(name, {-1, 3}); });
          Parsed([&] { return file.Integers(name, file.ShapeOf(name)); });
        }
        std::string written = SafetensorsHeader(tensors, file.metadata());
        for (const TensorView& tensor : tensors) {
          written.append(reinterpret_cast<const char*>(tensor.bytes.data()), tensor.bytes.size());
        }
        return written;
      });
}

}  // namespace likeness

// Avatar files whose header is any text and whose data are zeros.

#include "fuzz.h"
#include "likeness/avatar/avatar.h"
#include "zero_tensors.h"

namespace likeness {

void fuzz::Run(std::string_view bytes) {
  const auto avatar = Parsed([&] { return AvatarFrom(SafetensorsFile(kPath, WithZeroTensors(bytes))); });
  if (avatar) avatar->Check(kPath);
}

}  // namespace likeness

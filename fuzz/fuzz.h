// What the fuzz targets share.
//
// The contract of every parser: bytes give a value that passes its own checks, or an Error that names the file.
// Anything else ends the process, and the fuzzer keeps the bytes: another exception, a LIKENESS_CHECK that does not
// hold, a sanitizer's report, more than a few seconds, more than 512 MB.

#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "likeness/base/error.h"

namespace likeness::fuzz {

// A target defines this: feeds the parser and checks what comes out.
void Run(std::string_view bytes);

inline constexpr char kPath[] = "FILE";

// What `parse` returns; none when it throws an Error, which must begin with the file's name.
template <typename Parse>
auto Parsed(const Parse& parse) -> std::optional<decltype(parse())> {
  try {
    return parse();
  } catch (const Error& error) {
    LIKENESS_CHECK(std::string_view(error.what()).starts_with(kPath));
    return std::nullopt;
  }
}

// Checks that what was parsed from `bytes`, written and parsed again, is written the same.
template <typename Parse, typename Write>
void CheckRoundTrip(std::string_view bytes, const Parse& parse, const Write& write) {
  const auto value = Parsed([&] { return parse(bytes); });
  if (!value) return;
  const std::string written = write(*value);
  LIKENESS_CHECK(write(parse(written)) == written);
}

}  // namespace likeness::fuzz

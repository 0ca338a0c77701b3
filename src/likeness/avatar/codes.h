// Which of an avatar's codes to show.

#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "likeness/avatar/avatar.h"

namespace likeness {

// Mean of the codes of a person's frames, a face at rest; zeros, where training put the middle, when there are none.
std::vector<float> MeanCode(const Avatar& avatar, int identity = 0);

// The code that `name` means: "mean" (of the person's), a number from 0 (the avatar's codes in their order),
// "SEGMENT/FRAME" (the person's where there is such a frame, otherwise the first one's who has it), or
// "PERSON/SEGMENT/FRAME". Throws Error that says what there is for anything else.
struct NamedCode {
  std::vector<float> mu;             // [latent]
  const FrameCode* frame = nullptr;  // none for the mean
};
NamedCode FindCode(const Avatar& avatar, const std::string& name, int identity = 0);

// Reads codes from a text file, one after another, each of as many numbers as the avatar's latent code has, parted by
// blanks, commas or lines. Throws Error with the line.
std::vector<std::vector<float>> ReadCodeSequence(const std::filesystem::path& path, int latent);
std::vector<std::vector<float>> ParseCodeSequence(const std::filesystem::path& path_for_errors, std::string text,
                                                  int latent);

// The same of a file that holds one.
std::vector<float> ReadCode(const std::filesystem::path& path, int latent);
std::vector<float> ParseCode(const std::filesystem::path& path_for_errors, std::string text, int latent);

}  // namespace likeness

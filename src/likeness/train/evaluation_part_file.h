// What one process of a shared evaluation has measured, as a file.

#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "likeness/train/evaluation_tasks.h"

namespace likeness {

// By the index of their tasks; their pictures are no part of the file.
using PartMeasurements = std::vector<std::optional<ImageMeasurement>>;

std::string PartText(const PartMeasurements& measurements);

// The measurements of an evaluation of so many images. Throws Error naming the file for anything else than PartText
// gives.
PartMeasurements ParsePart(const std::filesystem::path& path_for_errors, std::string_view text, size_t images);

}  // namespace likeness

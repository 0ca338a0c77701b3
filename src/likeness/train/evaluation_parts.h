// An evaluation that several processes share through a folder, without talking to each other.
//
// Each writes the figures of its own images to a file of its own. Whoever finds that all images have been measured has
// the result, bit for bit that of one process. A process that was interrupted or lost runs again, as the same shard or
// as one of another number, and measures what is missing.

#pragma once

#include <filesystem>
#include <optional>
#include <string>

#include "likeness/base/launcher.h"
#include "likeness/train/evaluation_tasks.h"

namespace likeness {

struct SharedEvaluation {
  std::optional<EvaluationResult> result;  // none while images are missing
  int64_t images = 0;                      // in all
  int64_t images_missing = 0;              // not measured yet by any process
};

// As Evaluate(), for the images of this shard's frames that no part in the folder holds.
//   folder  each evaluation has its own folder in there, by capture, images, options and avatar
//   avatar  stands for encoder and decoder: parts of another one are not mixed in
// On Ctrl-C it keeps what it has measured and throws Error. Also throws Error for a part that is damaged.
SharedEvaluation EvaluateTogether(const Capture& capture, const FrameEncoder& encode, const FrameDecoder& decoder,
                                  const EvaluationOptions& options, const TextureSet* textures,
                                  const std::filesystem::path& folder, const std::string& avatar, const Shard& shard);

}  // namespace likeness

#include "likeness/app/capture_flags.h"

namespace likeness {

void AddCaptureFlags(Command* command, CaptureOptions* options) {
  command->Option("split", &options->split_file,
                  "JSON with training and test cameras, perhaps held-out segments (default: CAPTURE/split.json, else "
                  "everything trains)");
  command->Option("test-segments", &options->test_segments_file,
                  "JSON with the held-out segments alone, {\"segment\": [prefix, ...]}");
  command->Option("topology", &options->topology_file,
                  "OBJ with faces and texture coordinates (default: the capture's own)");
  command->Option("ignore-distortion", &options->ignore_distortion,
                  "read cameras with lens distortion as if they had none");
}

}  // namespace likeness

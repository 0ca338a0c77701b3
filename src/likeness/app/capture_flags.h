// The flags of every verb that opens a capture.

#pragma once

#include "likeness/app/command.h"
#include "likeness/capture/capture.h"

namespace likeness {

// --split, --test-segments, --topology, --ignore-distortion
void AddCaptureFlags(Command* command, CaptureOptions* options);

}  // namespace likeness

// The flags of every verb that opens a capture.

#pragma once

#include "likeness/app/command.h"
#include "likeness/capture/capture.h"

namespace likeness {

// --split, --test-segments, --topology
void AddCaptureFlags(Command* command, CaptureOptions* options);

}  // namespace likeness

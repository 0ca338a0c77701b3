// Flags that verbs share which open captures.

#pragma once

#include <string>

#include "likeness/app/command.h"
#include "likeness/capture/capture.h"
#include "likeness/capture/selection.h"

namespace likeness {

// --split, --test-segments, --topology, --distortion
void AddCaptureFlags(Command* command, CaptureOptions* options);

// A part of a capture on the command line; lists are parted by commas.
struct SelectionFlags {
  std::string cameras, segments;
  CaptureSelection rest;  // frames, every, count

  CaptureSelection Selection() const;
};

// --cameras, --segments, --frames, --every, --count
void AddSelectionFlags(Command* command, SelectionFlags* flags);
// The same without --cameras.
void AddFrameFlags(Command* command, SelectionFlags* flags);

}  // namespace likeness

// A small head made by formula, for tests and for machines without head data. It needs no files.
//
// The tracked mesh is a grid in longitude s and latitude t, both 0 ... 1, that is also its atlas: u = s, v = t. The
// eyes' lid patches and the inside of the mouth are rectangles of that grid, so the surface has no hole. The scene
// leaves the lid patches open over eyeballs and has teeth.
//
// It answers to eyeBlink*, eyeLook*, eyeWide*, jawOpen, jawLeft, jawRight, mouthSmile*, mouthFrown*, mouthPucker,
// mouthFunnel, browInnerUp, browOuterUp*, browDown* and cheekPuff; other weights do nothing.

#pragma once

#include <memory>

#include "likeness/simulate/head.h"

namespace likeness {

struct ProceduralOptions {
  // The scene is the tracked mesh alone, with the atlas as its texture: every texel can be compared with what it should
  // be.
  bool plain = false;
  int texture_size = 512;  // texels a side, 16 to 8192
  int detail = 2;          // grid cells: 40 detail around, 36 detail up; 1 to 8
  uint64_t seed = 0;       // of the skin's pattern

  void Check() const;  // throws Error
};

std::unique_ptr<Head> MakeProceduralHead(const ProceduralOptions& options = {});

}  // namespace likeness

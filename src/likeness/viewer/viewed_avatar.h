// An avatar that is open in the viewer: the run-time decoder, and what the window wants to know besides.

#pragma once

#include <filesystem>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "likeness/decode/decoder.h"
#include "likeness/geometry/mesh.h"
#include "likeness/image/image.h"
#include "likeness/viewer/directions.h"
#include "likeness/viewer/playback.h"

namespace likeness {

struct ViewedAvatar {
  std::filesystem::path file;
  std::vector<std::string> people;  // names of all whom the file holds
  int person = 0;                   // who is shown
  std::string id;                   // AvatarId, by which performances name it
  Architecture architecture;
  MeshTopology topology;
  std::vector<float> rest;                // [latent], the mean of the person's codes
  Vertices rest_vertices;                 // of this code, mm, head space
  std::vector<Clip> clips;                // the person's training frames, a clip a segment
  std::vector<CodeDirection> directions;  // what sliders move
  ImageU8 uv_layout;                      // RGBA: the triangles' edges in the atlas, white on nothing; row 0 is v = 1
  std::unique_ptr<Decoder> decoder;       // for one thread at a time
};

// Training frames have no time stamps. Captures are recorded at about this rate, and playing has a speed.
inline constexpr double kTrainingFramesPerSecond = 30;

// Opens an avatar file, or the folder of a training run.
//   person   name of whom to show; empty: the first
//   threads  of the decoder; 0: as many as there are cores, up to 8
// Throws Error naming the file.
ViewedAvatar OpenAvatar(const std::filesystem::path& path, const std::string& person = "", int threads = 0);

// Whether a file is a performance. Throws Error when it is no safetensors file.
bool IsPerformance(const std::filesystem::path& path);

// Reads a performance of this avatar. Throws Error naming the file when it is none, or another avatar's.
Clip OpenPerformance(const std::filesystem::path& path, const ViewedAvatar& avatar);

// The code that sliders make of another one: sliders are in standard deviations, one for each direction or fewer.
std::vector<float> MovedCode(const ViewedAvatar& avatar, std::vector<float> code, std::span<const float> sliders);

}  // namespace likeness

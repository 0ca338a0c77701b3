// All that decides what the window shows. Panes and keys change it, drawing reads it; it knows no window.

#pragma once

#include <array>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include "likeness/render/mesh_style.h"
#include "likeness/viewer/decode_thread.h"
#include "likeness/viewer/orbit.h"
#include "likeness/viewer/playback.h"
#include "likeness/viewer/viewed_avatar.h"

namespace likeness {

struct ViewState {
  // The face.
  std::shared_ptr<const ViewedAvatar> avatar;  // none: the welcome
  std::vector<Clip> performances;              // that were dropped on the avatar; they follow its own clips
  int clip = -1;                               // of the avatar's clips, then the performances; -1: at rest
  Playback playback;
  bool head_moves = true;      // as the performance's head did, from where it began
  std::vector<float> sliders;  // standard deviations, one for each of the avatar's directions

  // Where it is seen from.
  Orbit orbit;
  bool stereo = false;
  double eye_distance_mm = 63;  // the usual one of adults
  bool view_dependent = true;   // the texture is decoded for each eye's view, otherwise for this one
  double fixed_azimuth_deg = 0;
  double fixed_elevation_deg = 0;

  // How it is drawn.
  MeshFill surface = MeshFill::kTexture;
  std::array<float, 3> background = {32 / 255.0f, 34 / 255.0f, 38 / 255.0f};  // RGB, 0 ... 1
  double exposure_stops = 0;

  // The window.
  bool dark = true;
  bool show_controls = true;
  bool show_help = false;
  bool show_texture = false;
  bool show_uvs = false;
  bool show_timing = false;
  std::string message;  // for the user to read and close

  // Asked for; whoever does it clears it.
  struct Wishes {
    std::filesystem::path open;  // an avatar or a performance; empty: none
    std::string person;          // of the avatar; empty: the first
    bool screenshot = false;
    bool quit = false;
  };
  Wishes wishes;

  // Another avatar: the view fits it, nothing plays, sliders are at 0.
  void Show(std::shared_ptr<const ViewedAvatar> opened);
  // Sliders at 0, at rest, from the front.
  void ResetFace();
  void ResetView();
  // Sliders at random: a face that the avatar can make and that training need not have seen.
  void RandomFace(uint64_t seed);
  // Goes to a frame, "SEGMENT/FRAME", or to a clip's first one by the clip's name, and stops there. Throws Error naming
  // the nearest one.
  void GoTo(const std::string& name);
  // Goes to the start of a clip and plays it; -1: at rest.
  void PlayClip(int index);
  // The first clip when none is chosen.
  void PlayOrPause();
  // Off: the texture stays what it is from here.
  void ToggleViewDependence();

  const Clip* CurrentClip() const;  // null at rest
  int ClipCount() const;
  const Clip& ClipAt(int index) const;
  // The frame that is shown, in words: "smile/0012 (13 of 40)"; "at rest".
  std::string FrameName() const;
};

// How the head stands: world_from_head, where the world is what the orbit is in.
RigidTransform HeadPose(const ViewState& state);

// What has to be decoded for what these eyes see. The state has an avatar.
DecodeRequest RequestFor(const ViewState& state, const std::vector<EyeView>& eyes);

}  // namespace likeness

// The desktop viewer: an avatar in a window, from all sides, alive.

#pragma once

#include <array>
#include <chrono>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "likeness/gl/functions.h"
#include "likeness/image/image.h"
#include "likeness/render/gl/canvas.h"
#include "likeness/render/gl/mesh_renderer.h"
#include "likeness/viewer/decode_thread.h"
#include "likeness/viewer/frame_times.h"
#include "likeness/viewer/layout.h"
#include "likeness/viewer/panes.h"
#include "likeness/viewer/settings.h"
#include "likeness/viewer/view_state.h"
#include "likeness/viewer/window.h"

namespace likeness {

struct ViewerOptions {
  std::filesystem::path avatar;  // file or folder; empty: the welcome
  std::string person;            // of an avatar of several people; empty: the first
  WindowOptions window;
  std::optional<std::array<int, 2>> size;  // of the window, instead of window.place's
  std::optional<bool> dark;                // none: as the last time
  int samples = 4;                         // a pixel, for smooth edges
  ViewState state;                         // to begin with; has no avatar
  // Called once, when the first avatar is open and shown: what of the state depends on it.
  std::function<void(ViewState*)> opened;
  std::vector<std::filesystem::path> recent;  // avatars for the welcome

  void Check() const;  // throws Error
};

class Viewer {
 public:
  explicit Viewer(const ViewerOptions& options);

  // Takes events and draws once. False when the user has closed the window.
  //   picture  gets the whole window, RGB, where it is not null
  bool Frame(ImageU8* picture = nullptr);

  // Whether the window shows what the state says: nothing is being opened or decoded.
  bool Settled() const;

  ViewState& state() { return state_; }
  const Window& window() const { return window_; }
  const std::vector<std::filesystem::path>& opened_files() const { return opened_files_; }
  // Where the face is drawn, and what its eyes see. Framebuffer's pixels from the top left.
  Box FaceBox() const;
  std::vector<EyeView> FaceEyes() const;
  const DecodedViews& shown() const { return shown_; }

 private:
  using Clock = std::chrono::steady_clock;

  // All that decides how the face looks; drawn again when it changes.
  struct Drawn {
    Orbit orbit;
    bool stereo = false;
    double eye_distance_mm = 0, exposure_stops = 0;
    MeshFill surface = MeshFill::kTexture;
    std::array<float, 3> background = {};
    int width = 0, height = 0, face = 0;
    Eigen::Matrix3d head_rotation = Eigen::Matrix3d::Identity();
    Eigen::Vector3d head_translation = Eigen::Vector3d::Zero();

    bool operator==(const Drawn&) const = default;
  };

  double WaitS() const;
  void Listen(const WindowInput& input);
  void FulfilWishes();
  void Open(const std::filesystem::path& path, const std::string& person);
  void TakeNews();
  void Advance();
  void AskForFace();
  void UploadFace();
  void DrawFace();
  void DrawPanes();
  void SavePicture();
  WindowLayout CurrentLayout() const;
  // Milliseconds since the last call; with the frame-time graph on, the device is waited for.
  double Lap();

  const ViewerOptions options_;
  Window window_;
  GlFunctions gl_;
  ViewState state_;
  std::vector<std::filesystem::path> opened_files_, recent_;
  std::string typed_path_;
  bool opened_once_ = false;

  GlMeshRenderer renderer_;
  std::array<GlTextureStream, 2> textures_;
  GlTextureStream uv_layout_;
  std::optional<GlCanvas> canvas_;
  Drawn drawn_;

  DecodeRequest asked_;
  std::shared_ptr<const ViewedAvatar> asked_avatar_;
  DecodedViews shown_;
  std::shared_ptr<const ViewedAvatar> uploaded_avatar_;  // whose topology the renderer has
  int faces_ = 0;                                        // that were uploaded

  FrameTimes times_;
  FrameTime now_;
  Clock::time_point frame_began_ = Clock::now(), lap_began_ = Clock::now();
  int idle_frames_ = 0;

  DecodeThread decoding_;  // last: it ends first
};

// Until the user closes the window. The window stands as it did the last time, and its settings are kept.
void RunViewer(ViewerOptions options);

// One frame of the window as a picture, without the settings. Throws Error where the avatar cannot be shown.
ImageU8 DrawViewer(const ViewerOptions& options);

}  // namespace likeness

// Opening and decoding avatars beside the window, which never waits.

#pragma once

#include <condition_variable>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <thread>
#include <vector>

#include "likeness/viewer/viewed_avatar.h"

namespace likeness {

// What to decode.
struct DecodeRequest {
  std::vector<float> code;                     // [latent]
  std::vector<Eigen::Vector3f> views_in_head;  // one or two unit directions from the head's centre

  bool operator==(const DecodeRequest&) const = default;
};

struct DecodedViews {
  DecodeRequest request;
  std::shared_ptr<const ViewedAvatar> avatar;  // whose face it is
  Vertices vertices_in_head;                   // mm
  std::vector<std::vector<uint8_t>> textures;  // RGBA, one for each view, row 0 is v = 1
  double decode_ms = 0;
};

// Decodes at once, into *views.
void DecodeFace(const std::shared_ptr<const ViewedAvatar>& avatar, const DecodeRequest& request, DecodedViews* views);

class DecodeThread {
 public:
  // `ready` is called on the thread whenever there is something to take.
  explicit DecodeThread(std::function<void()> ready);
  ~DecodeThread();  // waits for what is being done
  DecodeThread(const DecodeThread&) = delete;
  DecodeThread& operator=(const DecodeThread&) = delete;

  // Each of these returns at once. Of several, the last one is carried out and the others are forgotten.
  void Open(const std::filesystem::path& path, const std::string& person);
  void Decode(std::shared_ptr<const ViewedAvatar> avatar, DecodeRequest request);

  // The avatar that was opened; null when there is nothing new.
  std::shared_ptr<const ViewedAvatar> TakeOpened();
  // False when there is nothing new; otherwise *views is exchanged, so that its memory serves again.
  bool TakeViews(DecodedViews* views);
  // Why something could not be done; empty when there is nothing new.
  std::string TakeError();

  // Whether something is waiting, is being done, or is to be taken.
  bool Busy() const;

 private:
  struct FileToOpen {
    std::filesystem::path path;
    std::string person;
  };
  struct FaceToDecode {
    std::shared_ptr<const ViewedAvatar> avatar;
    DecodeRequest request;
  };

  void Run();
  void Work(std::unique_lock<std::mutex>* lock, DecodedViews* views);

  const std::function<void()> ready_;
  mutable std::mutex mutex_;
  std::condition_variable wake_;
  bool stop_ = false;
  bool working_ = false;
  std::optional<FileToOpen> file_;
  std::optional<FaceToDecode> face_;
  std::shared_ptr<const ViewedAvatar> opened_;
  std::string error_;
  bool has_views_ = false;
  DecodedViews views_;
  std::thread thread_;  // last: starts when all else is there
};

}  // namespace likeness

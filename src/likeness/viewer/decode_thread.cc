#include "likeness/viewer/decode_thread.h"

#include <algorithm>
#include <chrono>
#include <exception>
#include <utility>

namespace likeness {

void DecodeFace(const std::shared_ptr<const ViewedAvatar>& avatar, const DecodeRequest& request, DecodedViews* views) {
  const auto begin = std::chrono::steady_clock::now();
  const auto row_bytes = static_cast<int64_t>(avatar->architecture.texture_size) * 4;
  views->request = request;
  views->avatar = avatar;
  views->vertices_in_head.resize(avatar->topology.vertex_count, 3);
  views->textures.resize(request.views_in_head.size());
  std::vector<Decoder::View> targets(views->textures.size());
  for (size_t v = 0; v < targets.size(); ++v) {
    views->textures[v].resize(static_cast<size_t>(row_bytes) * avatar->architecture.texture_size);
    std::copy_n(request.views_in_head[v].data(), 3, targets[v].direction);
    targets[v].pixels = views->textures[v].data();
    targets[v].row_bytes = row_bytes;
  }
  avatar->decoder->Decode(request.code, targets, {views->vertices_in_head.data()});
  const std::chrono::duration<double, std::milli> elapsed = std::chrono::steady_clock::now() - begin;
  views->decode_ms = elapsed.count();
}

DecodeThread::DecodeThread(std::function<void()> ready) : ready_(std::move(ready)), thread_([this] { Run(); }) {}

DecodeThread::~DecodeThread() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  wake_.notify_one();
  thread_.join();
}

void DecodeThread::Open(const std::filesystem::path& path, const std::string& person) {
  {
    const std::lock_guard lock(mutex_);
    file_ = {path, person};
  }
  wake_.notify_one();
}

void DecodeThread::Decode(std::shared_ptr<const ViewedAvatar> avatar, DecodeRequest request) {
  {
    const std::lock_guard lock(mutex_);
    face_ = {std::move(avatar), std::move(request)};
  }
  wake_.notify_one();
}

std::shared_ptr<const ViewedAvatar> DecodeThread::TakeOpened() {
  const std::lock_guard lock(mutex_);
  return std::exchange(opened_, nullptr);
}

std::string DecodeThread::TakeError() {
  const std::lock_guard lock(mutex_);
  return std::exchange(error_, "");
}

bool DecodeThread::TakeViews(DecodedViews* views) {
  const std::lock_guard lock(mutex_);
  if (!has_views_) return false;
  std::swap(*views, views_);
  has_views_ = false;
  return true;
}

bool DecodeThread::Busy() const {
  const std::lock_guard lock(mutex_);
  const bool to_take = opened_ != nullptr || has_views_ || !error_.empty();
  return working_ || file_.has_value() || face_.has_value() || to_take;
}

void DecodeThread::Run() {
  DecodedViews views;
  std::unique_lock lock(mutex_);
  while (true) {
    wake_.wait(lock, [&] { return stop_ || file_.has_value() || face_.has_value(); });
    if (stop_) return;
    working_ = true;
    try {
      Work(&lock, &views);
    } catch (const std::exception& error) {  // for the window to say
      if (!lock.owns_lock()) lock.lock();
      error_ = error.what();
    }
    working_ = false;
    lock.unlock();
    ready_();
    lock.lock();
  }
}

void DecodeThread::Work(std::unique_lock<std::mutex>* lock, DecodedViews* views) {
  if (file_.has_value()) {
    const FileToOpen file = *std::exchange(file_, std::nullopt);
    lock->unlock();
    auto opened = std::make_shared<const ViewedAvatar>(OpenAvatar(file.path, file.person));
    lock->lock();
    opened_ = std::move(opened);
    return;
  }
  const FaceToDecode face = *std::exchange(face_, std::nullopt);
  lock->unlock();
  DecodeFace(face.avatar, face.request, views);
  lock->lock();
  std::swap(*views, views_);
  has_views_ = true;
}

}  // namespace likeness

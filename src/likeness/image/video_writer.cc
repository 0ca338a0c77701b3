#include "likeness/image/video_writer.h"

#include <fmt/format.h>
#include <signal.h>
#include <spawn.h>
#include <sys/socket.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <sstream>
#include <vector>

#include "likeness/base/error.h"

namespace likeness {
namespace {

namespace fs = std::filesystem;

bool OnThePath(const char* program) {
  const char* variable = std::getenv("PATH");
  std::istringstream folders(variable == nullptr ? "" : variable);
  for (std::string folder; std::getline(folders, folder, ':');) {
    if (access((fs::path(folder) / program).c_str(), X_OK) == 0) return true;
  }
  return false;
}

}  // namespace

VideoWriter::VideoWriter(const fs::path& path, double frames_per_s)
    : path_(path),
      temporary_(path.parent_path() /
                 fmt::format(".{}.{}.partial{}", path.stem().string(), getpid(), path.extension().string())),
      frames_per_s_(frames_per_s) {
  if (!OnThePath("ffmpeg")) {
    throw Error(
        "{}: videos are written by the program ffmpeg, which is not on the PATH; install it (Debian and Ubuntu: apt "
        "install ffmpeg), or ask for pictures instead",
        path.string());
  }
  if (path.extension().empty()) throw FileError(path, "needs an ending that names its format, such as .mp4");
  std::error_code code;
  if (path.has_parent_path()) fs::create_directories(path.parent_path(), code);
  if (code) throw FileError(path.parent_path(), "cannot make this folder: " + code.message());
}

VideoWriter::~VideoWriter() {
  if (frames_in_ >= 0) close(frames_in_);
  if (process_ > 0) {
    kill(process_, SIGKILL);
    waitpid(process_, nullptr, 0);
  }
  if (words_ != nullptr) fclose(words_);
  std::error_code ignored;
  fs::remove(temporary_, ignored);
}

void VideoWriter::Start(int width, int height) {
  width_ = width;
  height_ = height;
  words_ = std::tmpfile();
  int ends[2] = {-1, -1};
  // A socket, so that writing to a process that has ended is an error and no signal.
  if (words_ == nullptr || socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends) != 0) {
    throw FileError(path_, fmt::format("ffmpeg cannot be started: {}", std::strerror(errno)));
  }
  frames_in_ = ends[0];
  std::vector<std::string> arguments = {"ffmpeg",
                                        "-nostdin",
                                        "-hide_banner",
                                        "-loglevel",
                                        "error",
                                        "-y",
                                        "-f",
                                        "rawvideo",
                                        "-pixel_format",
                                        "rgb24",
                                        "-video_size",
                                        fmt::format("{}x{}", width / 2 * 2, height / 2 * 2),
                                        "-framerate",
                                        fmt::format("{}", frames_per_s_),
                                        "-i",
                                        "pipe:0",
                                        "-an",
                                        "-crf",
                                        "18",
                                        "-pix_fmt",
                                        "yuv420p",
                                        "file:" + temporary_.string()};
  std::vector<char*> argv;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[1], STDIN_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(words_), STDOUT_FILENO);
  posix_spawn_file_actions_adddup2(&actions, fileno(words_), STDERR_FILENO);
  // In a group of its own, so that Ctrl-C is ours to answer.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
  const int error = posix_spawnp(&process_, "ffmpeg", &actions, &attributes, argv.data(), environ);
  posix_spawnattr_destroy(&attributes);
  posix_spawn_file_actions_destroy(&actions);
  close(ends[1]);
  if (error != 0) {
    process_ = -1;
    throw FileError(path_, fmt::format("ffmpeg cannot be started: {}", std::strerror(error)));
  }
}

void VideoWriter::Write(const ImageU8& picture) {
  LIKENESS_CHECK(picture.channels() == 3 && picture.width() > 1 && picture.height() > 1);
  if (process_ < 0) Start(picture.width(), picture.height());
  LIKENESS_CHECK(picture.width() == width_ && picture.height() == height_);
  for (int y = 0; y < height_ / 2 * 2; ++y) {
    const auto* bytes = picture.row(y);
    for (size_t left = static_cast<size_t>(width_ / 2 * 2) * 3; left > 0;) {
      const ssize_t now = send(frames_in_, bytes, left, MSG_NOSIGNAL);
      if (now < 0 && errno == EINTR) continue;
      if (now <= 0) Fail();
      bytes += now;
      left -= static_cast<size_t>(now);
    }
  }
}

void VideoWriter::Finish() {
  LIKENESS_CHECK(process_ > 0);
  close(frames_in_);
  frames_in_ = -1;
  int status = 0;
  while (waitpid(process_, &status, 0) < 0 && errno == EINTR) {
  }
  process_ = -1;
  std::error_code code;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || !fs::exists(temporary_, code)) Fail();
  fs::rename(temporary_, path_, code);
  if (code) throw FileError(path_, "cannot be written: " + code.message());
}

void VideoWriter::Fail() {
  if (process_ > 0) {
    // It has closed its end; what it has to say comes with its end.
    close(frames_in_);
    frames_in_ = -1;
    while (waitpid(process_, nullptr, 0) < 0 && errno == EINTR) {
    }
    process_ = -1;
  }
  std::string words(1000, '\0');
  std::rewind(words_);
  words.resize(std::fread(words.data(), 1, words.size(), words_));
  while (!words.empty() && words.back() == '\n') words.pop_back();
  throw FileError(path_, fmt::format("no video was written; ffmpeg {}",
                                     words.empty() ? "ended without a word" : fmt::format("says: {}", words)));
}

}  // namespace likeness

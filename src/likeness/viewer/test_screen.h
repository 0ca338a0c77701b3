// A screen that nobody sees, and somebody's hands on its mouse and keyboard, for tests.

#pragma once

#include <fcntl.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <array>
#include <cstdlib>
#include <string>

namespace likeness {

// An Xvfb of its own, named by DISPLAY while it lives.
class TestScreen {
 public:
  static bool Available() { return std::system("command -v Xvfb >/dev/null && command -v xdotool >/dev/null") == 0; }

  TestScreen() {
    std::array<int, 2> ends = {};
    if (pipe(ends.data()) != 0) return;
    std::string number_to = std::to_string(ends[1]);
    // It would begin anew, and refuse connections meanwhile, whenever its last client leaves.
    std::string program = "Xvfb", display = "-displayfd", stay = "-noreset", screen = "-screen", zero = "0",
                size = "1400x1000x24";
    std::array<char*, 8> arguments = {program.data(), display.data(), number_to.data(), stay.data(),
                                      screen.data(),  zero.data(),    size.data(),      nullptr};
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, "/dev/null", O_WRONLY, 0);
    if (posix_spawnp(&process_, "Xvfb", &actions, nullptr, arguments.data(), environ) != 0) process_ = 0;
    posix_spawn_file_actions_destroy(&actions);
    close(ends[1]);
    std::string number;
    for (char c = 0; read(ends[0], &c, 1) == 1 && c != '\n';) number += c;
    close(ends[0]);
    setenv("DISPLAY", (":" + number).c_str(), 1);
  }
  ~TestScreen() {
    if (process_ == 0) return;
    kill(process_, SIGTERM);
    waitpid(process_, nullptr, 0);
  }
  TestScreen(const TestScreen&) = delete;
  TestScreen& operator=(const TestScreen&) = delete;

  // xdotool's commands, one after another.
  void Do(const std::string& commands) const { std::system(("xdotool " + commands).c_str()); }

 private:
  pid_t process_ = 0;
};

}  // namespace likeness

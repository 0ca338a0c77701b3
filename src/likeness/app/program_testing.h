// The program itself as a process of its own, for tests.

#pragma once

#include <sys/types.h>

#include <filesystem>
#include <map>
#include <string>
#include <vector>

namespace likeness {

// Starts it and returns at once.
//   environment  variables to add
//   log          gets stdout and stderr; the test's own when empty
pid_t StartProgram(std::vector<std::string> arguments, const std::map<std::string, std::string>& environment = {},
                   const std::filesystem::path& log = {});

// Starts another program, found by its path.
pid_t StartProcess(const std::string& program, std::vector<std::string> arguments,
                   const std::map<std::string, std::string>& environment = {}, const std::filesystem::path& log = {});

// Exit status; 128 + the signal that ended it.
int WaitFor(pid_t process);

}  // namespace likeness

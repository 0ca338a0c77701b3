#include "likeness/app/program_testing.h"

#include <fcntl.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include "likeness/base/error.h"

namespace likeness {

pid_t StartProgram(std::vector<std::string> arguments, const std::map<std::string, std::string>& environment,
                   const std::filesystem::path& log) {
  return StartProcess(LIKENESS_PROGRAM, std::move(arguments), environment, log);
}

pid_t StartProcess(const std::string& program, std::vector<std::string> arguments,
                   const std::map<std::string, std::string>& environment, const std::filesystem::path& log) {
  arguments.insert(arguments.begin(), program);
  std::vector<std::string> variables;
  for (char** variable = environ; *variable != nullptr; ++variable) variables.emplace_back(*variable);
  for (const auto& [name, value] : environment) variables.push_back(name + "=" + value);
  std::vector<char*> argv, envp;
  for (std::string& argument : arguments) argv.push_back(argument.data());
  for (std::string& variable : variables) envp.push_back(variable.data());
  argv.push_back(nullptr);
  envp.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  if (!log.empty()) {
    posix_spawn_file_actions_addopen(&actions, STDERR_FILENO, log.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0644);
    posix_spawn_file_actions_adddup2(&actions, STDERR_FILENO, STDOUT_FILENO);
  }
  pid_t process = 0;
  const int error = posix_spawn(&process, program.c_str(), &actions, nullptr, argv.data(), envp.data());
  posix_spawn_file_actions_destroy(&actions);
  LIKENESS_CHECK(error == 0);
  return process;
}

int WaitFor(pid_t process) {
  int status = 0;
  LIKENESS_CHECK(waitpid(process, &status, 0) == process);
  return WIFEXITED(status) ? WEXITSTATUS(status) : 128 + WTERMSIG(status);
}

}  // namespace likeness

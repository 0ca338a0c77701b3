// The command line of one verb: options that flags and a TOML file fill alike.

#pragma once

#include <cstdint>
#include <filesystem>
#include <stdexcept>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace likeness {

// Where an option's value goes; what stands there before parsing is the default.
using OptionTarget = std::variant<bool*, int*, int64_t*, uint64_t*, float*, double*, std::string*,
                                  std::filesystem::path*, std::vector<std::string>*>;

// A wrong command line: exit status 2.
class UsageError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// Describes a verb, then parses its arguments.
//
//   Command command("unwrap", "Turns camera images into textures.", "likeness unwrap captures/demo --size 512");
//   command.Positional("CAPTURE", &capture, "folder of the capture");
//   command.Option("size", &options.size, "texels a side");
//   if (!command.Parse(argc, argv)) return 0;   // --help was asked for and written
//
// Option names are long and kebab-case without dashes; a bool becomes --name and --no-name. Dots group keys:
// "loss.image" is --loss.image and `image` in the TOML table [loss]. A list of texts is given by naming its flag as
// often as it has texts. Flags win over --config FILE.toml. An unknown flag or key is an error that names the nearest
// known one. Every command has --config, --threads, --quiet and --help.
class Command {
 public:
  Command(std::string verb, std::string summary, std::string example);

  void Positional(std::string name, OptionTarget target, std::string help, bool required = true);
  void Option(std::string name, OptionTarget target, std::string help);
  // As Option, for a string that must be one of `choices`.
  void Choice(std::string name, std::string* target, std::vector<std::string> choices, std::string help);

  // False when --help was written to stdout. Throws UsageError for a wrong command line.
  bool Parse(int argc, const char* const* argv);
  // The same with nothing but a configuration, whose text is given.
  bool ParseConfig(const std::filesystem::path& path_for_errors, std::string_view text);

  // All options with their values, as a TOML file that --config reads back. Write it beside every output.
  std::string ResolvedToml() const;

 private:
  struct Entry {
    std::string name;
    OptionTarget target;
    std::string help;
    std::vector<std::string> choices;
    bool positional = false;
    bool required = false;
  };

  const Entry* Find(const std::string& name) const;
  void ApplyConfig(const std::filesystem::path& path_for_errors, std::string_view text);
  bool ParseArguments(std::vector<std::string> arguments);

  std::string verb_;
  std::string summary_;
  std::string example_;
  std::vector<Entry> entries_;
  std::filesystem::path config_;
  int threads_ = 0;
  bool quiet_ = false;
};

}  // namespace likeness

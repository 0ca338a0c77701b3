#include "likeness/app/command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

#include <algorithm>
#include <cstdio>

#include "likeness/base/error.h"
#include "likeness/base/file.h"
#include "likeness/base/log.h"
#include "likeness/base/parallel.h"
#include "likeness/base/text.h"

namespace likeness {
namespace {

std::string FlagName(const std::string& name) { return "--" + name; }

std::string TomlString(const std::string& text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') quoted += '\\';
    if (c == '\n') {
      quoted += "\\n";
    } else {
      quoted += c;
    }
  }
  return quoted + '"';
}

std::string TomlFloat(const std::string& digits) {
  return digits.find_first_of(".en") == std::string::npos ? digits + ".0" : digits;
}

// A value as TOML writes it.
struct ToToml {
  std::string operator()(const bool* v) const { return *v ? "true" : "false"; }
  std::string operator()(const int* v) const { return std::to_string(*v); }
  std::string operator()(const int64_t* v) const { return std::to_string(*v); }
  std::string operator()(const uint64_t* v) const { return std::to_string(*v); }
  std::string operator()(const float* v) const { return TomlFloat(fmt::format("{}", *v)); }
  std::string operator()(const double* v) const { return TomlFloat(fmt::format("{}", *v)); }
  std::string operator()(const std::string* v) const { return TomlString(*v); }
  std::string operator()(const std::filesystem::path* v) const { return TomlString(v->string()); }
  std::string operator()(const std::vector<std::string>* v) const {
    std::vector<std::string> quoted;
    for (const std::string& item : *v) quoted.push_back(TomlString(item));
    return fmt::format("[{}]", fmt::join(quoted, ", "));
  }
};

// What --help shows behind an option: its kind and default.
struct ToDefault {
  std::string operator()(const bool* v) const { return *v ? "on" : "off"; }
  std::string operator()(const std::string* v) const { return *v; }
  std::string operator()(const std::filesystem::path* v) const { return v->string(); }
  std::string operator()(const std::vector<std::string>* v) const { return fmt::format("{}", fmt::join(*v, " ")); }
  template <typename Number>
  std::string operator()(const Number* v) const {
    return fmt::format("{}", *v);
  }
};

const char* KindOf(const OptionTarget& target) {
  static constexpr const char* kKinds[] = {"", "N", "N", "N", "X", "X", "TEXT", "PATH", "TEXT ..."};
  return kKinds[target.index()];
}

std::string TomlScalar(const toml::node& node, const std::string& key) {
  if (const auto v = node.value<std::string>(); v && node.is_string()) return *v;
  if (node.is_boolean()) return *node.value<bool>() ? "true" : "false";
  if (node.is_integer()) return std::to_string(*node.value<int64_t>());
  if (node.is_floating_point()) return fmt::format("{}", *node.value<double>());
  throw UsageError(fmt::format("configuration key '{}' has a value of a kind that no option takes", key));
}

// Calls `use(key, node)` for every value of a table, keys of nested tables joined by dots.
template <typename Use>
void Flatten(const toml::table& table, const std::string& prefix, const Use& use) {
  for (const auto& [key, node] : table) {
    const std::string name = prefix + std::string(std::string_view(key));
    if (const toml::table* nested = node.as_table()) {
      Flatten(*nested, name + ".", use);
    } else {
      use(name, node);
    }
  }
}

}  // namespace

Command::Command(std::string verb, std::string summary, std::string example)
    : verb_(std::move(verb)), summary_(std::move(summary)), example_(std::move(example)) {}

void Command::Positional(std::string name, OptionTarget target, std::string help, bool required) {
  entries_.push_back({std::move(name), target, std::move(help), {}, true, required});
}

void Command::Option(std::string name, OptionTarget target, std::string help) {
  LIKENESS_CHECK(Find(name) == nullptr);
  entries_.push_back({std::move(name), target, std::move(help), {}, false, false});
}

void Command::Choice(std::string name, std::string* target, std::vector<std::string> choices, std::string help) {
  Option(std::move(name), target, std::move(help));
  entries_.back().choices = std::move(choices);
}

const Command::Entry* Command::Find(const std::string& name) const {
  const auto it = std::find_if(entries_.begin(), entries_.end(), [&](const Entry& e) { return e.name == name; });
  return it == entries_.end() ? nullptr : &*it;
}

std::vector<std::string> Command::ArgumentsFromConfig(const std::filesystem::path& path, std::string_view text) const {
  toml::table table;
  try {
    table = toml::parse(text, path.string());
  } catch (const toml::parse_error& error) {
    throw UsageError(
        fmt::format("{}:{}: not valid TOML: {}", path.string(), error.source().begin.line, error.description()));
  }
  std::vector<std::string> known;
  for (const Entry& entry : entries_) {
    if (!entry.positional) known.push_back(entry.name);
  }
  known.insert(known.end(), {"threads", "quiet"});
  std::vector<std::string> arguments;
  Flatten(table, "", [&](const std::string& key, const toml::node& node) {
    const Entry* entry = Find(key);
    const bool is_common = key == "threads" || key == "quiet";
    if (!is_common && (entry == nullptr || entry->positional)) {
      const std::string nearest = NearestWord(key, known);
      throw UsageError(fmt::format("{}:{}: unknown key '{}'{}", path.string(), node.source().begin.line, key,
                                   nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest)));
    }
    if (const toml::array* array = node.as_array()) {
      if (!array->empty()) arguments.push_back(FlagName(key));
      for (const toml::node& item : *array) arguments.push_back(TomlScalar(item, key));
    } else if (node.is_boolean()) {
      arguments.push_back(*node.value<bool>() ? FlagName(key) : "--no-" + key);
    } else {
      arguments.push_back(FlagName(key) + "=" + TomlScalar(node, key));
    }
  });
  return arguments;
}

bool Command::Parse(int argc, const char* const* argv) {
  constexpr uint64_t kMostBytes = 1 << 24;
  const std::vector<std::string> given(argv + 1, argv + argc);
  std::vector<std::string> arguments;
  for (size_t i = 0; i < given.size(); ++i) {
    std::filesystem::path config;
    if (given[i] == "--config" && i + 1 < given.size()) config = given[i + 1];
    if (given[i].starts_with("--config=")) config = given[i].substr(9);
    if (!config.empty()) {
      const auto from_config = ArgumentsFromConfig(config, ReadFile(config, kMostBytes));
      arguments.insert(arguments.end(), from_config.begin(), from_config.end());
    }
  }
  arguments.insert(arguments.end(), given.begin(), given.end());
  return ParseArguments(std::move(arguments));
}

bool Command::ParseConfig(const std::filesystem::path& path_for_errors, std::string_view text) {
  return ParseArguments(ArgumentsFromConfig(path_for_errors, text));
}

bool Command::ParseArguments(std::vector<std::string> arguments) {
  CLI::App app(summary_, "likeness " + verb_);
  app.set_help_flag("");
  bool help = false;
  std::vector<std::string> flags = {"--help", "--config", "--threads", "--quiet", "--no-quiet"};
  for (Entry& entry : entries_) {
    std::visit(
        [&](auto* target) {
          using T = std::remove_pointer_t<decltype(target)>;
          CLI::Option* option = nullptr;
          if constexpr (std::is_same_v<T, bool>) {
            const std::string off = "--no-" + entry.name;
            option = app.add_flag(FlagName(entry.name) + ",!" + off, *target, entry.help);
            flags.push_back(off);
          } else {
            option = app.add_option(entry.positional ? entry.name : FlagName(entry.name), *target, entry.help);
          }
          if constexpr (!std::is_same_v<T, std::vector<std::string>>) {
            option->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
          } else {
            option->multi_option_policy(CLI::MultiOptionPolicy::TakeAll);
          }
          if (!entry.positional) flags.push_back(FlagName(entry.name));
          if (!entry.choices.empty()) option->check(CLI::IsMember(entry.choices));
        },
        entry.target);
  }
  app.add_option("--config", config_)->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.add_option("--threads", threads_)->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.add_flag("--quiet,!--no-quiet", quiet_)->multi_option_policy(CLI::MultiOptionPolicy::TakeLast);
  app.add_flag("--help,-h", help);

  std::reverse(arguments.begin(), arguments.end());  // CLI11 takes them from the back
  try {
    app.parse(arguments);
  } catch (const CLI::ExtrasError&) {
    // The first word that is no option; name its nearest known one.
    for (const std::string& extra : app.remaining()) {
      const std::string word = extra.substr(0, extra.find('='));
      const std::string nearest = word.starts_with("-") ? NearestWord(word, flags) : "";
      throw UsageError(fmt::format("unknown {} '{}'{}; likeness {} --help lists the options",
                                   word.starts_with("-") ? "option" : "argument", word,
                                   nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest), verb_));
    }
  } catch (const CLI::ParseError& error) {
    throw UsageError(fmt::format("{}; likeness {} --help lists the options", error.what(), verb_));
  }
  if (help) {
    std::string usage = "usage: likeness " + verb_;
    for (const Entry& entry : entries_) {
      if (entry.positional) usage += entry.required ? " " + entry.name : " [" + entry.name + "]";
    }
    fmt::print("{}\n\n{} [options]\n\n", summary_, usage);
    const auto line = [](const std::string& left, const std::string& right) {
      constexpr size_t kColumn = 30;
      fmt::print("  {:<{}}{}{}\n", left, kColumn,
                 left.size() < kColumn ? std::string() : "\n" + std::string(kColumn + 2, ' '), right);
    };
    for (const Entry& entry : entries_) {
      if (entry.positional) line(entry.name, entry.help);
    }
    for (const Entry& entry : entries_) {
      if (entry.positional) continue;
      const std::string kind =
          entry.choices.empty() ? KindOf(entry.target) : fmt::format("{}", fmt::join(entry.choices, "|"));
      const std::string standard = std::visit(ToDefault(), entry.target);
      line(FlagName(entry.name) + (kind.empty() ? "" : " " + kind),
           entry.help + (standard.empty() ? "" : fmt::format(" [{}]", standard)));
    }
    line("--config FILE.toml", "reads options from a file; flags win");
    line("--threads N", "threads to use, 0 for all cores [0]");
    line("--quiet", "warnings and errors only");
    fmt::print("\nexample: {}\n", example_);
    return false;
  }
  for (const Entry& entry : entries_) {
    if (entry.positional && entry.required && app.get_option(entry.name)->count() == 0) {
      throw UsageError(
          fmt::format("{} is missing ({}); likeness {} --help shows how to use it", entry.name, entry.help, verb_));
    }
  }
  if (threads_ < 0) throw UsageError("--threads must be 0 or more");
  SetThreadCount(threads_);
  SetQuiet(quiet_);
  return true;
}

std::string Command::ResolvedToml() const {
  std::string top = fmt::format("# likeness {}\n", verb_);
  std::vector<std::pair<std::string, std::string>> tables;
  for (const Entry& entry : entries_) {
    if (entry.positional) continue;
    const std::string value = std::visit(ToToml(), entry.target);
    const size_t dot = entry.name.rfind('.');
    if (dot == std::string::npos) {
      top += fmt::format("{} = {}\n", entry.name, value);
      continue;
    }
    const std::string table = entry.name.substr(0, dot);
    auto it = std::find_if(tables.begin(), tables.end(), [&](const auto& t) { return t.first == table; });
    if (it == tables.end()) it = tables.insert(tables.end(), {table, fmt::format("\n[{}]\n", table)});
    it->second += fmt::format("{} = {}\n", entry.name.substr(dot + 1), value);
  }
  for (const auto& table : tables) top += table.second;
  return top;
}

}  // namespace likeness

#include "likeness/app/command.h"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <CLI/CLI.hpp>
#define TOML_EXCEPTIONS 1
#include <toml++/toml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <concepts>
#include <cstdio>
#include <iterator>
#include <limits>
#include <utility>

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
    if (static_cast<unsigned char>(c) < 32 || c == 127) {
      quoted += fmt::format("\\u{:04x}", c);
      continue;
    }
    if (c == '"' || c == '\\') quoted += '\\';
    quoted += c;
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
  std::string operator()(const uint64_t* v) const {
    return std::in_range<int64_t>(*v) ? std::to_string(*v) : TomlString(std::to_string(*v));
  }
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

// How --help and errors call what an option takes, by OptionTarget's order.
struct Kind {
  const char* in_help;
  const char* wanted;
};
constexpr Kind kKinds[] = {{"", "true or false"},
                           {"N", "a whole number"},
                           {"N", "a whole number"},
                           {"N", "a whole number from 0 on"},
                           {"X", "a number"},
                           {"X", "a number"},
                           {"TEXT", "text"},
                           {"PATH", "a path"},
                           {"TEXT ...", "a list of texts"}};
static_assert(std::size(kKinds) == std::variant_size_v<OptionTarget>);

// Sets an option from a configuration's value; false when it is of another kind or out of range.
bool FromToml(const toml::node& node, bool* value) {
  if (!node.is_boolean()) return false;
  *value = *node.value<bool>();
  return true;
}

template <std::integral Integer>
bool FromToml(const toml::node& node, Integer* value) {
  if (const auto text = node.value_exact<std::string>()) {  // what is beyond TOML's own numbers stands in quotes
    const char* const end = text->data() + text->size();
    const auto [next, error] = std::from_chars(text->data(), end, *value);
    return error == std::errc() && next == end;
  }
  if (!node.is_integer() || !std::in_range<Integer>(*node.value<int64_t>())) return false;
  *value = static_cast<Integer>(*node.value<int64_t>());
  return true;
}

template <std::floating_point Float>
bool FromToml(const toml::node& node, Float* value) {
  if (!node.is_number()) return false;
  const double number = *node.value<double>();
  if (std::isfinite(number) && std::abs(number) > double{std::numeric_limits<Float>::max()}) return false;
  *value = static_cast<Float>(number);
  return true;
}

// Names may look like numbers: cameras = [400069, 400070].
bool FromToml(const toml::node& node, std::string* value) {
  if (node.is_string()) {
    *value = *node.value<std::string>();
  } else if (node.is_integer()) {
    *value = std::to_string(*node.value<int64_t>());
  } else {
    return false;
  }
  return true;
}

bool FromToml(const toml::node& node, std::filesystem::path* value) {
  if (!node.is_string()) return false;
  *value = *node.value<std::string>();
  return true;
}

bool FromToml(const toml::node& node, std::vector<std::string>* value) {
  const toml::array* array = node.as_array();
  if (array == nullptr) {
    value->assign(1, "");
    return FromToml(node, &value->front());
  }
  value->assign(array->size(), "");
  return std::equal(array->begin(), array->end(), value->begin(),
                    [](const toml::node& item, std::string& text) { return FromToml(item, &text); });
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

void Command::ApplyConfig(const std::filesystem::path& path, std::string_view text) {
  toml::table table;
  try {
    table = toml::parse(text, path.string());
  } catch (const toml::parse_error& error) {
    throw UsageError(
        fmt::format("{}:{}: not valid TOML: {}", path.string(), error.source().begin.line, error.description()));
  }
  std::vector<std::string> known = {"threads", "quiet"};
  for (const Entry& entry : entries_) {
    if (!entry.positional) known.push_back(entry.name);
  }
  Flatten(table, "", [&](const std::string& key, const toml::node& node) {
    const auto fail = [&, line = node.source().begin.line](const std::string& message) {
      throw UsageError(fmt::format("{}:{}: {}", path.string(), line, message));
    };
    if (std::find(known.begin(), known.end(), key) == known.end()) {
      const std::string nearest = NearestWord(key, known);
      fail(fmt::format("unknown key '{}'{}", key, nearest.empty() ? "" : fmt::format(", did you mean '{}'?", nearest)));
    }
    const Entry* entry = Find(key);
    const OptionTarget target = entry != nullptr ? entry->target : key == "quiet" ? OptionTarget(&quiet_) : &threads_;
    const bool fits = std::visit([&](auto* value) { return FromToml(node, value); }, target);
    if (!fits) fail(fmt::format("'{}' needs {}", key, kKinds[target.index()].wanted));
    if (entry == nullptr || entry->choices.empty()) return;
    const auto& chosen = *std::get<std::string*>(target);
    if (std::find(entry->choices.begin(), entry->choices.end(), chosen) == entry->choices.end()) {
      fail(fmt::format("'{}' is '{}', expected one of {}", key, chosen, fmt::join(entry->choices, ", ")));
    }
  });
}

bool Command::Parse(int argc, const char* const* argv) {
  constexpr uint64_t kMostBytes = 1 << 24;
  std::vector<std::string> given(argv + 1, argv + argc);
  for (size_t i = 0; i < given.size(); ++i) {
    std::filesystem::path config;
    if (given[i] == "--config" && i + 1 < given.size()) config = given[i + 1];
    if (given[i].starts_with("--config=")) config = given[i].substr(9);
    if (!config.empty()) ApplyConfig(config, ReadFile(config, kMostBytes));
  }
  return ParseArguments(std::move(given));
}

bool Command::ParseConfig(const std::filesystem::path& path_for_errors, std::string_view text) {
  ApplyConfig(path_for_errors, text);
  return ParseArguments({});
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
            if (!entry.positional) option->allow_extra_args(false);  // one value a flag: --also A --also B
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
      const std::string kind = entry.choices.empty() ? kKinds[entry.target.index()].in_help
                                                     : fmt::format("{}", fmt::join(entry.choices, "|"));
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

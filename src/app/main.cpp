// The program `kairos`: finds the command, runs it, and turns every failure into one line and an exit code.
#include <malloc.h>

#include <csignal>

#include <CLI/CLI.hpp>

#include <algorithm>
#include <cstdio>
#include <exception>
#include <memory>
#include <new>
#include <string>
#include <utility>
#include <vector>

#include "app/command.h"
#include "core/error.h"

namespace kairos {
namespace {

// 0: done, and what sh reports for a process ended by SIGINT.
constexpr int kFailed = 1, kUsage = 2, kInterrupted = 130;

StopFlag stopFlag;

extern "C" void requestStop(int) {
  stopFlag.request();
}

// The first Ctrl-C (or SIGTERM) asks the command to stop after the step at hand; a second one ends it at
// once. Broken pipes and file size limits become ordinary write errors.
void installSignalHandlers() {
  struct sigaction action {};
  action.sa_handler = requestStop;
  action.sa_flags = int(SA_RESTART | SA_RESETHAND);
  for (const int signal : {SIGINT, SIGTERM}) sigaction(signal, &action, nullptr);
  std::signal(SIGPIPE, SIG_IGN);
  std::signal(SIGXFSZ, SIG_IGN);
}

// As it could be typed into a shell again.
std::string quoteForShell(const std::string& argument) {
  const char* const kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789_-+=./,:@%#";
  if (!argument.empty() && argument[0] != '#' && argument.find_first_not_of(kPlain) == std::string::npos)
    return argument;
  std::string quoted = "'";
  for (const char c : argument) quoted += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return quoted + "'";
}

std::string commandLineOf(int argc, char** argv) {
  std::string line = "kairos";
  for (int i = 1; i < argc; ++i) line += " " + quoteForShell(argv[i]);
  return line;
}

class HelpFormatter : public CLI::Formatter {
 public:
  HelpFormatter() {
    column_width(28);
    label("Positionals", "Input");
    label("SUBCOMMAND", "COMMAND ...");
    label("OPTIONS", "OPTION ...");
  }

  // One blank line between groups.
  std::string make_help(const CLI::App* app, std::string name, CLI::AppFormatMode mode) const override {
    std::string text = CLI::Formatter::make_help(app, std::move(name), mode);
    for (size_t at; (at = text.find("\n\n\n")) != std::string::npos;) text.erase(at, 1);
    return text;
  }
};

constexpr const char* kExamples = R"(Examples:
  kairos diff sim/ -o seq/                                  the static phase: find what changes from step to step
  kairos info seq/                                          what the sequence holds
  kairos render seq/ -o out/frame.####.exr --png            the dynamic phase: one image per time step
  kairos compare out/frame.####.exr ref/frame.####.exr      how far two animations are apart
  kairos bench seq/ -o report/                              every method and budget against the exact frames

'kairos COMMAND --help' explains each command and its options.
Exit codes: 0 done, 1 failed, 2 wrong usage, 130 interrupted.)";

void describe(CLI::App& root) {
  root.name("kairos");
  root.description(
      "Kairos renders time-varying volumes on the CPU: after the first frame, only what changed.");
  root.formatter(std::make_shared<HelpFormatter>());
  root.set_help_flag("-h,--help", "Print this help and exit");
  root.set_version_flag("--version", "kairos " KAIROS_VERSION, "Print the version and exit");
  root.footer(kExamples);
}

std::string wordAfter(const std::string& text, const std::string& start) {
  return text.substr(std::min(text.size(), text.find(start) + start.size()));
}

// CLI11's extra arguments are in one string; the unknown option among them is the one to name.
std::string unexpectedArgument(const std::string& message) {
  const std::string list = wordAfter(message, "expected: ");
  std::string first;
  for (size_t begin = 0; begin < list.size();) {
    const size_t end = std::min(list.find(' ', begin), list.size());
    const std::string word = list.substr(begin, end - begin);
    if (word.size() > 1 && word[0] == '-') return "unknown option " + word;
    if (first.empty()) first = word;
    begin = end + 1;
  }
  return "unexpected argument \"" + first + "\"";
}

// "Could not convert: --key-every = abc"
std::string inconvertible(const CLI::App* command, const std::string& message) {
  const std::string start = "Could not convert: ";
  if (message.find(start) == std::string::npos) return message;
  const std::string rest = wordAfter(message, start);
  const size_t equals = rest.find(" = ");
  if (equals == std::string::npos) return message;
  const std::string name = rest.substr(0, equals);
  const CLI::Option* option = command->get_option_no_throw(name);
  const std::string type = option ? option->get_type_name() : "";
  return name + ": found \"" + rest.substr(equals + 3) + "\", expected " +
         (type == "FLOAT"                   ? "a number"
          : type == "INT" || type == "UINT" ? "a whole number"
                                            : "another value");
}

std::string usageProblem(const CLI::App* command, const CLI::ParseError& error) {
  const std::string message = error.what(), name = message.substr(0, message.find(':'));
  if (dynamic_cast<const CLI::ExtrasError*>(&error)) return unexpectedArgument(message);
  if (dynamic_cast<const CLI::ConversionError*>(&error)) return inconvertible(command, message);
  if (dynamic_cast<const CLI::ArgumentMismatch*>(&error))
    return name + (message.find("At Most") != std::string::npos ? ": given more than once"
                                                                : ": expected a value after it");
  if (dynamic_cast<const CLI::ExcludesError*>(&error)) {
    const size_t split = message.find(" excludes ");
    return message.substr(0, split) + " and " + wordAfter(message, " excludes ") +
           " cannot be given together";
  }
  return message;
}

int fail(int code, std::string message) {
  for (char& c : message)
    if (c == '\n') c = ' ';
  std::fprintf(stderr, "kairos: %s\n", message.c_str());
  return code;
}

int failUsage(const CLI::App& root, const CLI::ParseError& error) {
  const auto chosen = root.get_subcommands();
  if (chosen.empty()) return fail(kUsage, usageProblem(&root, error) + " (see kairos --help)");
  return fail(kUsage, usageProblem(chosen.front(), error) + " (see kairos " + chosen.front()->get_name() +
                          " --help)");
}

std::vector<const CLI::App*> commandsOf(const CLI::App& root) {
  return root.get_subcommands([](const CLI::App*) { return true; });
}

bool isCommand(const CLI::App& root, const std::string& word) {
  const auto commands = commandsOf(root);
  return std::any_of(commands.begin(), commands.end(),
                     [&](const CLI::App* c) { return c->get_name() == word; });
}

std::string commandNames(const CLI::App& root) {
  std::string names;
  const auto commands = commandsOf(root);
  for (size_t i = 0; i < commands.size(); ++i)
    names += (i == 0 ? "" : i + 1 == commands.size() ? " or " : ", ") + commands[i]->get_name();
  return names;
}

// Steps and frames come and go in blocks of a few megabytes. By default every one of them is given back to
// the system and asked for again, and a page fault for each 4 KB costs more than what is done with it.
void keepFreedMemory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_THRESHOLD, 32 << 20);
  mallopt(M_TRIM_THRESHOLD, 256 << 20);
#endif
}

int runProgram(int argc, char** argv) {
  installSignalHandlers();
  keepFreedMemory();
  CommandContext context{stopFlag, commandLineOf(argc, argv), {}, {}};
  CLI::App root;
  describe(root);
  addDiffCommand(root, context);
  addInfoCommand(root, context);
  addRenderCommand(root, context);
  addCompareCommand(root, context);
  addBenchCommand(root, context);
#ifdef KAIROS_LOD
  addLodCommand(root, context);
#endif
  for (CLI::App* command : root.get_subcommands([](CLI::App*) { return true; })) command->group("Commands");
  const bool option = argc > 1 && argv[1][0] == '-';
  if (argc < 2 || (!option && !isCommand(root, argv[1])))
    return fail(kUsage, (argc < 2 ? std::string("no command given")
                                  : "unknown command \"" + std::string(argv[1]) + "\"") +
                            ", expected " + commandNames(root) + " (see kairos --help)");
  try {
    root.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return root.exit(error);
    return failUsage(root, error);
  }
  if (!context.run)
    return fail(kUsage, "no command given, expected " + commandNames(root) + " (see kairos --help)");
  try {
    return context.run();
  } catch (const Interrupted&) {
    return fail(kInterrupted,
                "interrupted; " + (context.whenInterrupted.empty() ? std::string("nothing finished was lost")
                                                                   : context.whenInterrupted));
  }
}

}  // namespace
}  // namespace kairos

int main(int argc, char** argv) {
  try {
    return kairos::runProgram(argc, argv);
  } catch (const kairos::OptionError& error) {
    return kairos::fail(kairos::kUsage, error.what());
  } catch (const std::bad_alloc&) {
    return kairos::fail(kairos::kFailed, "not enough memory for this volume, image size and --cache-memory");
  } catch (const std::exception& error) {
    return kairos::fail(kairos::kFailed, error.what());
  } catch (...) {
    return kairos::fail(kairos::kFailed, "failed for a reason that the program does not know");
  }
}

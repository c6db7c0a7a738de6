#include "app/bench_arguments.h"

#include <CLI/CLI.hpp>

#include <algorithm>
#include <thread>

#include "core/error.h"

namespace kairos {
namespace {

constexpr const char* kExamples = R"(Examples:
  kairos bench seq/ -o report/                                   all methods, at 5, 10, 25 and 50 % of a full frame
  kairos bench seq/ -o report/ --methods anytime,tcdvrm --budgets 10%,40ms --repeat 3
  kairos bench seq/ -o report/ --methods segments --threads 1,2,4 --steps 1,0.5 --pictures none

Renders the sequence once with every method under every budget and compares each frame with the exact one, which 'full'
renders first. Leaves in report/:
  index.html    summary, plots, pictures and tables in one page that needs nothing else
  report.json   everything measured, but for the pictures
  frames.csv    a row per frame
Nothing else should run meanwhile. The first step is rendered whole by every method and is not counted.)";

constexpr Method kMethods[] = {Method::full,   Method::segments, Method::dvrm,   Method::tldvrm,
                               Method::tcdvrm, Method::tiles,    Method::lowres, Method::anytime};
constexpr const char* kDefaultBudgets = "5%,10%,25%,50%";
constexpr uint64_t kDefaultCache = uint64_t(2) << 30;

SweepBudget interpretBudget(const std::string& text) {
  const auto refuse = [&] {
    refuseValue("--budgets", text,
                "shares of a full frame's time such as 10%, times such as 40ms, rates such as "
                "25fps, samples:N, error:E, or unlimited, with commas between them");
  };
  const auto before = [&](const std::string& unit) {
    const auto value = parsedNumber(text.substr(0, text.size() - unit.size()));
    if (!value || !(*value > 0) || *value > 1e9) refuse();
    return *value;
  };
  if (text == "unlimited") return {text, 0, {}};
  if (text.ends_with("%")) return {text, before("%") / 100, {}};
  if (text.ends_with("ms")) return {text, 0, Budget::time(before("ms"))};
  if (text.ends_with("fps")) return {text, 0, Budget::framesPerSecond(before("fps"))};
  if (text.starts_with("error:")) return {text, 0, budgetOption("--budgets", text)};
  if (!text.starts_with("samples:")) refuse();
  const auto samples = parsedNumber(text.substr(8));
  if (!samples || !(*samples >= 1) || *samples > 1e15) refuse();
  return {text, 0, Budget::ofSamples(uint64_t(*samples))};
}

// Each value once, in the order given.
template <class T, class Same>
void appendOnce(std::vector<T>& values, T value, Same same) {
  if (std::none_of(values.begin(), values.end(), [&](const T& v) { return same(v, value); }))
    values.push_back(std::move(value));
}

}  // namespace

void BenchArguments::addTo(CLI::App& command) {
  input.addTo(command, "a sequence directory, or a simulation's files");
  command.get_option("INPUT")->option_text(" ");
  view.addTo(command);
  const auto add = [&](const char* option, const char* placeholder, std::string& value,
                       const std::string& help) {
    return command.add_option(option, value, help)->group("Sweep")->option_text(placeholder);
  };
  add("--methods", "NAMES", words_.methods,
      "of full, segments, dvrm, tldvrm, tcdvrm, tiles, lowres and anytime;\nfull always runs [all "
      "that take these settings]");
  add("--budgets", "LIST", words_.budgets,
      "for methods that take one: shares of a full frame's median time (10%),\ntimes (40ms), rates (25fps), "
      "samples:N, error:E (anytime alone) or unlimited\n[5%,10%,25%,50%]");
  add("--steps", "LIST", words_.steps, "sample distances in voxels, instead of one with --step")
      ->excludes(command.get_option("--step"));
  add("--threads", "LIST", words_.threads, "numbers of threads, each from 1 to 1024 [all processors]");
  add("--repeat", "N", words_.repeat, "run every case N times, in turn, from 1 to 1000 [1]");
  add("--clock", "NAME", words_.clock,
      "what budgets and times are measured by: wall, or processor, the time that one\nthread would take on a "
      "machine that is not shared; needs --threads 1 [wall]");
  add("--seed", "N", words_.seed, "of whatever is drawn at random [0]");
  add("--cache-memory", "SIZE", words_.cacheMemory,
      "most memory for reusable ray segments, with KiB, MiB or GiB [2GiB]");
  add("--projection", "NAME", words_.projection,
      "dvrm, tldvrm, tcdvrm: the pixels that a changed voxel influences: those of\nthe paper (paper), or "
      "every one whose colour it can alter (conservative)\n[conservative]");
  add("--frames", "A-B", framesText, "time steps to render: A-B, A- or -B [all]");
  const char* const kOutput = "Output";
  command.add_option("-o,--output", output, "directory of the report; made if needed (required)")
      ->group(kOutput)
      ->option_text("DIR")
      ->required();
  command
      .add_option("--pictures", words_.pictures,
                  "time steps to show, with commas between them, or none [the middle one]")
      ->group(kOutput)
      ->option_text("STEPS");
  command.add_flag("--quiet", quiet, "no progress, no summary")->group(kOutput);
  command.footer(kExamples);
}

void BenchArguments::interpret() {
  view.interpret();
  interpretMethods();
  interpretSweep();
  if (!framesText.empty()) frames = stepRangeOption("--frames", framesText);
  pictures = words_.pictures != "none";
  if (!pictures || words_.pictures.empty()) return;
  for (const std::string& word : commaSeparated(words_.pictures))
    appendOnce(
        plan.pictureSteps,
        integerOption("--pictures", word, 0, INT64_MAX, "time steps with commas between them, or none"),
        std::equal_to<>());
}

void BenchArguments::interpretMethods() {
  std::vector<std::string> names;
  for (const Method method : kMethods) names.push_back(name(method));
  std::vector<Method> methods(std::begin(kMethods), std::end(kMethods));
  methodsNamed = !words_.methods.empty();
  if (!words_.methods.empty()) {
    methods.clear();
    for (const std::string& word : commaSeparated(words_.methods))
      appendOnce(methods, kMethods[choiceOption("--methods", word, names)], std::equal_to<>());
  }
  for (const Method method : methods)
    if (method != Method::full) plan.methods.push_back(method);
  for (const std::string& word : commaSeparated(words_.budgets.empty() ? kDefaultBudgets : words_.budgets))
    appendOnce(plan.budgets, interpretBudget(word),
               [](const SweepBudget& a, const SweepBudget& b) { return a.text == b.text; });
}

void BenchArguments::interpretSweep() {
  const Words& w = words_;
  if (!w.steps.empty())
    for (const std::string& word : commaSeparated(w.steps))
      appendOnce(plan.sampleDistances,
                 numberOption("--steps", word, 1.0 / 64, 64,
                              "numbers of voxels from 1/64 to 64 with commas between"),
                 std::equal_to<>());
  if (w.threads.empty())
    plan.threads = {std::clamp(int(std::thread::hardware_concurrency()), 1, 1024)};
  else
    for (const std::string& word : commaSeparated(w.threads))
      appendOnce(
          plan.threads,
          int(integerOption("--threads", word, 1, 1024, "whole numbers from 1 to 1024 with commas between")),
          std::equal_to<>());
  if (!w.clock.empty() && choiceOption("--clock", w.clock, {"wall", "processor"}) == 1) {
    if (plan.threads != std::vector<int>{1})
      throw OptionError("--clock", "processor time of several threads is no measure: add --threads 1");
    plan.clock = &processorBudgetClock();
  }
  if (!w.repeat.empty())
    plan.repeats = int(integerOption("--repeat", w.repeat, 1, 1000, "a whole number from 1 to 1000"));
  if (!w.seed.empty())
    plan.seed = uint64_t(integerOption("--seed", w.seed, 0, INT64_MAX, "a whole number of at least 0"));
  if (!w.projection.empty())
    plan.projection.mode =
        ProjectionMode(choiceOption("--projection", w.projection, {"paper", "conservative"}));
  plan.cacheMemory = w.cacheMemory.empty() ? kDefaultCache : bytesOption("--cache-memory", w.cacheMemory);
}

}  // namespace kairos

// `kairos bench`: a small sweep, its JSON and CSV, and a page on which every number is one of the JSON's.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>

#include "cli/render_fixture.h"

namespace kairos::test {
namespace {

using nlohmann::json;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

int count(const std::string& text, const std::string& part) {
  int found = 0;
  for (size_t at = 0; (at = text.find(part, at)) != std::string::npos; at += part.size()) ++found;
  return found;
}

class Bench : public Render {
 protected:
  ProgramResult bench(const std::string& out, const Arguments& options) const {
    return run(
        join(join({"bench", dir / "sim", "-o", dir / out, "--size", "40x32", "--quiet"}, raw), options));
  }
  json report(const std::string& out) const {
    return json::parse(fileContents(dir / (out + "/report.json")));
  }
  std::string page(const std::string& out) const { return fileContents(dir / (out + "/index.html")); }

  // Rows of frames.csv by column.
  std::vector<std::map<std::string, std::string>> rows(const std::string& out) const {
    std::istringstream file(fileContents(dir / (out + "/frames.csv")));
    std::vector<std::string> header;
    std::vector<std::map<std::string, std::string>> all;
    for (std::string line; std::getline(file, line);) {
      std::vector<std::string> cells(1);
      for (const char c : line)
        if (c == ',')
          cells.emplace_back();
        else
          cells.back() += c;
      if (header.empty()) {
        header = cells;
        continue;
      }
      EXPECT_EQ(cells.size(), header.size()) << line;
      all.emplace_back();
      for (size_t i = 0; i < std::min(cells.size(), header.size()); ++i) all.back()[header[i]] = cells[i];
    }
    return all;
  }
};

TEST_F(Bench, LeavesThreeFiles) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1"})));
  EXPECT_THAT(fileNames(dir / "report"), ElementsAre("frames.csv", "index.html", "report.json"));
}

TEST_F(Bench, RunsEveryCombinationOverEveryStep) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1,2", "--steps", "1,0.5", "--repeat",
                                  "3", "--pictures", "none"})));
  const json j = report("report");
  ASSERT_EQ(j["cases"].size(), 2u * 2 * 2) << "full always runs";
  ASSERT_EQ(j["frames"].size(), 8u * 3 * kSteps);
  EXPECT_EQ(rows("report").size(), 8u * 3 * kSteps);
  std::map<std::vector<int64_t>, int> seen;  // case, repeat, step
  for (const json& f : j["frames"]) ++seen[{f["case"], f["repeat"], f["step"]}];
  EXPECT_EQ(seen.size(), 8u * 3 * kSteps) << "each once";
  for (const json& c : j["cases"])
    EXPECT_EQ(c["frames"], 3 * (kSteps - 1)) << "without the first of each run";
  EXPECT_EQ(j["sequence"]["first_step"], kFirstStep);
  EXPECT_EQ(j["sequence"]["steps"], kSteps);
  EXPECT_EQ(j["pictures"].size(), 0u);
}

TEST_F(Bench, FindsExactMethodsEqualToTheExactFrames) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1,2", "--shade"})));
  const json j = report("report");
  for (const json& f : j["frames"]) {
    EXPECT_EQ(f["max"], 0.0);
    EXPECT_EQ(f["rmse"], 0.0);
    EXPECT_TRUE(f["psnr"].is_null());
  }
  for (const json& c : j["cases"]) EXPECT_EQ(c["error"]["exact_frames"], c["frames"]);
}

TEST_F(Bench, CountsAreTheRenderersOwn) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1"})));
  ASSERT_TRUE(ok(run(join(join({"render", dir / "sim", "-o", dir / "f.####.exr", "--size", "40x32", "--stats",
                                dir / "stats", "--threads", "1", "--quiet"},
                               raw),
                          {}))));
  const auto expected = records(dir / "stats");
  size_t compared = 0;
  const json j = report("report");
  for (const json& f : j["frames"]) {
    if (j["cases"][f["case"].get<size_t>()]["method"] != "segments") continue;
    for (const char* entry : {"voxels_changed", "pixels_recast", "segments_recast", "samples"})
      EXPECT_EQ(f[entry], expected[compared][entry]) << entry;
    EXPECT_EQ(f["step"], expected[compared]["frame"]);
    ++compared;
  }
  EXPECT_EQ(compared, expected.size());
}

TEST_F(Bench, CsvHasTheNumbersOfTheJson) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1"})));
  const json j = report("report");
  const auto csv = rows("report");
  ASSERT_EQ(csv.size(), j["frames"].size());
  for (size_t i = 0; i < csv.size(); ++i) {
    const json& frame = j["frames"][i];
    for (const auto& [key, value] : frame.items()) {
      ASSERT_TRUE(csv[i].count(key)) << key;
      EXPECT_EQ(csv[i].at(key), value.is_null() ? "" : value.dump()) << key;
    }
    EXPECT_EQ(csv[i].at("method"), j["cases"][frame["case"].get<size_t>()]["method"]);
  }
}

TEST_F(Bench, SummariesFollowFromTheFrames) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1", "--repeat", "2"})));
  const json j = report("report");
  for (size_t i = 0; i < j["cases"].size(); ++i) {
    double sum = 0, most = 0, stages = 0;
    int frames = 0;
    for (const json& f : j["frames"]) {
      if (f["case"] != i || f["first"]) continue;
      const double ms = f["total_ms"];
      sum += ms;
      most = std::max(most, ms);
      ++frames;
    }
    const json& c = j["cases"][i];
    EXPECT_NEAR(c["time_ms"]["mean"], sum / frames, 1e-3);
    EXPECT_NEAR(c["time_ms"]["max"], most, 1e-3);
    EXPECT_LE(c["time_ms"]["median"], c["time_ms"]["p95"]);
    for (const auto& [name, ms] : c["stages_ms"].items()) stages += ms.get<double>();
    EXPECT_NEAR(stages, c["time_ms"]["mean"], 1e-3);
  }
}

// Is `text`, as the page shows it, what the JSON holds?
bool shows(const std::string& text, const json& value) {
  if (value.is_null()) return text == "∞" || text == "–";
  const double shown = std::stod(text) / (text.ends_with("%") ? 100 : 1);
  const double held = value.get<double>();
  const size_t point = text.find('.');
  size_t digits = 0;
  if (point != std::string::npos)
    while (point + 1 + digits < text.size() && std::isdigit(text[point + 1 + digits])) ++digits;
  const double unit = std::pow(10, -double(digits)) / (text.ends_with("%") ? 100 : 1);
  return std::abs(shown - held) <= 0.5001 * unit || std::abs(shown - held) <= 0.006 * std::abs(held);
}

TEST_F(Bench, EveryNumberOfThePageIsTheJsonEntryThatItNames) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1,2", "--steps", "1,2"})));
  const json j = report("report");
  const std::string html = page("report");
  static const std::regex sourced("<span data-json=\"([^\"]+)\">([^<]*)</span>");
  std::set<std::string> named;
  for (std::sregex_iterator it(html.begin(), html.end(), sourced), end; it != end; ++it) {
    const json::json_pointer pointer((*it)[1].str());
    ASSERT_TRUE(j.contains(pointer)) << (*it)[1];
    EXPECT_TRUE(shows((*it)[2], j.at(pointer))) << (*it)[1] << ": " << (*it)[2] << " of " << j.at(pointer);
    named.insert((*it)[1]);
  }
  for (size_t i = 0; i < j["cases"].size(); ++i)
    for (const char* entry :
         {"time_ms/median", "time_ms/p99", "error/psnr", "stages_ms/cast", "work/samples"})
      EXPECT_TRUE(named.count("/cases/" + std::to_string(i) + "/" + entry)) << entry << " of case " << i;
}

TEST_F(Bench, ThePageNeedsNothingElse) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1"})));
  const std::string html = page("report");
  EXPECT_THAT(html, Not(HasSubstr("http")));
  EXPECT_THAT(html, Not(HasSubstr("//cdn")));
  EXPECT_THAT(html, Not(HasSubstr("@import")));
  EXPECT_THAT(html, Not(HasSubstr("<link")));
  static const std::regex reference("(?:src|href|url)[=(]\"?([^\" >)]+)");
  for (std::sregex_iterator it(html.begin(), html.end(), reference), end; it != end; ++it) {
    const std::string to = (*it)[1];
    EXPECT_TRUE(to.starts_with("data:image/png;base64,") || to.starts_with("#") || to == "report.json" ||
                to == "frames.csv")
        << to.substr(0, 80);
  }
  static const std::regex link("href=\"#([a-z]+)\"");
  for (std::sregex_iterator it(html.begin(), html.end(), link), end; it != end; ++it)
    EXPECT_EQ(count(html, "id=\"" + (*it)[1].str() + "\""), 1) << "link to " << (*it)[1];
}

TEST_F(Bench, IdsOfThePageAreUnique) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1,2", "--steps", "1,2"})));
  const std::string html = page("report");
  static const std::regex id(" id=\"([^\"]+)\"");
  std::map<std::string, int> ids;
  for (std::sregex_iterator it(html.begin(), html.end(), id), end; it != end; ++it) ++ids[(*it)[1]];
  EXPECT_GT(ids.size(), 5u);
  for (const auto& [name, times] : ids) EXPECT_EQ(times, 1) << name;
}

TEST_F(Bench, ChartsHaveAPointForEveryStep) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1", "--frames", "3-7"})));
  const std::string html = page("report");
  for (int step = 4; step <= 7; ++step)
    EXPECT_THAT(html, HasSubstr("<title>time step " + std::to_string(step) + "\nfull  "));
  EXPECT_THAT(html, Not(HasSubstr("<title>time step 3\n"))) << "the first step is not counted";
  EXPECT_THAT(html, Not(HasSubstr("<title>time step 8\n")));
}

TEST_F(Bench, ComparesMethodsUnderEveryBudgetUnlessToldOtherwise) {
  ASSERT_TRUE(ok(bench("report", {"--threads", "1"})));
  const json j = report("report");
  std::map<std::string, int> cases;
  for (const json& c : j["cases"]) {
    ++cases[c["method"]];
    if (c["budget"].is_null()) continue;
    const double share = std::stod(c["budget"].get<std::string>()) / 100;
    EXPECT_NEAR(c["budget_ms"], share * j["cases"][0]["time_ms"]["median"].get<double>(), 1e-3);
    EXPECT_EQ(c["conformity"]["frames"].get<int>() + c["conformity"]["early"].get<int>(), kSteps - 1);
  }
  EXPECT_EQ(cases["full"], 1);
  EXPECT_EQ(cases["segments"], 1);
  EXPECT_EQ(cases["tcdvrm"], 4) << "5, 10, 25 and 50 %";
  EXPECT_THAT(page("report"), HasSubstr("id=\"conformity\""));
}

TEST_F(Bench, HistogramsCountEveryInfluencedPixelOnce_D20) {
  // So few samples that some changed pixels stay as they were, and so many that none does.
  ASSERT_TRUE(ok(bench("report", {"--methods", "tcdvrm", "--budgets", "samples:1500,unlimited", "--threads",
                                  "2", "--pictures", "5"})));
  const json j = report("report");
  ASSERT_EQ(j["histograms"].size(), 2u);
  const json &few = j["histograms"][0], &all = j["histograms"][1];
  for (const json& h : {few, all}) {
    uint64_t pixels = 0, changed = 0, cast = 0;
    for (size_t n = 0; n < h["pixels_by_influence"].size(); ++n) {
      const uint64_t count = h["pixels_by_influence"][n], of = h["cast_by_influence"][n];
      EXPECT_LE(of, count) << "influence number " << n;
      pixels += count;
      changed += n ? count : 0;
      cast += n ? of : 0;
    }
    EXPECT_EQ(pixels, 40u * 32u);
    EXPECT_EQ(changed, h["pixels_changed"]);
    EXPECT_EQ(cast, h["pixels_cast"]);
    EXPECT_EQ(h["cast_by_influence"][0], 0) << "what nothing influences is not cast";
  }
  EXPECT_EQ(all["pixels_cast"], all["pixels_changed"]);
  EXPECT_EQ(all["voxels_sampled"], all["voxels_changed"]);
  EXPECT_EQ(few["pixels_by_influence"], all["pixels_by_influence"]);
  EXPECT_GT(few["pixels_cast"], 0);
  EXPECT_LT(few["pixels_cast"], few["pixels_changed"]);
  EXPECT_LT(few["voxels_sampled_fraction"], 1.0);
  EXPECT_THAT(page("report"), HasSubstr("id=\"influence\""));
}

TEST_F(Bench, ShowsThePicturesAskedFor) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1", "--pictures", "4,6"})));
  const json j = report("report");
  ASSERT_EQ(j["pictures"].size(), 2u * 2);
  for (const json& p : j["pictures"]) EXPECT_EQ(p["ssim"], 1.0);
  const std::string html = page("report");
  EXPECT_THAT(html, HasSubstr(".exact4{background-image:url(data:image/png;base64,"));
  EXPECT_THAT(html, HasSubstr(".exact6{background-image:url(data:image/png;base64,"));
}

TEST_F(Bench, SaysWhatWasMeasuredAndHow) {
  ASSERT_TRUE(ok(bench("report", {"--methods", "segments", "--threads", "1"})));
  const std::string html = page("report");
  const json j = report("report");
  EXPECT_THAT(html, HasSubstr(j["command"].get<std::string>()));
  EXPECT_THAT(j["command"].get<std::string>(), HasSubstr("kairos bench"));
  EXPECT_THAT(html, HasSubstr("40 × 40 × 40 u8"));
  EXPECT_THAT(html, HasSubstr(j["machine"]["processor"].get<std::string>()));
}

TEST_F(Bench, GoesByTheProcessorsClockWhereToldTo) {
  ASSERT_TRUE(ok(bench(
      "report", {"--methods", "anytime", "--budgets", "50%", "--threads", "1", "--clock", "processor"})));
  EXPECT_EQ(report("report")["clock"], "processor");
  EXPECT_THAT(page("report"), HasSubstr("times by the processor's clock"));
  EXPECT_THAT(page("report"), Not(HasSubstr("was busy with other work")));
  ASSERT_TRUE(ok(bench("other", {"--methods", "segments", "--threads", "1"})));
  EXPECT_EQ(report("other")["clock"], "wall");
}

TEST_F(Bench, RefusesWhatItCannotRunBeforeItReadsAnything) {
  const std::pair<Arguments, const char*> wrong[] = {
      {{"--methods", "fast"}, "--methods: found \"fast\", expected full, segments"},
      {{"--budgets", "10"}, "--budgets: found \"10\""},
      {{"--budgets", "-5%"}, "--budgets: found \"-5%\""},
      {{"--budgets", "samples:0"}, "--budgets: found \"samples:0\""},
      {{"--budgets", "error:2"}, "--budgets: found \"error:2\""},
      {{"--threads", "0"}, "--threads: found \"0\""},
      {{"--steps", "0"}, "--steps: found \"0\""},
      {{"--repeat", "0"}, "--repeat: found \"0\""},
      {{"--clock", "sun"}, "--clock: found \"sun\""},
      {{"--clock", "processor", "--threads", "2"},
       "--clock: processor time of several threads is no measure"},
      {{"--steps", "1", "--step", "2"}, "cannot be given together"},
      {{"--pictures", "x"}, "--pictures: found \"x\""}};
  for (const auto& [options, message] : wrong) {
    const ProgramResult result = bench("report", options);
    EXPECT_EQ(result.exitCode, 2);
    EXPECT_TRUE(isOneErrorLine(result.err)) << result.err;
    EXPECT_THAT(result.err, HasSubstr(message));
    EXPECT_TRUE(fileNames(dir / "report").empty());
  }
}

TEST_F(Bench, RefusesStepsThatAreNotThere) {
  EXPECT_THAT(bench("report", {"--frames", "100-"}).err, HasSubstr("--frames: found \"100-\""));
  EXPECT_THAT(bench("report", {"--frames", "4"}).err, HasSubstr("expected at least two"));
  EXPECT_THAT(bench("report", {"--pictures", "99"}).err, HasSubstr("--pictures: found \"99\""));
}

}  // namespace
}  // namespace kairos::test

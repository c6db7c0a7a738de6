// What `kairos bench` measures: cases, their frames, and what these come to.
#pragma once

#include <cstdint>
#include <numeric>
#include <optional>
#include <string>
#include <vector>

#include "core/budget.h"
#include "core/image_difference.h"
#include "diff/frame_renderer.h"

namespace kairos {

/// One way of rendering the whole sequence.
struct BenchCase {
  Method method = Method::full;
  std::string budgetText;     // as typed, for example "10%"; empty: the method takes none
  Budget budget;              // the same as a limit; unlimited where the text says so
  double sampleDistance = 1;  // voxels
  int threads = 1;
};

/// One time step of one case.
struct BenchFrame {
  size_t benchCase = 0;
  int repeat = 0;
  int64_t step = 0;
  bool first = false;  // rendered whole and without a budget; not part of any summary
  double loadMs = 0;   // reading the step, before the clock starts
  double totalMs = 0;  // from the step handed over to its image
  FrameStatistics statistics;
  ColourError error;  // against the exact frame
  bool exact() const { return error.max == 0; }
};

/// A case's picture of one step: what it shows and where it is wrong, and the perceptual measures.
struct BenchPicture {
  size_t benchCase = 0;
  int64_t step = 0;
  ImageDifference error;
  std::string png, errorPng;  // files' bytes; errorPng is empty where the picture is exact
};

/// How many pixels of one step have which influence number, and how many of those a case cast anew (the
/// figures 5, 8 and 11 of Liao, Lai and Chung 2004).
struct BenchHistogram {
  size_t benchCase = 0;
  int64_t step = 0;
  uint64_t voxelsChanged = 0, voxelsSampled = 0;
  std::vector<uint64_t> changed, cast;  // element n: influence number n

  double sampledFraction() const { return voxelsChanged ? double(voxelsSampled) / double(voxelsChanged) : 0; }
  uint64_t changedPixels() const { return influenced(changed); }
  uint64_t castPixels() const { return influenced(cast); }

 private:
  static uint64_t influenced(const std::vector<uint64_t>& counts) {
    return counts.empty() ? 0 : std::accumulate(counts.begin() + 1, counts.end(), uint64_t(0));
  }
};

struct BenchMachine {
  std::string processor, system, compiler, isa;
  int processors = 0;
  uint64_t memoryBytes = 0;
  double loadBefore = 0, loadAfter = 0;  // the system's load average over one minute
};

struct BenchSequence {
  std::string name, elementType;
  Vec3i dims;
  std::vector<int64_t> steps;  // those rendered
  double changedFraction = 0;  // of the domain's voxels, median over the steps after the first
  double largestChangedFraction = 0;
};

struct BenchReport {
  std::string version, created, command;
  BenchMachine machine;
  BenchSequence sequence;
  int width = 0, height = 0;
  std::string picture;  // projection, mode and the like, in words
  int repeats = 1;
  bool processorTime = false;  // instead of the wall clock's
  std::vector<BenchCase> cases;
  std::vector<BenchFrame> frames;  // by repeat, case and step
  std::vector<BenchPicture> pictures;
  std::vector<BenchHistogram> histograms;
};

// Summaries.

/// The value below which a share `p` of the sorted values lies, linear in between; NaN without values.
double quantile(const std::vector<double>& sorted, double p);

/// Of sorted values.
struct Spread {
  double least = 0, p05 = 0, p25 = 0, median = 0, p75 = 0, p95 = 0, p99 = 0, most = 0, mean = 0;
};
Spread spreadOf(std::vector<double> values);

/// How well a limit of time was kept.
struct Conformity {
  size_t frames = 0;           // those that had to use their budget
  size_t early = 0;            // finished the exact frame in less
  size_t over = 0;             // took longer than the budget
  Spread deviation;            // |time - budget| / budget, of `frames`
  double latest = 0;           // largest time / budget, of all
  std::vector<double> shares;  // time / budget of each frame, early ones included
};

/// How the method's own estimate of its error compares with the truth.
struct EstimateQuality {
  size_t frames = 0;   // with an estimate and not known to be exact
  size_t covered = 0;  // whose interval holds the true RMSE
  double ratio = 0;    // median of estimated / true RMSE
};

struct CaseSummary {
  size_t frames = 0, exactFrames = 0;
  Spread timeMs;
  double updateMs = 0, selectMs = 0, castMs = 0, composeMs = 0, otherMs = 0;  // means
  double rmse = 0;       // root of the mean squared error over all frames
  double psnr = 0;       // of that; infinite where every frame is exact
  double worstPsnr = 0;  // of the worst frame
  double largest = 0;    // largest error of any channel of any pixel
  double samples = 0, rays = 0, stalePixels = 0, voxelsSampledFraction = 0;  // means
  size_t tooSmall = 0;                      // frames that said their budget was too small
  std::optional<Conformity> conformity;     // with a limit of time
  std::optional<EstimateQuality> estimate;  // where the method makes one
};

/// Of all repeats of a case, first frames left out.
CaseSummary summarise(const BenchReport& report, size_t benchCase);

/// "anytime, 10 %": what a case is called within its group of equal sample distance and threads.
std::string caseName(const BenchCase& c);
/// "10 %", "40 ms", "unlimited"; empty without a budget.
std::string budgetName(const BenchCase& c);
bool sameGroup(const BenchCase& a, const BenchCase& b);

}  // namespace kairos

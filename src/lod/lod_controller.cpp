#include "lod/lod_controller.h"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <unordered_map>

namespace kairos {
namespace {

class FinestController : public LodController {
 public:
  void beginFrame(const LodFramePlan&) override {}
  int choose(const LodTask&, double) override { return 0; }
  void rendered(const LodTask&, int, const LodTiming&) override {}
  void endFrame(double) override {}
};

class ToleranceController : public LodController {
 public:
  explicit ToleranceController(double tolerance) : tolerance_(tolerance) {}
  void beginFrame(const LodFramePlan&) override {}
  int choose(const LodTask& task, double) override {
    int lod = 0;
    for (size_t i = 0; i < task.deviations.size(); ++i)
      if (task.deviations[i] <= tolerance_) lod = int(i);
    return lod;
  }
  void rendered(const LodTask&, int, const LodTiming&) override {}
  void endFrame(double) override {}

 protected:
  double tolerance_;
};

// Five fuzzy sets over [-1, 1]: triangles around -1, -1/2, 0, 1/2 and 1, each reaching to its neighbours.
constexpr int kSets = 5;

double membership(int set, double x) {
  const double centre = (set - kSets / 2) / 2.0;
  return std::max(0.0, 1 - 2 * std::abs(std::clamp(x, -1.0, 1.0) - centre));
}

// Mamdani's rules "if the error is E and its change is C then the adjustment is clamp(E + C / 2)",
// defuzzified by the mean of the sets' centres. In and out: -1 (much too fast) to 1 (much too slow).
double fuzzyAdjustment(double error, double change) {
  double weights = 0, sum = 0;
  for (int e = 0; e < kSets; ++e)
    for (int c = 0; c < kSets; ++c) {
      const double strength = std::min(membership(e, error), membership(c, change));
      const double centre = std::clamp((e - kSets / 2) / 2.0 + (c - kSets / 2) / 4.0, -1.0, 1.0);
      weights += strength;
      sum += strength * centre;
    }
  return weights > 0 ? sum / weights : 0;
}

class FeedbackController : public ToleranceController {
 public:
  using ToleranceController::ToleranceController;
  void beginFrame(const LodFramePlan& plan) override { budget_ = plan.budget; }
  void endFrame(double elapsed) override {
    if (!(budget_ > 0)) return;
    constexpr double kStrongest = 1.0;  // largest change of the tolerance, in powers of two
    const double error = elapsed / budget_ - 1;
    tolerance_ *= std::exp2(kStrongest * fuzzyAdjustment(error, error - lastError_));
    lastError_ = error;
  }

 private:
  double budget_ = 0, lastError_ = 0;
};

// Seconds per unit of work: the mean over the frame, and before there is any, that of an earlier one.
class MeanRate {
 public:
  explicit MeanRate(double prior) : prior_(prior) {}
  void beginFrame() {
    prior_ = rate();
    seconds_ = units_ = 0;
  }
  void add(double seconds, double units) {
    seconds_ += seconds;
    units_ += units;
  }
  double rate() const { return seconds_ > 0 && units_ > 0 ? seconds_ / units_ : prior_; }

 private:
  double prior_, seconds_ = 0, units_ = 0;
};

class PredictiveController : public LodController {
 public:
  explicit PredictiveController(const PredictiveOptions& options)
      : options_(options), processing_{options.secondsPerUnit}, loading_{options.secondsPerVoxel} {}

  void beginFrame(const LodFramePlan& plan) override {
    budget_ = plan.budget;
    importanceLeft_ = importanceTotal_ =
        std::accumulate(plan.importances.begin(), plan.importances.end(), 0.0);
    subvolumesLeft_ = subvolumes_ = plan.subvolumes.size();
    processing_.beginFrame();
    loading_.beginFrame();
    coarsestUnits_ = 0;
  }

  int choose(const LodTask& task, double elapsed) override {
    share_ = std::max(0.0, budget_ - elapsed) * fractionOfRest(task);
    coarsestUnits_ += units(task.work.back());
    importanceLeft_ = std::max(0.0, importanceLeft_ - task.importance);
    --subvolumesLeft_;
    const int closest = closestTo(share_, task);
    if (const Choice* kept = coherentChoice(task, closest)) return kept->lod;
    history_[task.subvolume] = {fractionOfFrame(task), closest};
    return closest;
  }

  void rendered(const LodTask& task, int lod, const LodTiming& timing) override {
    const LodWork& work = task.work[size_t(lod)];
    processing_.add(timing.processingSeconds(), units(work));
    if (!work.resident) loading_.add(timing.loadSeconds, work.voxels);
  }

  void endFrame(double) override {
    infeasible_ = budget_ > 0 && coarsestUnits_ * processing_.rate() > budget_;
  }

  bool infeasible() const override { return infeasible_; }
  double lastShare() const override { return share_; }

 private:
  struct Choice {
    double importance;  // as a fraction of the frame's
    int lod;
  };

  double units(const LodWork& work) const {
    return options_.unit == PredictiveOptions::Unit::slices ? work.slices : work.fragments;
  }

  double fractionOfRest(const LodTask& task) const {
    if (importanceLeft_ > 0) return std::min(1.0, task.importance / importanceLeft_);
    return 1.0 / double(std::max<size_t>(subvolumesLeft_, 1));
  }
  double fractionOfFrame(const LodTask& task) const {
    return importanceTotal_ > 0 ? task.importance / importanceTotal_
                                : 1.0 / double(std::max<size_t>(subvolumes_, 1));
  }

  int closestTo(double share, const LodTask& task) const {
    const double perUnit = processing_.rate();
    if (!(perUnit > 0)) return int(task.work.size()) - 1;  // nothing is known yet: the quickest
    int best = 0;
    double bestDifference = 0;
    for (size_t i = 0; i < task.work.size(); ++i) {
      const double predicted = loadSeconds(loading_.rate(), task.work[i]) + perUnit * units(task.work[i]);
      const double difference = std::abs(predicted - share);
      // At equal distance the coarser one, which is nearer to being loaded in time.
      if (i > 0 && difference > bestDifference) continue;
      best = int(i);
      bestDifference = difference;
    }
    return best;
  }

  // The earlier choice, where it stays.
  const Choice* coherentChoice(const LodTask& task, int closest) const {
    const auto last = history_.find(task.subvolume);
    if (options_.coherence <= 0 || last == history_.end()) return nullptr;
    const Choice& choice = last->second;
    const double change = std::abs(fractionOfFrame(task) - choice.importance);
    const bool steady = change < options_.coherence * choice.importance;
    return steady && std::abs(choice.lod - closest) <= 1 ? &choice : nullptr;
  }

  PredictiveOptions options_;
  MeanRate processing_, loading_;
  double budget_ = 0, importanceLeft_ = 0, importanceTotal_ = 0;
  size_t subvolumesLeft_ = 0, subvolumes_ = 0;
  double coarsestUnits_ = 0, share_ = 0;
  bool infeasible_ = false;
  std::unordered_map<uint32_t, Choice> history_;
};

}  // namespace

std::unique_ptr<LodController> makeFinestController() {
  return std::make_unique<FinestController>();
}

std::unique_ptr<LodController> makeToleranceController(double tolerance) {
  return std::make_unique<ToleranceController>(tolerance);
}

std::unique_ptr<LodController> makeFeedbackController(double tolerance) {
  return std::make_unique<FeedbackController>(tolerance);
}

std::unique_ptr<LodController> makePredictiveController(const PredictiveOptions& options) {
  return std::make_unique<PredictiveController>(options);
}

}  // namespace kairos

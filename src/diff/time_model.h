// Predicting what a step takes from what earlier steps took (Liao, Lai and Chung 2004, equations 1, 3 and 4).
#pragma once

#include <cstdint>

namespace kairos {

/// What a step has to do, in the units of equation 1.
struct StepWork {
  uint64_t bytesRead = 0;  // of the differential file: 4 |P(DF)| in the paper
  uint64_t voxels = 0;     // |V|
  uint64_t projected = 0;  // |P(DF)|; SV under a budget
  uint64_t rayPoints = 0;  // CS, the sampling points along the rays of all changed pixels; TS under a budget
};

/// What a step took, in milliseconds: the terms of equation 1.
struct StepTimes {
  double read = 0, update = 0, select = 0, cast = 0;
  double sum() const { return read + update + select + cast; }
};

/// The constants of equation 1, in milliseconds: C_f per disk sector, C_g per voxel (updating the volume; the
/// paper computes gradients there, here they are part of casting), C_p per projected changed voxel and C_c
/// per sampling point.
struct StepConstants {
  double sector = 0, voxel = 0, projected = 0, rayPoint = 0;
};

/// Measures the constants and predicts with them. Each is taken from the first step that shows it and, when
/// `calibrate`, from every later one (line 19 of the algorithm), so that a machine that becomes slower is
/// followed within a step.
class TimeModel {
 public:
  static constexpr uint64_t kSectorBytes = 4096;  // B

  explicit TimeModel(bool calibrate = true) : calibrate_(calibrate) {}

  void observe(const StepWork& work, const StepTimes& took);
  const StepConstants& constants() const { return constants_; }

  /// Equation 1: the time of all stages.
  double predict(const StepWork& work) const;
  /// Equation 4: the time at the end of casting `rayPoints` when `elapsed` has passed before it.
  double predictWhenCast(double elapsed, uint64_t rayPoints) const {
    return elapsed + double(rayPoints) * constants_.rayPoint;
  }

 private:
  void measure(double& constant, double took, uint64_t units) const;

  bool calibrate_;
  StepConstants constants_;
};

}  // namespace kairos

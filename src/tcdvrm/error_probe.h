// How wrong a frame is, from rays drawn for that purpose.
#pragma once

#include <array>
#include <cstdint>
#include <deque>
#include <optional>
#include <random>
#include <span>
#include <vector>

#include "core/image.h"
#include "diff/frame_renderer.h"
#include "tcdvrm/budget_meter.h"
#include "tcdvrm/packet_colours.h"
#include "tcdvrm/step_levels.h"

namespace kairos {

/// Casts rays of the exact sample distance through pixels drawn at random, independently of what the frame
/// casts otherwise, and compares them with the finished frame. Pixels are drawn in units of 16x16: of a unit
/// one of the 16 sets of 16 pixels that lie 4 apart, which one packet casts. Some units are cast at the
/// longer sample distances too, which tells what these do to the colours.
class ErrorProbe {
 public:
  ErrorProbe(const SceneState& scene, const StepLevels& levels, uint64_t seed);

  /// Forgets what earlier frames showed.
  void restart() { pool_ = {}; }

  int unitsX() const { return unitsX_; }
  int unitCount() const { return unitsX_ * unitsY_; }

  /// Draws from `units`, one from each of as many equally long parts of the list as `budget` (in the meter's
  /// unit) pays for, at most 0.5 % of the pixels (or 32 units), and casts. `unitWork` is what a packet is
  /// expected to take. `density`: times as many.
  CastWork cast(std::span<const uint32_t> units, CastWork unitWork, double budget, BudgetMeter& meter,
                double density = 1);
  uint64_t raysCast() const { return drawn_.size() * kLanes; }

  /// From the rays cast: the RMSE over the whole image, everything outside the units being exact, with a 95 %
  /// interval; nothing when fewer than two units were drawn or none of their rays differs. Calls `inside(x,
  /// y)`: is the pixel one that may be wrong? May be asked again, of a frame that was improved meanwhile.
  /// `modelled(unit)` is the sum of squared errors that is expected of a unit, and `total` that of
  /// all units: the rays tell by what factor it is off (a ratio estimate; Cochran 1977, chapter 6), which is
  /// smoothed over the frames, as long as they agree, since few rays miss rare large errors.
  template <class Modelled, class Inside>
  std::optional<ErrorEstimate> measure(const Image& image, Modelled&& modelled, double total,
                                       Inside&& inside);
  /// Calls `take(x, y, rgba)` with every ray's colour, to be put into the image once it has been measured.
  template <class Inside, class Take>
  void give(const Image& image, Inside&& inside, Take&& take) const;

  /// Mean squared difference, all channels added, of rays of a step level to the exact ones.
  double stepBias(int level) const { return stepBias_[size_t(level)]; }
  void setStepBias(int level, double bias) { stepBias_[size_t(level)] = bias; }

 private:
  struct Drawn {
    uint32_t unit;
    int shiftX, shiftY;
    double represents;  // units of the list it stands for
    PacketColours exact;
    std::array<double, StepLevels::kCount> bias;
    CastWork work;
  };

  void draw(std::span<const uint32_t> units, size_t count);
  void castUnit(Drawn& drawn, bool allLevels, PreparedTile& scratch) const;
  void learnBias();
  /// A drawn unit's sum of squared errors: by its rays, and as expected.
  struct UnitError {
    double seen, modelled;
  };
  struct Pool {
    double units = 0, seen = 0, modelled = 0, variance = 0;
    void add(const Pool& frame);
  };
  Pool poolOf(std::span<const UnitError> errors, double total) const;
  bool agrees(const Pool& frame) const;
  std::optional<ErrorEstimate> estimate(std::span<const UnitError> errors, double total, double imageValues);

  const SceneState& scene_;
  const StepLevels& levels_;
  int unitsX_, unitsY_;
  std::array<std::deque<TileCaster>, StepLevels::kCount> shifted_;  // 4 x 4 shifts
  std::array<double, StepLevels::kCount> stepBias_{};
  /// body(x, y, rgba) for the rays of a drawn unit whose pixels may be wrong.
  template <class Inside, class Body>
  void forRays(const Drawn& unit, const Image& image, Inside&& inside, Body&& body) const;

  Pool pool_, poolBefore_;  // poolBefore_: without this frame
  std::mt19937_64 random_;
  std::vector<Drawn> drawn_;
};

template <class Inside, class Body>
void ErrorProbe::forRays(const Drawn& unit, const Image& image, Inside&& inside, Body&& body) const {
  const int x0 = int(unit.unit) % unitsX_ * kUnitEdge + unit.shiftX;
  const int y0 = int(unit.unit) / unitsX_ * kUnitEdge + unit.shiftY;
  for (int lane = 0; lane < kLanes; ++lane) {
    const int x = x0 + lane % kTileEdge * kTileEdge, y = y0 + lane / kTileEdge * kTileEdge;
    if (x < image.width && y < image.height && inside(x, y)) body(x, y, unit.exact.rgba[lane]);
  }
}

template <class Modelled, class Inside>
std::optional<ErrorEstimate> ErrorProbe::measure(const Image& image, Modelled&& modelled, double total,
                                                 Inside&& inside) {
  if (drawn_.size() < 2) return std::nullopt;
  std::vector<UnitError> errors;
  for (const Drawn& unit : drawn_) {
    double sum = 0;
    forRays(unit, image, inside, [&](int x, int y, const float* rgba) {
      sum += double(squaredDistance(image.pixel(x, y), load4(rgba)));
    });
    errors.push_back({sum * kUnitEdge * kUnitEdge / kLanes, modelled(unit.unit)});
  }
  return estimate(errors, total, double(image.width) * double(image.height) * 4);
}

template <class Inside, class Take>
void ErrorProbe::give(const Image& image, Inside&& inside, Take&& take) const {
  for (const Drawn& unit : drawn_) forRays(unit, image, inside, take);
}

}  // namespace kairos

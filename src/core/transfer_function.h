// The transfer function: from a scalar to linear colour and opacity, and its table for one sample distance.
#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <vector>

#include "core/vec3.h"

namespace kairos {

/// Values below `lo` classify as at `lo`, above `hi` as at `hi`.
struct ValueRange {
  float lo = 0, hi = 1;
  bool operator==(const ValueRange&) const = default;
};

/// A piecewise-linear function of the scalar. Points are sorted by value; two points of equal value make a
/// step. Colour is linear and straight (not premultiplied); opacity is the opacity over one unit distance, in
/// [0, 1].
class TransferFunction {
 public:
  struct ColourPoint {
    double value;
    Vec3d colour;
  };
  struct OpacityPoint {
    double value, opacity;
  };

  TransferFunction() = default;
  /// Throws OptionError when either list is empty, unsorted, not finite, or out of [0, 1] (opacity) or below
  /// 0 (colour).
  TransferFunction(std::vector<ColourPoint> colours, std::vector<OpacityPoint> opacities);

  const std::vector<ColourPoint>& colourPoints() const { return colours_; }
  const std::vector<OpacityPoint>& opacityPoints() const { return opacities_; }
  /// First and last value of any point.
  ValueRange domain() const;
  /// The same function stretched linearly so that `domain()` becomes `range`.
  TransferFunction stretchedTo(ValueRange range) const;

  Vec3d colour(double value) const;
  double opacity(double value) const;

 private:
  std::vector<ColourPoint> colours_;
  std::vector<OpacityPoint> opacities_;
};

/// Classification of samples taken `distanceInUnits` unit distances apart: nodes of premultiplied,
/// opacity-corrected linear RGBA, linear in between. This table *is* the transfer function of every renderer,
/// the scalar oracle included. The node count is the smaller of 256 and 1024 that keeps every channel within
/// 2e-3 of the function itself, over the sample distance or, if that is longer, a unit distance; else 4096.
///
/// For pre-integration its nodes are densities instead: optical depth over the distance, and that times the
/// colour. Then every channel's share of a unit distance's opacity stays within 2e-4 of the function's.
class ClassificationTable {
 public:
  enum class Content { opacities, densities };

  ClassificationTable() = default;
  ClassificationTable(const TransferFunction& tf, ValueRange range, double distanceInUnits,
                      Content content = Content::opacities);

  struct alignas(16) Node {
    float r, g, b, a;
  };

  /// A node and the difference to the next one: what a sample between them needs, in one cache line.
  struct alignas(32) Interval {
    Node at, slope;
  };

  /// A node of densities, the difference to the next one, and each channel's integral from the first node to
  /// here in units of `integralUnit()`: whole numbers, so that their differences are exact.
  struct alignas(64) DensityInterval {
    Node at, slope;
    int32_t integral[4];
    int32_t padding[4];
  };

  int nodeCount() const { return int(nodes_.size()) - 1; }  // one copy of the last node pads the end
  const Node* nodes() const { return nodes_.data(); }
  /// nodeCount() entries; the last has slope 0. One more follows that classifies to nothing, for lanes
  /// without a sample.
  const Interval* intervals() const { return intervals_.data(); }
  /// For Content::densities, else empty: nodeCount() + 1 entries. Entry i + 1 starts at node i; the first and
  /// the last, whose slopes are 0, stand for all values below and above the range.
  const std::vector<DensityInterval>& densities() const { return densities_; }
  float integralUnit() const { return integralUnit_; }
  ValueRange range() const { return range_; }
  /// Table coordinate of a value is (value - range.lo) * scale(), clamped to [0, nodeCount - 1].
  float scale() const { return scale_; }
  /// A value strictly below it, or strictly above `lastVisible`, classifies to exactly zero.
  float firstVisible() const { return firstVisible_; }
  float lastVisible() const { return lastVisible_; }

  /// Does any value in [lo, hi] classify to a non-zero opacity? Exact for the table, widened by one node on
  /// each side (as OSPRay's LinearTransferFunction does), so that rounding in a kernel can never make it
  /// wrong.
  bool visible(float lo, float hi) const;

  template <class Real>
  std::array<Real, 4> classify(Real value) const;

 private:
  std::vector<Node> nodes_;
  std::vector<Interval> intervals_;
  void integrate();

  std::vector<DensityInterval> densities_;
  float integralUnit_ = 0;
  std::vector<int>
      nextVisibleNode_;  // for each node the first node at or after it with a > 0; nodeCount if none
  ValueRange range_;
  float scale_ = 0, firstVisible_ = 0, lastVisible_ = 0;
};

template <class Real>
std::array<Real, 4> ClassificationTable::classify(Real value) const {
  const Real last = Real(nodeCount() - 1);
  Real x = (value - Real(range_.lo)) * Real(scale_);
  x = x > Real(0) ? (x < last ? x : last) : Real(0);
  const int i = int(x);
  const Real f = x - Real(i);
  const Node &p = nodes_[size_t(i)], &q = nodes_[size_t(i) + 1];
  const auto lerp = [f](float a, float b) { return Real(a) + f * (Real(b) - Real(a)); };
  return {lerp(p.r, q.r), lerp(p.g, q.g), lerp(p.b, q.b), lerp(p.a, q.a)};
}

}  // namespace kairos

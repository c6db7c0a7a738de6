#include "core/transfer_function.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "core/compositing.h"
#include "core/error.h"

namespace kairos {
namespace {

template <class Points>
void checkSorted(const Points& points, const char* what) {
  if (points.empty()) throw OptionError("transfer function", std::string("no ") + what + " points");
  for (size_t i = 0; i < points.size(); ++i) {
    if (!std::isfinite(points[i].value))
      throw OptionError("transfer function",
                        std::string(what) + " point " + std::to_string(i) + " has no finite value");
    if (i > 0 && points[i].value < points[i - 1].value)
      throw OptionError("transfer function", std::string(what) + " point " + std::to_string(i) +
                                                 " at value " + std::to_string(points[i].value) +
                                                 " comes before its predecessor");
  }
}

// Linear interpolation between the points around `value`; at a step the later point wins.
template <class Points, class Get>
auto interpolate(const Points& points, double value, Get get) {
  const auto after = std::upper_bound(points.begin(), points.end(), value,
                                      [](double v, const auto& p) { return v < p.value; });
  if (after == points.begin()) return get(points.front());
  if (after == points.end()) return get(points.back());
  const auto before = std::prev(after);
  const double f = (value - before->value) / (after->value - before->value);
  return get(*before) * (1 - f) + get(*after) * f;
}

}  // namespace

TransferFunction::TransferFunction(std::vector<ColourPoint> colours, std::vector<OpacityPoint> opacities)
    : colours_(std::move(colours)), opacities_(std::move(opacities)) {
  checkSorted(colours_, "colour");
  checkSorted(opacities_, "opacity");
  for (const ColourPoint& p : colours_)
    for (int c = 0; c < 3; ++c)
      if (!(p.colour[c] >= 0) || !std::isfinite(p.colour[c]))
        throw OptionError("transfer function", "colour at value " + std::to_string(p.value) + " is " +
                                                   std::to_string(p.colour[c]) + ", expected a number >= 0");
  for (const OpacityPoint& p : opacities_)
    if (!(p.opacity >= 0 && p.opacity <= 1))
      throw OptionError("transfer function", "opacity at value " + std::to_string(p.value) + " is " +
                                                 std::to_string(p.opacity) + ", expected a number in [0, 1]");
}

ValueRange TransferFunction::domain() const {
  return {float(std::min(colours_.front().value, opacities_.front().value)),
          float(std::max(colours_.back().value, opacities_.back().value))};
}

TransferFunction TransferFunction::stretchedTo(ValueRange range) const {
  const ValueRange from = domain();
  const double width = double(from.hi) - from.lo;
  const double scale = width > 0 ? (double(range.hi) - range.lo) / width : 0;
  TransferFunction tf = *this;
  for (ColourPoint& p : tf.colours_) p.value = range.lo + (p.value - from.lo) * scale;
  for (OpacityPoint& p : tf.opacities_) p.value = range.lo + (p.value - from.lo) * scale;
  return tf;
}

Vec3d TransferFunction::colour(double value) const {
  return interpolate(colours_, value, [](const ColourPoint& p) { return p.colour; });
}

double TransferFunction::opacity(double value) const {
  return interpolate(opacities_, value, [](const OpacityPoint& p) { return p.opacity; });
}

namespace {

using Content = ClassificationTable::Content;

std::array<double, 4> premultiplied(const TransferFunction& tf, double value, double distanceInUnits,
                                    Content content) {
  const double opacity = tf.opacity(value);
  const double alpha = content == Content::opacities ? correctedOpacity(opacity, distanceInUnits)
                                                     : opticalDepth(opacity, distanceInUnits);
  const Vec3d c = tf.colour(value) * alpha;
  return {c.x, c.y, c.z, alpha};
}

std::vector<ClassificationTable::Node> tabulate(const TransferFunction& tf, ValueRange range, double distance,
                                                Content content, int n) {
  std::vector<ClassificationTable::Node> nodes;
  nodes.reserve(size_t(n) + 1);
  for (int i = 0; i < n; ++i) {
    const double value = range.lo + (double(range.hi) - range.lo) * i / (n - 1);
    const auto c = premultiplied(tf, value, distance, content);
    nodes.push_back({float(c[0]), float(c[1]), float(c[2]), float(c[3])});
  }
  nodes.push_back(nodes.back());
  return nodes;
}

// Largest difference between the table and the function, at four places in every interval; for densities,
// what it makes of a unit distance's opacity.
double tableError(const std::vector<ClassificationTable::Node>& nodes, const TransferFunction& tf,
                  ValueRange range, double distance, Content content) {
  const int n = int(nodes.size()) - 1;
  double worst = 0;
  for (int i = 0; i + 1 < n; ++i)
    for (double f : {0.2, 0.4, 0.6, 0.8}) {
      const double value = range.lo + (double(range.hi) - range.lo) * (i + f) / (n - 1);
      const auto c = premultiplied(tf, value, distance, content);
      const double weight = content == Content::opacities ? 1 : std::exp(-c[3] / distance) / distance;
      const auto &p = nodes[size_t(i)], &q = nodes[size_t(i) + 1];
      worst = std::max({worst, weight * std::abs(p.r + f * (q.r - p.r) - c[0]),
                        weight * std::abs(p.g + f * (q.g - p.g) - c[1]),
                        weight * std::abs(p.b + f * (q.b - p.b) - c[2]),
                        weight * std::abs(p.a + f * (q.a - p.a) - c[3])});
    }
  return worst;
}

}  // namespace

ClassificationTable::ClassificationTable(const TransferFunction& tf, ValueRange range, double distanceInUnits,
                                         Content content)
    : range_(range) {
  if (!std::isfinite(range.lo) || !std::isfinite(range.hi) || range.hi < range.lo)
    throw OptionError("--range", "expected two finite numbers LO,HI with LO <= HI");
  // Below that, the table's nodes per value overflow a float.
  constexpr double kNarrowest = 4096 / double(std::numeric_limits<float>::max());
  if (const double width = double(range.hi) - double(range.lo); width > 0 && width < kNarrowest)
    throw OptionError("--range", "LO and HI are closer together than 1.3e-35: give the data in larger units");
  if (!(distanceInUnits > 0) || !std::isfinite(distanceInUnits))
    throw OptionError("--unit-distance", "the sample distance over the unit distance must be above 0");
  // Over a short distance every opacity is small; what counts is the error over a unit distance.
  const double tolerance = content == Content::opacities ? 2e-3 * std::min(1.0, distanceInUnits) : 2e-4;
  for (int n : {256, 1024, 4096}) {
    nodes_ = tabulate(tf, range, distanceInUnits, content, n);
    if (tableError(nodes_, tf, range, distanceInUnits, content) <= tolerance) break;
  }
  const int n = nodeCount();
  for (size_t i = 0; i < size_t(n); ++i) {
    const Node &p = nodes_[i], &q = nodes_[i + 1];
    intervals_.push_back({p, {q.r - p.r, q.g - p.g, q.b - p.b, q.a - p.a}});
  }
  intervals_.push_back({});
  scale_ = range.hi > range.lo ? float((n - 1) / (double(range.hi) - range.lo)) : 0.0f;
  nextVisibleNode_.assign(size_t(n) + 1, n);
  for (int i = n - 1; i >= 0; --i)
    nextVisibleNode_[size_t(i)] = nodes_[size_t(i)].a > 0 ? i : nextVisibleNode_[size_t(i) + 1];
  int last = n - 1;
  while (last >= 0 && nodes_[size_t(last)].a <= 0) --last;
  constexpr float inf = std::numeric_limits<float>::infinity();
  const int first = nextVisibleNode_[0];
  // Two nodes of slack: one because the table is interpolated, one for the kernel's rounding.
  const auto valueAt = [&](int node) {
    return float(range.lo + (double(range.hi) - range.lo) * node / (n - 1));
  };
  firstVisible_ = first == n ? inf : first <= 1 ? -inf : valueAt(first - 2);
  lastVisible_ = first == n ? -inf : last >= n - 2 ? inf : valueAt(last + 2);
  if (content == Content::densities) integrate();
}

void ClassificationTable::integrate() {
  const int n = nodeCount();
  const auto channels = [](const Node& node) { return std::array<float, 4>{node.r, node.g, node.b, node.a}; };
  std::array<double, 4> sum{};
  std::vector<std::array<double, 4>> sums{sum};  // up to each node
  for (int i = 0; i + 1 < n; ++i) {
    const auto p = channels(nodes_[size_t(i)]), q = channels(nodes_[size_t(i) + 1]);
    for (size_t c = 0; c < 4; ++c) sum[c] += 0.5 * (double(p[c]) + double(q[c]));
    sums.push_back(sum);
  }
  const double largest = std::max(*std::max_element(sum.begin(), sum.end()), 1e-30);
  integralUnit_ = float(largest * 0x1p-30);
  densities_.assign(1, {nodes_[0], {}, {}, {}});
  for (size_t i = 0; i < size_t(n); ++i) {
    DensityInterval interval{intervals_[i].at, intervals_[i].slope, {}, {}};
    for (size_t c = 0; c < 4; ++c)
      interval.integral[c] = int32_t(std::lround(sums[i][c] / double(integralUnit_)));
    densities_.push_back(interval);
  }
}

bool ClassificationTable::visible(float lo, float hi) const {
  // Equal values interpolate to themselves, and what lies at or below the first node is clamped to it: exact
  // in every kernel. So a ramp that rises from the background's value does not make empty space visible.
  if (lo == hi && hi <= range_.lo) return nodes_[0].a > 0;
  const int n = nodeCount();
  const auto node = [&](float v) {
    const double x = (double(v) - range_.lo) * scale_;
    return x > 0 ? (x < n - 1 ? int(x) : n - 1) : 0;
  };
  const int from = std::max(0, node(lo) - 1), to = std::min(n - 1, node(hi) + 2);
  return nextVisibleNode_[size_t(from)] <= to;
}

}  // namespace kairos

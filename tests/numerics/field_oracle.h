// What the tests of this folder share: expectations against the field itself, and where float arithmetic
// ends.
#pragma once

#include "raycast/cast_frame.h"

namespace kairos::test {

/// The promise of `--precision full`: per channel, against double precision.
inline constexpr double kFullPrecision = 1e-5;

/// How far a kernel's float position within a brick can be from the exact one, in voxels. Positions stay
/// below 32, so the first sample's is rounded by 2^-20 and the fused step to the present one by 2^-20; the
/// rounded direction, 2^-25 of a voxel a voxel, has drifted by at most 28 of those over a brick's diagonal.
inline constexpr double kPositionError = 2 * 0x1p-20 + 28 * 0x1p-25;

/// Every kernel and the reference against an oracle that knows neither bricks nor segments
/// (castFieldDirectly), rays running to their ends: kernels within `tolerance` per channel (average: times
/// the number of samples), the reference within 1e-9 of the channel's size, which is double precision over a
/// thousand samples. Returns the sum of the oracle's opacities, for the test to see that it saw something.
double expectCastsTheField(const Scene& scene, RenderSettings settings, const std::string& what,
                           double tolerance = kFullPrecision);

/// Largest difference of any channel.
double largestDifference(const std::vector<double>& a, const std::vector<double>& b);
double rootMeanSquareDifference(const std::vector<double>& a, const std::vector<double>& b);
std::vector<double> asDoubles(const CastFrame& frame);

/// Opacity `alpha` for every value from 0 to 1, in one colour.
TransferFunction homogeneous(double alpha, const Vec3d& colour = {1, 1, 1});

/// Parallel rays towards -z from a plane at height `z` above the scene's index origin, `pixels` squared,
/// `height` world units wide around (x, y); rays run to their ends.
RenderSettings fromAbove(const Scene& scene, const TransferFunction& tf, const Vec3d& eye, double height,
                         int pixels);

}  // namespace kairos::test

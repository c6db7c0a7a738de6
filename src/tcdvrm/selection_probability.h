// How likely random sampling is to find a changed pixel.
#pragma once

#include <cstdint>

namespace kairos {

/// Equation 2 of Liao, Lai and Chung 2004: the probability that a pixel which `influence` of `changed` voxels
/// influence is determined when `sampled` of them are drawn at random without replacement,
///   PS = 1 - C(changed - influence, sampled) / C(changed, sampled)   where sampled + influence <= changed,
///   PS = 1                                                           elsewhere.
/// `influence` and `sampled` are at most `changed`.
double selectionProbability(uint64_t changed, uint64_t influence, uint64_t sampled);

}  // namespace kairos

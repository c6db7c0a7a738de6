#include "app/sequence_info.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <vector>

#include "app/lattice_info.h"
#include "app/sequence_summary.h"
#include "app/text_format.h"
#include "io/file_bytes.h"

namespace kairos {

namespace {

using Json = nlohmann::ordered_json;

constexpr size_t kTableRows = 20;
constexpr double kBarLength = 40;

std::string rangeText(const ValueRange& range) {
  return formatted("%.6g to %.6g", range.lo, range.hi);
}

std::string keyFramesText(const SequenceManifest& manifest) {
  std::vector<std::string> keys;
  for (const SequenceStep& s : manifest.steps)
    if (s.key) keys.push_back(std::to_string(s.step));
  return std::to_string(keys.size()) + " (" + (keys.size() == 1 ? "step " : "steps ") + listText(keys, 8) +
         ")";
}

/// Neighbouring steps, shown as one row of the table.
struct StepGroup {
  const SequenceStep *first, *last;
  double share = 0;  // median
  double bytes = 0;  // mean
  ValueRange range;
};

StepGroup groupOf(const SequenceManifest& manifest, size_t begin, size_t end) {
  StepGroup group{&manifest.steps[begin], &manifest.steps[end - 1], 0, 0, manifest.steps[begin].range};
  std::vector<double> shares;
  for (size_t i = begin; i < end; ++i) {
    const SequenceStep& s = manifest.steps[i];
    shares.push_back(double(s.changedVoxels) / std::max(1.0, double(manifest.lattice.domain.voxelCount())));
    group.bytes += double(s.differentialBytes) / double(end - begin);
    group.range = {std::min(group.range.lo, s.range.lo), std::max(group.range.hi, s.range.hi)};
  }
  group.share = median(shares);
  return group;
}

/// Changed share, size and range along the sequence; long ones a few steps to a row.
std::string changesTable(const SequenceManifest& manifest) {
  const size_t count = manifest.steps.size(), perRow = (count - 1 + kTableRows - 1) / kTableRows;
  std::vector<StepGroup> groups;
  for (size_t i = 1; i < count; i += perRow)
    groups.push_back(groupOf(manifest, i, std::min(count, i + perRow)));
  double largest = 0;
  for (const StepGroup& g : groups) largest = std::max(largest, g.share);
  std::string table = formatted("\n  %-14s%11s  %9s  %s\n", "steps", "changed", "a step", "values");
  for (const StepGroup& g : groups) {
    std::string steps = std::to_string(g.first->step);
    if (g.first != g.last) steps += " to " + std::to_string(g.last->step);
    const auto bar = size_t(largest > 0 ? std::lround(kBarLength * g.share / largest) : 0);
    std::string row =
        formatted("  %-14s%11s  %9s  %-24s%s", steps.c_str(), percentText(g.share).c_str(),
                  byteText(g.bytes).c_str(), rangeText(g.range).c_str(), std::string(bar, '#').c_str());
    row.erase(row.find_last_not_of(' ') + 1);
    table += row + "\n";
  }
  return table;
}

std::string heading(const SequenceReader& reader) {
  const SequenceManifest& m = reader.manifest();
  const std::string span = formatted(", %lld to %lld", static_cast<long long>(m.steps.front().step),
                                     static_cast<long long>(m.steps.back().step));
  if (m.complete)
    return reader.directory() + ": sequence of " + countText(m.steps.size(), "step") + span + "\n";
  return reader.directory() + ": unfinished sequence, " + std::to_string(m.steps.size()) + " of " +
         countText(m.inputs.size(), "step") + span + "; the same kairos diff command goes on\n";
}

Json stepJson(const SequenceManifest& manifest, const SequenceStep& s) {
  Json j;
  j["step"] = s.step;
  j["key"] = s.key;
  j["differential"] = s.differential;
  j["changed_voxels"] = s.changedVoxels;
  j["changed_share"] = double(s.changedVoxels) / std::max(1.0, double(manifest.lattice.domain.voxelCount()));
  j["active_voxels"] = s.activeVoxels;
  j["range"] = {s.range.lo, s.range.hi};
  j["non_finite"] = s.nonFinite;
  j["key_bytes"] = s.keyBytes;
  j["differential_bytes"] = s.differentialBytes;
  j["state_checksum"] = hexOf(s.stateChecksum);
  return j;
}

}  // namespace

std::string sequenceText(const SequenceReader& reader) {
  const SequenceManifest& m = reader.manifest();
  const SequenceSummary summary = summarise(m);
  std::string text = heading(reader) + latticeText(m.lattice, m.gridName);
  text += infoLine("range", rangeText(m.range()) + " over all steps");
  text += infoLine("NaN, Inf", nonFiniteText(summary));
  text += infoLine("tolerance", m.tolerance == 0 ? "0: every step exact" : formatted("%.9g", m.tolerance));
  text += infoLine("key frames", keyFramesText(m));
  text += infoLine("changes", changesText(summary));
  text += infoLine("size", byteText(double(summary.bytes)) + ": key frames " +
                               byteText(double(summary.keyBytes)) + ", differential files " +
                               byteText(double(summary.differentialBytes)) + bytesPerVoxelText(summary));
  if (m.steps.size() > 1) text += changesTable(m);
  return text;
}

Json sequenceJson(const SequenceReader& reader) {
  const SequenceManifest& m = reader.manifest();
  const SequenceSummary summary = summarise(m);
  Json j;
  j["kind"] = "sequence";
  j["path"] = reader.directory();
  j["complete"] = m.complete;
  j.update(latticeJson(m.lattice, m.gridName));
  j["tolerance"] = m.tolerance;
  j["key_every"] = m.keyEvery;
  j["range"] = {m.range().lo, m.range().hi};
  j["non_finite_steps"] = summary.nonFiniteSteps;
  j["key_frames"] = summary.keyFrames;
  j["changed_voxels"] = summary.changedVoxels;
  j["changed_share_median"] = summary.medianShare();
  j["changed_share_max"] = summary.largestShare();
  j["bytes"] = summary.bytes;
  j["key_bytes"] = summary.keyBytes;
  j["differential_bytes"] = summary.differentialBytes;
  if (summary.changedVoxels > 0)
    j["bytes_per_changed_voxel"] = summary.bytesPerChangedVoxel();
  else
    j["bytes_per_changed_voxel"] = nullptr;
  j["inputs"] = m.inputs;
  j["steps"] = Json::array();
  for (const SequenceStep& s : m.steps) j["steps"].push_back(stepJson(m, s));
  return j;
}

}  // namespace kairos

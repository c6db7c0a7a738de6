#include "app/sequence_check.h"

#include <cmath>
#include <optional>

#include "core/error.h"

namespace kairos {

namespace {

/// The state as the chain rebuilds it; empty behind damage, until the next key frame.
class Chain {
 public:
  Chain(const SequenceReader& reader, SequenceCheck& result) : reader_(reader), result_(result) {}

  void advance(size_t index) {
    const SequenceStep& entry = reader_.manifest().steps[index];
    std::optional<ChangedVoxels> changes;
    if (entry.differential) changes = attempt([&] { return reader_.readChanges(index); });
    if (field_ && changes)
      apply(*changes, entry);
    else
      field_.reset();
    if (entry.key) {
      std::optional<Field> key = attempt([&] { return reader_.readKey(index); });
      if (!field_) field_ = std::move(key);
    }
    if (!field_) return;
    compareStatistics(entry);
    ++result_.stepsRebuilt;
  }

 private:
  template <class Read>
  auto attempt(Read&& read) -> std::optional<decltype(read())> {
    try {
      return read();
    } catch (const Error& e) {
      result_.problems.push_back(e.what());
      return std::nullopt;
    }
  }

  void apply(const ChangedVoxels& changes, const SequenceStep& entry) {
    applyChanges(changes, *field_);
    if (stateChecksum(*field_) == entry.stateChecksum) return;
    problem(entry, "the differential files do not lead to the state that sequence.json states");
    field_.reset();
  }

  void compareStatistics(const SequenceStep& entry) {
    const FieldStatistics found = fieldStatistics(*field_);
    const double allowed = reader_.manifest().tolerance;
    if (std::abs(found.lo - double(entry.range.lo)) > allowed ||
        std::abs(found.hi - double(entry.range.hi)) > allowed)
      problem(entry, "its values are not in the range that sequence.json states");
    if (found.nonFinite != entry.nonFinite)
      problem(entry, "it has " + std::to_string(found.nonFinite) +
                         " NaN or infinite voxels, sequence.json states " + std::to_string(entry.nonFinite));
  }

  void problem(const SequenceStep& entry, const std::string& text) {
    result_.problems.push_back(reader_.directory() + ": step " + std::to_string(entry.step) + ": " + text);
  }

  const SequenceReader& reader_;
  SequenceCheck& result_;
  std::optional<Field> field_;
};

}  // namespace

SequenceCheck checkSequence(const SequenceReader& reader, const StopFlag& stop,
                            const ProgressCallback& progress) {
  SequenceCheck result;
  Chain chain(reader, result);
  for (size_t i = 0; i < reader.stepCount(); ++i) {
    stop.check();
    chain.advance(i);
    if (progress) progress(int64_t(i + 1), int64_t(reader.stepCount()));
  }
  return result;
}

}  // namespace kairos

#include "app/input_arguments.h"

#include <CLI/CLI.hpp>

#include "app/option_values.h"
#include "core/error.h"
#include "io/sequence.h"

namespace kairos {

namespace {

constexpr int64_t kLargestDimension = 1 << 20;
constexpr int64_t kLargestVoxelCount = int64_t(1) << 40;

Vec3i parsedDims(const std::string& text) {
  const std::string expected = "three whole numbers X,Y,Z in [1, " + std::to_string(kLargestDimension) + "]";
  const std::vector<std::string> words = commaSeparated(text);
  if (words.size() != 3) refuseValue("--dims", text, expected);
  Vec3i dims;
  for (int axis = 0; axis < 3; ++axis) {
    const std::optional<int64_t> n = parsedInteger(words[size_t(axis)]);
    if (!n || *n < 1 || *n > kLargestDimension) refuseValue("--dims", text, expected);
    dims[axis] = int32_t(*n);
  }
  if (int64_t(dims.x) * dims.y > kLargestVoxelCount / dims.z)
    refuseValue("--dims", text, "at most " + std::to_string(kLargestVoxelCount) + " voxels");
  return dims;
}

Vec3d parsedVoxelSize(const std::string& text) {
  static const char* const kExpected = "one number S or three X,Y,Z in [1e-9, 1e9]";
  const bool one = text.find(',') == std::string::npos;
  const Vec3d size = vectorOption("--voxel-size", one ? text + "," + text + "," + text : text, kExpected);
  for (int axis = 0; axis < 3; ++axis)
    if (size[axis] < 1e-9 || size[axis] > 1e9) refuseValue("--voxel-size", text, kExpected);
  return size;
}

}  // namespace

void InputArguments::addTo(CLI::App& command, const std::string& inputHelp) {
  command.add_option("INPUT", inputs_, inputHelp)->required();
  command
      .add_option("--grid", grid_,
                  "OpenVDB grid to read [the only sensible one, or an error that lists them]")
      ->type_name("NAME")
      ->group("What the input holds");
  command.add_option("--dims", dims_, "raw files: voxels along x, y and z, x fastest in the file")
      ->type_name("X,Y,Z")
      ->group("What the input holds");
  command.add_option("--type", type_, "raw files: u8, u16 or f32 (little-endian)")
      ->type_name("TYPE")
      ->group("What the input holds");
  command.add_option("--voxel-size", voxelSize_, "raw files: world units per voxel, one number or X,Y,Z [1]")
      ->type_name("S")
      ->group("What the input holds");
}

bool InputArguments::isSequence() const {
  return inputs_.size() == 1 && kairos::isSequence(inputs_.front());
}

std::string InputArguments::sequenceDirectory() const {
  const std::pair<const char*, const std::string*> given[] = {
      {"--grid", &grid_}, {"--dims", &dims_}, {"--type", &type_}, {"--voxel-size", &voxelSize_}};
  for (const auto& [option, value] : given)
    if (!value->empty())
      throw OptionError(
          option, "is for a simulation's files; " + inputs_.front() + " is a sequence, which brings its own");
  return inputs_.front();
}

InputOptions InputArguments::options() const {
  InputOptions options;
  options.grid = grid_;
  if (dims_.empty()) {
    if (!type_.empty()) throw OptionError("--type", "needs --dims X,Y,Z as well (both describe raw files)");
    if (!voxelSize_.empty())
      throw OptionError("--voxel-size", "needs --dims X,Y,Z and --type as well (they describe raw files)");
    return options;
  }
  if (type_.empty())
    throw OptionError("--dims", "needs --type u8, u16 or f32 as well (both describe raw files)");
  if (!grid_.empty()) throw OptionError("--grid", "raw files, which --dims describes, have no grids");
  const size_t type = choiceOption("--type", type_, {"u8", "u16", "f32"});
  options.raw = RawFormat{parsedDims(dims_), ElementType(type), {1, 1, 1}};
  if (!voxelSize_.empty()) options.raw->voxelSize = parsedVoxelSize(voxelSize_);
  return options;
}

std::unique_ptr<InputSeries> InputArguments::open() const {
  const InputOptions checked = options();
  for (const std::string& input : inputs_)
    if (kairos::isSequence(input))
      throw InputError(input, "is a sequence already; expected a simulation's files");
  return InputSeries::open(inputs_, checked);
}

}  // namespace kairos

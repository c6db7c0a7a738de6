// Headerless raw files: little-endian values, x fastest, one file per step.
#include <cmath>

#include "core/error.h"
#include "io/file_bytes.h"
#include "io/series_formats.h"

namespace kairos {
namespace {

std::string triple(const Vec3i& v) {
  return std::to_string(v.x) + "," + std::to_string(v.y) + "," + std::to_string(v.z);
}

void checkFormat(const RawFormat& format) {
  constexpr int32_t kLargest = 1 << 20;
  for (int a = 0; a < 3; ++a)
    if (format.dims[a] < 1 || format.dims[a] > kLargest)
      throw OptionError("--dims", triple(format.dims) + ": expected three numbers in [1, " +
                                      std::to_string(kLargest) + "]");
  for (int a = 0; a < 3; ++a)
    if (!(format.voxelSize[a] > 0) || !std::isfinite(format.voxelSize[a]))
      throw OptionError("--voxel-size",
                        std::to_string(format.voxelSize[a]) + ": expected a finite number above 0");
}

class RawSeries : public InputSeries {
 public:
  RawSeries(std::vector<StepFile> steps, const RawFormat& format) : format_(format) {
    steps_ = std::move(steps);
    checkFormat(format);
    lattice_ = {format.type, 0, Affine::scale(format.voxelSize), {{}, format.dims}, true};
    for (const StepFile& step : steps_) checkSize(InputFile(step.path));
  }

  Field read(size_t index) const override {
    const InputFile file(steps_.at(index).path);
    checkSize(file);
    return dispatch(format_.type, [&]<class T>() {
      std::vector<T> values(size_t(lattice_.domain.voxelCount()));
      file.readAt(0, reinterpret_cast<char*>(values.data()), values.size() * sizeof(T));
      return fieldFromDense(values.data(), format_.dims, T(0));
    });
  }

  uint64_t bytes(size_t) const override { return expectedBytes(); }

 private:
  uint64_t expectedBytes() const {
    return uint64_t(lattice_.domain.voxelCount()) * uint64_t(bytesPerVoxel(format_.type));
  }

  void checkSize(const InputFile& file) const {
    if (file.size() != expectedBytes())
      throw InputError(file.path(), "has " + std::to_string(file.size()) + " bytes, expected " +
                                        std::to_string(expectedBytes()) + " for " + triple(format_.dims) +
                                        " voxels of type " + std::string(name(format_.type)));
  }

  RawFormat format_;
};

}  // namespace

std::unique_ptr<InputSeries> openRawSeries(std::vector<StepFile> steps, const RawFormat& format) {
  return std::make_unique<RawSeries>(std::move(steps), format);
}

}  // namespace kairos

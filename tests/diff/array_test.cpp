// Rendering straight from a simulation's arrays.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "core/error.h"
#include "sequences.h"

namespace kairos::test {
namespace {

constexpr Vec3i kDims{30, 26, 34};

/// A wave that runs through one half of the domain and hardly moves in the other.
template <class T>
std::vector<T> waveAt(ElementType type, int step) {
  std::vector<T> values;
  for (int z = 0; z < kDims.z; ++z)
    for (int y = 0; y < kDims.y; ++y)
      for (int x = 0; x < kDims.x; ++x) {
        const double speed = x < 12 ? 0.4 : 0.002;
        const double v = 0.5 + 0.45 * std::sin(0.35 * x + 0.2 * y - 0.25 * z + speed * step);
        values.push_back(T(v * fullScale(type)));
      }
  return values;
}

template <class T>
class Arrays : public testing::Test {
 protected:
  static constexpr ElementType kType = elementTypeOf<T>();
  Lattice lattice_ = denseLattice(kType, kDims, {-3, 5, 11});
  RenderSettings settings_ = settingsFor({"", lattice_, {}}, "iso", softTransferFunction(kType), 40, 32);
  double tolerance_ = fullScale(kType) / 100;
};
using ElementTypes = testing::Types<uint8_t, uint16_t, float>;
TYPED_TEST_SUITE(Arrays, ElementTypes);

TYPED_TEST(Arrays, GiveTheFramesOfTheirFieldsAndChanges) {
  using T = TypeParam;
  for (const double tolerance : {0.0, this->tolerance_}) {
    DifferentialRenderer fromArrays(this->lattice_, this->settings_, withMethod(Method::segments));
    DifferentialRenderer fromChanges(this->lattice_, this->settings_, withMethod(Method::segments, 2));
    DifferentialRenderer full(this->lattice_, this->settings_, withMethod(Method::full));
    ThreadPool pool(1);
    std::optional<ChangeDetector> detector;
    for (int step = 0; step < 8; ++step) {
      const std::vector<T> array = waveAt<T>(this->kType, step);
      const Field field = fieldFromDense(array.data(), kDims, T(0), this->lattice_.domain.lo);
      if (!detector) {
        detector.emplace(field, tolerance);
        fromChanges.start(field);
      } else {
        fromChanges.update(detector->advance(field, pool));
      }
      fromArrays.render(array.data(), tolerance);
      ASSERT_TRUE(imagesEqualBitForBit(fromArrays.image(), fromChanges.image())) << step;
      ASSERT_TRUE(imagesEqualBitForBit(fromArrays.image(), full.start(detector->reconstruction()))) << step;
      EXPECT_EQ(fromArrays.state(), stateChecksum(detector->reconstruction()));
      EXPECT_EQ(fromArrays.statistics().voxelsChanged, fromChanges.statistics().voxelsChanged);
      EXPECT_EQ(fromArrays.statistics().samples, fromChanges.statistics().samples);
      if (tolerance == 0) {
        EXPECT_TRUE(imagesEqualBitForBit(fromArrays.image(), full.start(field)));
      }
    }
  }
}

TYPED_TEST(Arrays, WithATolerancePartsThatHardlyMoveCostNothing) {
  using T = TypeParam;
  this->settings_.camera = cameraNamed("-y", this->lattice_);
  this->settings_.camera.projection = Camera::Projection::orthographic;
  this->settings_.camera.imageHeight = 40;
  DifferentialRenderer exact(this->lattice_, this->settings_, {}),
      tolerant(this->lattice_, this->settings_, {});
  uint64_t exactSamples = 0, tolerantSamples = 0;
  for (int step = 0; step < 4; ++step) {
    const std::vector<T> array = waveAt<T>(this->kType, step);
    exact.render(array.data());
    tolerant.render(array.data(), this->tolerance_);
    if (step == 0) continue;
    exactSamples += exact.statistics().samples;
    tolerantSamples += tolerant.statistics().samples;
    EXPECT_LT(tolerant.statistics().tilesRecast, exact.statistics().segmentsTotal);
  }
  EXPECT_GT(tolerantSamples, 0u);
  if (this->kType != ElementType::u8) {  // in 8 bits the slow half stands still anyhow
    EXPECT_LT(tolerantSamples * 4, exactSamples * 3);
  }
}

TYPED_TEST(Arrays, AnotherToleranceStartsAnew) {
  using T = TypeParam;
  DifferentialRenderer renderer(this->lattice_, this->settings_, {}),
      full(this->lattice_, this->settings_, withMethod(Method::full));
  double tolerance = this->tolerance_;
  for (int step = 0; step < 4; ++step, tolerance /= 2) {
    const std::vector<T> array = waveAt<T>(this->kType, step);
    const Field field = fieldFromDense(array.data(), kDims, T(0), this->lattice_.domain.lo);
    EXPECT_TRUE(imagesEqualBitForBit(renderer.render(array.data(), tolerance), full.start(field)));
    EXPECT_EQ(renderer.state(), stateChecksum(field));
    EXPECT_EQ(renderer.statistics().voxelsChanged, 0u);
  }
}

TYPED_TEST(Arrays, MixWithFieldsAndChanges) {
  using T = TypeParam;
  const auto arrayAt = [&](int step) { return waveAt<T>(this->kType, step); };
  const auto fieldAt = [&](int step) {
    return fieldFromDense(arrayAt(step).data(), kDims, T(0), this->lattice_.domain.lo);
  };
  DifferentialRenderer renderer(this->lattice_, this->settings_, {}),
      full(this->lattice_, this->settings_, withMethod(Method::full));
  renderer.render(arrayAt(0).data());
  renderer.start(fieldAt(3));
  EXPECT_TRUE(imagesEqualBitForBit(renderer.render(arrayAt(1).data()), full.start(fieldAt(1))));
  renderer.update(
      changesOf(this->kType, {{this->lattice_.domain.lo + Vec3i{20, 13, 20}, fullScale(this->kType)}}));
  EXPECT_TRUE(imagesEqualBitForBit(renderer.render(arrayAt(1).data()), full.start(fieldAt(1))));
  EXPECT_TRUE(imagesEqualBitForBit(renderer.render(arrayAt(2).data()), full.start(fieldAt(2))));
}

TEST(Arrays, ABadToleranceIsRefusedAndChangesNothing) {
  const Lattice lattice = denseLattice(ElementType::f32, kDims);
  DifferentialRenderer renderer(
      lattice, settingsFor({"", lattice, {}}, "x", softTransferFunction(ElementType::f32)), {});
  const std::vector<float> first = waveAt<float>(ElementType::f32, 0),
                           second = waveAt<float>(ElementType::f32, 1);
  renderer.render(first.data());
  const Image before = renderer.image();
  EXPECT_THROW(renderer.render(second.data(), -1), OptionError);
  EXPECT_THROW(renderer.render(second.data(), std::numeric_limits<double>::quiet_NaN()), OptionError);
  EXPECT_TRUE(imagesEqualBitForBit(renderer.image(), before));
  EXPECT_NO_THROW(renderer.render(second.data()));
  EXPECT_GT(renderer.statistics().voxelsChanged, 0u);
}

TEST(Arrays, HoldNonFiniteVoxels) {
  const Lattice lattice = denseLattice(ElementType::f32, kDims);
  const RenderSettings settings =
      settingsFor({"", lattice, {}}, "iso", softTransferFunction(ElementType::f32));
  DifferentialRenderer renderer(lattice, settings, {}), full(lattice, settings, withMethod(Method::full));
  std::vector<float> array = waveAt<float>(ElementType::f32, 0), absent = array;
  renderer.render(array.data(), 0.01);
  for (size_t i = 5000; i < 9000; ++i) {
    array[i] = i % 2 ? std::numeric_limits<float>::quiet_NaN() : std::numeric_limits<float>::infinity();
    absent[i] = 0;
  }
  EXPECT_TRUE(imagesEqualBitForBit(renderer.render(array.data(), 0.01),
                                   full.start(fieldFromDense(absent.data(), kDims))));
  EXPECT_EQ(renderer.statistics().voxelsChanged, 4000u);
  renderer.render(array.data(), 0.01);
  EXPECT_EQ(renderer.statistics().voxelsChanged, 0u);
}

}  // namespace
}  // namespace kairos::test

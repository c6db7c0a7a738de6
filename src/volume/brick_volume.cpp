#include "volume/brick_volume.h"

#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <limits>
#include <mutex>
#include <new>
#include <string>

#include "core/error.h"

namespace kairos {

// Bricks come from chunks that never move, and go back to a free list.
class BrickVolume::Pool {
 public:
  explicit Pool(ElementType type)
      : windowOffset_(roundUp(size_t(kBrickVoxels) * size_t(bytesPerVoxel(type)) + kSlack)),
        brickBytes_(windowOffset_ + kWindows * sizeof(ValueRange)) {}

  // The window ranges stand behind the voxels.
  ValueRange* windows(const void* brick) const {
    return reinterpret_cast<ValueRange*>(const_cast<std::byte*>(static_cast<const std::byte*>(brick)) +
                                         windowOffset_);
  }

  void* allocate() {
    std::lock_guard lock(mutex_);
    if (free_.empty()) {
      void* chunk = std::aligned_alloc(64, kChunkBricks * brickBytes_);
      if (chunk == nullptr) throw std::bad_alloc();
      chunks_.emplace_back(chunk);
      for (size_t i = kChunkBricks; i-- > 0;)
        free_.push_back(static_cast<std::byte*>(chunk) + i * brickBytes_);
    }
    void* brick = free_.back();
    free_.pop_back();
    return brick;
  }
  void release(void* brick) {
    std::lock_guard lock(mutex_);
    free_.push_back(brick);
  }
  uint64_t bytes() const { return chunks_.size() * kChunkBricks * brickBytes_; }
  uint32_t allocated() const { return uint32_t(chunks_.size() * kChunkBricks - free_.size()); }

 private:
  static constexpr size_t kChunkBricks = 64;
  static constexpr size_t kSlack = 64;  // vector loads may run past the last voxel
  static size_t roundUp(size_t n) { return (n + 63) / 64 * 64; }
  struct Free {
    void operator()(void* p) const { std::free(p); }
  };

  size_t windowOffset_, brickBytes_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<void, Free>> chunks_;
  std::vector<void*> free_;
};

// A leaf to be written: 512-bit mask and packed values, or all 512 values where `mask` is null.
struct BrickVolume::LeafView {
  Vec3i origin;
  const uint64_t* mask;
  const void* values;
};

// One leaf's (or its first half's) place in one brick.
struct BrickVolume::Placement {
  uint32_t cell, leaf;
};

namespace {

// How far below the sampling box a footprint's low corner may start: one voxel for the sampling margin, one
// for the gradient stencil, three for the smallest corner of a 4x4 packet.
constexpr int kLowMargin = 5;

constexpr int kBlocks = kBrickStride / kWindowBlock;  // 4^3 blocks along a brick's edge, apron included

ValueRange unite(ValueRange a, ValueRange b) {
  return {std::min(a.lo, b.lo), std::max(a.hi, b.hi)};
}

// Ranges of the five blocks in one row of blocks.
template <class T>
void blockRowRanges(const T* voxels, int by, int bz, ValueRange* ranges) {
  // Elementwise over whole rows, so that the compiler keeps 20 minima and maxima in vector registers.
  const T* first = voxels + (bz * kBrickStride + by) * kWindowBlock * kBrickStride;
  T lo[kBrickStride], hi[kBrickStride];
  std::copy_n(first, kBrickStride, lo);
  std::copy_n(first, kBrickStride, hi);
  for (int z = 0; z < kWindowBlock; ++z)
    for (int y = 0; y < kWindowBlock; ++y) {
      const T* row = first + (z * kBrickStride + y) * kBrickStride;
      for (int x = 0; x < kBrickStride; ++x) {
        lo[x] = row[x] < lo[x] ? row[x] : lo[x];
        hi[x] = row[x] > hi[x] ? row[x] : hi[x];
      }
    }
  for (int b = 0; b < kBlocks; ++b)
    ranges[b] = {float(*std::min_element(lo + b * kWindowBlock, lo + (b + 1) * kWindowBlock)),
                 float(*std::max_element(hi + b * kWindowBlock, hi + (b + 1) * kWindowBlock))};
}

// Fills the ranges of all windows; returns the brick's.
template <class T>
ValueRange summarise(const T* voxels, ValueRange* windows) {
  ValueRange blocks[kBlocks][kBlocks][kBlocks];
  for (int z = 0; z < kBlocks; ++z)
    for (int y = 0; y < kBlocks; ++y) blockRowRanges(voxels, y, z, blocks[z][y]);
  ValueRange all = blocks[0][0][0];
  for (int z = 0; z < kBlocks - 1; ++z)
    for (int y = 0; y < kBlocks - 1; ++y)
      for (int x = 0; x < kBlocks - 1; ++x) {
        ValueRange window = blocks[z][y][x];
        for (int n = 1; n < 8; ++n)
          window = unite(window, blocks[z + (n >> 2)][y + (n >> 1 & 1)][x + (n & 1)]);
        windows[x + 4 * y + 16 * z] = window;
        all = unite(all, window);
      }
  return all;
}

// Which of the four 5-voxel blocks along x a 20-bit row mask touches.
constexpr uint64_t blocksOfRow(uint32_t row) {
  return uint64_t((row & 0x1f) != 0) | uint64_t((row & 0x3e0) != 0) << 1 |
         uint64_t((row & 0x7c00) != 0) << 2 | uint64_t((row & 0xf8000) != 0) << 3;
}

template <class T>
T stored(T value, T background) {
  // A comparison rather than isfinite, so that rows are converted by vector instructions.
  if constexpr (std::is_floating_point_v<T>)
    return std::abs(value) <= std::numeric_limits<T>::max() ? value : background;
  return value;
}

// Copies a whole or half row of a leaf.
template <class T>
void storeRow(const T* values, int count, T background, T* out) {
  if (count == kLeafEdge) {
    for (int x = 0; x < kLeafEdge; ++x) out[x] = stored(values[x], background);
  } else {
    for (int x = 0; x < kBrickApron; ++x) out[x] = stored(values[x], background);
  }
}

// Sub-blocks that a box of a brick's voxels touches.
uint64_t subBlocksOfBox(const Vec3i& lo, const Vec3i& size) {
  const auto axis = [](int first, int count, int bit) {
    uint64_t bits = 0;
    for (int b = first / kSubBlockEdge; b <= (first + count - 1) / kSubBlockEdge; ++b)
      bits |= uint64_t(1) << (b * bit);
    return bits;
  };
  // Products of sums of distinct powers never carry.
  return axis(lo.x, size.x, 1) * axis(lo.y, size.y, 4) * axis(lo.z, size.z, 16);
}

template <class T>
void storeWholeLeaf(const T* values, const Vec3i& at, const Vec3i& size, T background, T* brick) {
  for (int z = 0; z < size.z; ++z)
    for (int y = 0; y < size.y; ++y)
      storeRow(values + leafOffset(0, y, z), size.x, background,
               brick + ((at.z + z) * kBrickStride + at.y + y) * kBrickStride + at.x);
}

// Writes the changed voxels of a leaf; returns the sub-blocks they fall in.
template <class T>
uint64_t storeChangedVoxels(const uint64_t* mask, const T* values, const Vec3i& at, const Vec3i& size,
                            T background, T* brick) {
  uint64_t subBlocks = 0;
  const uint32_t columns = (1u << size.x) - 1;
  for (int z = 0; z < size.z; ++z) {
    const T* next = values;
    values += std::popcount(mask[z]);
    for (int y = 0; y < size.y; ++y) {
      const auto row = uint32_t(mask[z] >> (8 * y)) & 0xff;
      if (row == 0) continue;
      T* out = brick + ((at.z + z) * kBrickStride + at.y + y) * kBrickStride + at.x;
      if (row == 0xff) {
        storeRow(next, size.x, background, out);
      } else {
        const T* value = next;
        for (uint32_t bits = row; bits != 0; bits &= bits - 1, ++value)
          if (const int x = std::countr_zero(bits); x < size.x) out[x] = stored(*value, background);
      }
      next += std::popcount(row);
      subBlocks |= blocksOfRow((row & columns) << at.x)
                   << (4 * ((at.y + y) / kSubBlockEdge) + 16 * ((at.z + z) / kSubBlockEdge));
    }
  }
  return subBlocks;
}

// Copies plane `from` of an axis to plane `to`, both counted in the brick's voxels.
template <class T>
void copyPlane(int axis, int from, int to, T* brick) {
  const int strides[3] = {1, kBrickStride, kBrickStride * kBrickStride};
  const int u = strides[(axis + 1) % 3], v = strides[(axis + 2) % 3], shift = (to - from) * strides[axis];
  for (int j = 0; j < kBrickStride; ++j)
    for (int i = 0; i < kBrickStride; ++i) {
      T* source = brick + from * strides[axis] + i * u + j * v;
      source[shift] = *source;
    }
}

// Repeats the outermost voxels of dense data in the layer outside; what changed there has changed here.
template <class T>
void repeatFaces(const VoxelBox& domain, const Vec3i& origin, T* brick, uint64_t& subBlocks) {
  const auto repeat = [&](int axis, int from, int to) {
    if (std::min(from, to) < 0 || std::max(from, to) >= kBrickStride) return;
    copyPlane(axis, from, to, brick);
    if (from / kSubBlockEdge == to / kSubBlockEdge) return;
    constexpr uint64_t kFirstBlocks[3] = {0x1111111111111111, 0x000f000f000f000f, 0x000000000000ffff};
    const int unit = 1 << (2 * axis);
    const uint64_t changed = subBlocks >> (from / kSubBlockEdge * unit) & kFirstBlocks[axis];
    subBlocks |= changed << (to / kSubBlockEdge * unit);
  };
  for (int axis = 0; axis < 3; ++axis) {
    const int first = domain.lo[axis] - origin[axis], last = domain.hi[axis] - 1 - origin[axis];
    repeat(axis, first, first - 1);
    repeat(axis, last, last + 1);
  }
}

// Whether all 512 voxels of a leaf changed.
bool wholeLeaf(const uint64_t* mask) {
  return mask == nullptr || std::all_of(mask, mask + 8, [](uint64_t word) { return word == ~uint64_t(0); });
}

}  // namespace

namespace {

std::string positionText(const Vec3i& v) {
  std::string text = "(";
  text += std::to_string(v.x) + ", " + std::to_string(v.y) + ", " + std::to_string(v.z) + ")";
  return text;
}

void checkFits(const Lattice& lattice, const Field& field) {
  if (field.type() != lattice.type)
    throw StateError("the field holds " + std::string(name(field.type())) + " values, its lattice says " +
                     std::string(name(lattice.type)));
  if (field.background != lattice.background &&
      !(std::isnan(field.background) && std::isnan(lattice.background)))
    throw StateError("the field's background is " + std::to_string(field.background) + ", its lattice says " +
                     std::to_string(lattice.background));
  for (const Vec3i& origin : field.leafOrigins) {
    if (lattice.domain.contains(VoxelBox{origin, origin + Vec3i{kLeafEdge, kLeafEdge, kLeafEdge}})) continue;
    for (int i = 0; i < kLeafVoxels; ++i) {
      const Vec3i v = origin + Vec3i{i & 7, (i >> 3) & 7, i >> 6};
      if (lattice.domain.contains(v)) continue;
      const double value = field.value(v);
      if (value != field.background && std::isfinite(value))
        throw StateError("the field's voxel " + positionText(v) + " lies outside its lattice's domain");
    }
  }
}

}  // namespace

BrickVolume::BrickVolume(const Lattice& lattice, const Field& field, ThreadPool& pool)
    : lattice_(lattice),
      background_(std::isfinite(lattice.background) ? lattice.background : 0.0),
      pool_(std::make_unique<Pool>(lattice.type)) {
  checkFits(lattice, field);
  const VoxelBox domain = lattice.domain.empty() ? VoxelBox{{0, 0, 0}, {1, 1, 1}} : lattice.domain;
  int64_t cells = 1;
  constexpr int64_t kMaxCells = int64_t(1) << 31;
  for (int a = 0; a < 3; ++a) {
    // In 64 bits, since any box of 32-bit voxel indices may come along.
    const int64_t low = int64_t(domain.lo[a]) - kLowMargin,
                  origin = low - ((low % kLeafEdge) + kLeafEdge) % kLeafEdge;
    // Sparse data are sampled one voxel beyond the domain, dense ones up to their last voxel.
    const int64_t end = domain.hi[a] + int64_t(lattice.dense ? 0 : 1);
    const int64_t size = (end - origin + kBrickEdge - 1) / kBrickEdge;
    cells = std::min(cells * size, kMaxCells + 1);
    gridOrigin_[a] = int32_t(origin);
    gridSize_[a] = int32_t(size);
  }
  if (cells > kMaxCells)
    throw StateError("the domain from " + positionText(domain.lo) + " to " + positionText(domain.hi) +
                     " needs more than 2^31 bricks of 16^3 voxels");
  dispatch(lattice.type, [&]<class T>() {
    T* brick = static_cast<T*>(pool_->allocate());
    std::fill_n(brick, kBrickVoxels, T(background_));
    summarise(brick, pool_->windows(brick));
    backgroundBrick_ = brick;
  });
  bricks_.assign(size_t(cells), backgroundBrick_);
  ranges_.assign(size_t(cells), {float(background_), float(background_)});

  leafViews_.clear();
  std::visit(
      [&](const auto& values) {
        for (size_t i = 0; i < field.leafCount(); ++i)
          leafViews_.push_back({field.leafOrigins[i], nullptr, values.data() + i * kLeafVoxels});
      },
      field.values);
  scatter(leafViews_, pool);
}

BrickVolume::~BrickVolume() = default;
BrickVolume::BrickVolume(BrickVolume&&) noexcept = default;

std::span<const ValueRange, kWindows> BrickVolume::windowRanges(uint32_t cell) const {
  return std::span<const ValueRange, kWindows>(pool_->windows(bricks_[cell]), kWindows);
}

uint64_t BrickVolume::memoryBytes() const {
  return pool_->bytes() + bricks_.size() * (sizeof(void*) + sizeof(ValueRange));
}

uint32_t BrickVolume::allocatedBricks() const {
  return pool_->allocated();
}

namespace {

// A simulation may have filled these in itself; anything else than whole leaves would write outside the
// bricks.
void checkWellFormed(const ChangedLeaf& leaf, uint64_t valueCount) {
  if (leaf.origin != leafOriginOf(leaf.origin))
    throw StateError("changed leaf " + positionText(leaf.origin) + " does not start at multiples of 8");
  const auto count = uint64_t(leaf.count());
  if (leaf.first > valueCount || count > valueCount - leaf.first)
    throw StateError("changed leaf " + positionText(leaf.origin) + " takes " + std::to_string(count) +
                     " values from number " + std::to_string(leaf.first) + " on, but there are " +
                     std::to_string(valueCount));
}

void checkInsideDomain(const ChangedLeaf& leaf, const VoxelBox& domain) {
  const VoxelBox box{leaf.origin, leaf.origin + Vec3i{kLeafEdge, kLeafEdge, kLeafEdge}};
  if (domain.contains(box)) return;
  for (int z = 0; z < 8; ++z)
    for (uint64_t word = leaf.mask[size_t(z)]; word != 0; word &= word - 1) {
      const int bit = std::countr_zero(word);
      const Vec3i v = leaf.origin + Vec3i{bit & 7, bit >> 3, z};
      if (!domain.contains(v))
        throw StateError("changed voxel " + positionText(v) + " lies outside the volume's domain");
    }
}

}  // namespace

const DirtyBricks& BrickVolume::apply(const ChangedVoxels& changes, ThreadPool& pool) {
  if (changes.type() != lattice_.type)
    throw StateError("changed voxels hold " + std::string(name(changes.type())) +
                     " values, the volume holds " + std::string(name(lattice_.type)));
  for (const ChangedLeaf& leaf : changes.leaves) {
    checkWellFormed(leaf, changes.count());
    checkInsideDomain(leaf, lattice_.domain);
  }
  leafViews_.clear();
  std::visit(
      [&](const auto& values) {
        for (const ChangedLeaf& leaf : changes.leaves)
          leafViews_.push_back({leaf.origin, leaf.mask.data(), values.data() + leaf.first});
      },
      changes.values);
  scatter(leafViews_, pool);
  return dirty_;
}

// Sorts the leaves per brick, so that each brick is touched once, by one thread.
void BrickVolume::scatter(std::span<const LeafView> leaves, ThreadPool& pool) {
  placements_.clear();
  for (uint32_t i = 0; i < leaves.size(); ++i) {
    const Vec3i local = leaves[i].origin - gridOrigin_;
    Vec3i own, first;  // the owning cell, and the first cell whose apron reaches into the leaf
    bool inside = true;
    for (int a = 0; a < 3; ++a) {
      own[a] = floorToMultiple(local[a], kBrickEdge) / kBrickEdge;
      first[a] = std::max(own[a] - (local[a] == own[a] * kBrickEdge ? 1 : 0), 0);
      inside = inside && local[a] >= 0 && own[a] < gridSize_[a];
    }
    if (!inside) continue;  // padding of a leaf that straddles the domain's edge
    for (int z = first.z; z <= own.z; ++z)
      for (int y = first.y; y <= own.y; ++y)
        for (int x = first.x; x <= own.x; ++x) placements_.push_back({cellIndex({x, y, z}), i});
  }
  std::sort(placements_.begin(), placements_.end(), [](const Placement& a, const Placement& b) {
    return a.cell != b.cell ? a.cell < b.cell : a.leaf < b.leaf;
  });
  groups_.clear();
  dirty_.cells.clear();
  for (uint32_t i = 0; i < placements_.size(); ++i)
    if (i == 0 || placements_[i].cell != placements_[i - 1].cell) {
      groups_.push_back(i);
      dirty_.cells.push_back(placements_[i].cell);
    }
  groups_.push_back(uint32_t(placements_.size()));
  dirty_.subBlocks.assign(dirty_.cells.size(), 0);

  dispatch(lattice_.type, [&]<class T>() {
    pool.forEach(dirty_.cells.size(), 4, [&](size_t begin, size_t end) {
      for (size_t g = begin; g < end; ++g)
        updateBrick<T>(dirty_.cells[g],
                       std::span(placements_).subspan(groups_[g], groups_[g + 1] - groups_[g]), leaves,
                       dirty_.subBlocks[g]);
    });
  });
}

template <class T>
void BrickVolume::updateBrick(uint32_t cell, std::span<const Placement> placements,
                              std::span<const LeafView> leaves, uint64_t& subBlocks) {
  const T background = T(background_);
  T* brick = const_cast<T*>(static_cast<const T*>(bricks_[cell]));
  if (brick == backgroundBrick_) {
    brick = static_cast<T*>(pool_->allocate());
    std::fill_n(brick, kBrickVoxels, background);
  }
  const Vec3i origin = cellOrigin(cell);
  for (const Placement& placement : placements) {
    const LeafView& leaf = leaves[placement.leaf];
    const Vec3i at =
        leaf.origin - origin;  // 0, 8 or 16 on each axis; from 16 on only the apron's half is ours
    const Vec3i extent{std::min(8, kBrickStride - at.x), std::min(8, kBrickStride - at.y),
                       std::min(8, kBrickStride - at.z)};
    const T* values = static_cast<const T*>(leaf.values);
    if (wholeLeaf(leaf.mask)) {
      storeWholeLeaf(values, at, extent, background, brick);
      subBlocks |= subBlocksOfBox(at, extent);
    } else {
      subBlocks |= storeChangedVoxels(leaf.mask, values, at, extent, background, brick);
    }
  }
  if (lattice_.dense) repeatFaces(lattice_.domain, origin, brick, subBlocks);
  ranges_[cell] = summarise(brick, pool_->windows(brick));
  if (ranges_[cell] == ValueRange{float(background), float(background)}) {
    pool_->release(brick);
    bricks_[cell] = backgroundBrick_;
  } else {
    bricks_[cell] = brick;
  }
}

}  // namespace kairos

#include "volume/brick_volume.h"

#include <sys/mman.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <mutex>
#include <new>
#include <string>

#include "core/error.h"
#include "volume/brick_update.h"

namespace kairos {

// Bricks come from chunks that never move, and go back to a free list.
class BrickVolume::Pool {
 public:
  explicit Pool(ElementType type)
      : rangesOffset_(roundUp(size_t(kBrickVoxels) * size_t(bytesPerVoxel(type)) + kSlack)),
        brickBytes_(rangesOffset_ +
                    dispatch(type, []<class T>() { return roundUp(sizeof(BlockRanges<T>)); })) {}

  // The ranges of its blocks stand behind a brick's voxels.
  template <class T>
  BlockRanges<T>& blockRanges(const void* brick) const {
    return *reinterpret_cast<BlockRanges<T>*>(const_cast<std::byte*>(static_cast<const std::byte*>(brick)) +
                                              rangesOffset_);
  }

  template <class T>
  T* allocateFilled(T background) {
    const Place place = allocate();
    T* brick = static_cast<T*>(place.brick);
    // A new brick holds zeros already. Leaving them alone, its pages come only where values are written.
    if (place.zeroed && bitsOf(background) == 0) return brick;
    std::fill_n(brick, kBrickVoxels, background);
    blockRanges<T>(brick).fill(background);
    return brick;
  }
  void release(void* brick) {
    std::lock_guard lock(mutex_);
    released_.push_back(brick);
  }
  uint64_t bytes() const { return used_ * brickBytes_; }
  uint32_t allocated() const { return uint32_t(used_ - released_.size()); }

 private:
  static constexpr size_t kChunkBricks = 64;
  static constexpr size_t kSlack = 64;  // vector loads may run past the last voxel
  static size_t roundUp(size_t n) { return (n + 63) / 64 * 64; }

  struct Place {
    void* brick;
    bool zeroed;
  };
  struct Unmap {
    size_t bytes;
    void operator()(std::byte* p) const { ::munmap(p, bytes); }
  };

  Place allocate() {
    std::lock_guard lock(mutex_);
    if (!released_.empty()) {
      void* brick = released_.back();
      released_.pop_back();
      return {brick, false};
    }
    if (used_ == chunks_.size() * kChunkBricks) addChunk();
    return {chunks_.back().get() + used_++ % kChunkBricks * brickBytes_, true};
  }

  void addChunk() {
    const size_t bytes = kChunkBricks * brickBytes_;
    void* chunk = ::mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_PRIVATE | MAP_ANONYMOUS, -1, 0);
    if (chunk == MAP_FAILED) throw std::bad_alloc();
    chunks_.emplace_back(static_cast<std::byte*>(chunk), Unmap{bytes});
    released_.reserve(chunks_.size() * kChunkBricks);  // so that giving back never allocates
  }

  size_t rangesOffset_, brickBytes_;
  std::mutex mutex_;
  std::vector<std::unique_ptr<std::byte, Unmap>> chunks_;
  size_t used_ = 0;  // bricks ever handed out
  std::vector<void*> released_;
};

namespace {

// How far below the sampling box a footprint's low corner may start: one voxel for the sampling margin, one
// for the gradient stencil, three for the smallest corner of a 4x4 packet.
constexpr int kLowMargin = 5;

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
  dispatch(lattice.type, [&]<class T>() { backgroundBrick_ = pool_->allocateFilled(T(background_)); });
  bricks_.assign(size_t(cells), backgroundBrick_);
  ranges_.assign(size_t(cells), {float(background_), float(background_)});
  leafCount_.assign(size_t(cells), 0);

  std::array<uint64_t, 8> wholeLeaf;
  wholeLeaf.fill(~uint64_t(0));
  const void* valuesEnd = std::visit(
      [&](const auto& values) -> const void* {
        for (size_t i = 0; i < field.leafCount(); ++i)
          leafViews_.push_back({field.leafOrigins[i], wholeLeaf.data(), values.data() + i * kLeafVoxels});
        return values.data() + values.size();
      },
      field.values);
  scatter(valuesEnd, pool);
}

BrickVolume::~BrickVolume() = default;
BrickVolume::BrickVolume(BrickVolume&&) noexcept = default;

std::array<ValueRange, kWindows> BrickVolume::windowRanges(uint32_t cell) const {
  return dispatch(lattice_.type, [&]<class T>() { return windowsOf(pool_->blockRanges<T>(bricks_[cell])); });
}

uint64_t BrickVolume::memoryBytes() const {
  return pool_->bytes() + bricks_.size() * (sizeof(void*) + sizeof(ValueRange) + sizeof(uint32_t));
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
  const void* valuesEnd = std::visit(
      [&](const auto& values) -> const void* {
        for (const ChangedLeaf& leaf : changes.leaves)
          leafViews_.push_back({leaf.origin, leaf.mask.data(), values.data() + leaf.first});
        return values.data() + values.size();
      },
      changes.values);
  scatter(valuesEnd, pool);
  return dirty_;
}

namespace {

// The cells that hold a part of a leaf at `local` of the grid: its own, and those whose apron begins with it.
template <class Visit>
void forEachCellOf(const Vec3i& local, const Vec3i& gridSize, Visit&& visit) {
  Vec3i own, first;
  for (int a = 0; a < 3; ++a) {
    own[a] = floorToMultiple(local[a], kBrickEdge) / kBrickEdge;
    first[a] = std::max(own[a] - (local[a] == own[a] * kBrickEdge ? 1 : 0), 0);
    if (local[a] < 0 || own[a] >= gridSize[a]) return;  // padding of a leaf that straddles the domain's edge
  }
  for (int z = first.z; z <= own.z; ++z)
    for (int y = first.y; y <= own.y; ++y)
      for (int x = first.x; x <= own.x; ++x) visit(cellIndex({x, y, z}, gridSize));
}

}  // namespace

// Sorts the leaves per brick by counting, so that each brick is touched once, by one thread.
void BrickVolume::sortByCell() {
  dirty_.cells.clear();
  for (const LeafView& leaf : leafViews_)
    forEachCellOf(leaf.origin - gridOrigin_, gridSize_, [&](uint32_t cell) {
      if (leafCount_[cell]++ == 0) dirty_.cells.push_back(cell);
    });
  std::sort(dirty_.cells.begin(), dirty_.cells.end());
  groupBegin_.assign(1, 0);
  for (const uint32_t cell : dirty_.cells) {
    groupBegin_.push_back(groupBegin_.back() + leafCount_[cell]);
    leafCount_[cell] = groupBegin_[groupBegin_.size() - 2];  // from here on: where its next leaf goes
  }
  leavesOfCells_.resize(groupBegin_.back());
  for (uint32_t i = 0; i < leafViews_.size(); ++i)
    forEachCellOf(leafViews_[i].origin - gridOrigin_, gridSize_,
                  [&](uint32_t cell) { leavesOfCells_[leafCount_[cell]++] = i; });
  for (const uint32_t cell : dirty_.cells) leafCount_[cell] = 0;
}

void BrickVolume::scatter(const void* valuesEnd, ThreadPool& pool) {
  sortByCell();
  dirty_.subBlocks.resize(dirty_.cells.size());
  dirty_.windows.resize(dirty_.cells.size());
  dispatch(lattice_.type, [&]<class T>() {
    pool.forEach(dirty_.cells.size(), 4, [&](size_t begin, size_t end) {
      for (size_t group = begin; group < end; ++group) updateBrick<T>(group, valuesEnd);
    });
  });
}

template <class T>
void BrickVolume::updateBrick(size_t group, const void* valuesEnd) {
  const uint32_t cell = dirty_.cells[group];
  const T background = T(background_);
  T* brick = const_cast<T*>(static_cast<const T*>(bricks_[cell]));
  if (brick == backgroundBrick_) brick = pool_->allocateFilled(background);
  const auto placements = std::span<const uint32_t>(leavesOfCells_)
                              .subspan(groupBegin_[group], groupBegin_[group + 1] - groupBegin_[group]);
  const BrickChange change = kairos::updateBrick(BrickUpdate<T>{
      brick, pool_->blockRanges<T>(brick), cellOrigin(cell), background, placements, leafViews_,
      static_cast<const T*>(valuesEnd), lattice_.dense ? &lattice_.domain : nullptr});
  dirty_.subBlocks[group] = change.subBlocks;
  dirty_.windows[group] = change.windows;
  ranges_[cell] = change.range;
  if (change.range == ValueRange{float(background), float(background)}) {
    pool_->release(brick);
    bricks_[cell] = backgroundBrick_;
  } else {
    bricks_[cell] = brick;
  }
}

}  // namespace kairos

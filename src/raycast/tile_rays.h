// The rays of one tile, and which bricks own their samples.
#pragma once

#include <algorithm>
#include <cstdint>

#include "core/camera.h"
#include "raycast/render_settings.h"
#include "volume/brick_volume.h"

namespace kairos {

/// A tile is a packet of 4x4 rays; lane l is pixel (4 tx + l % 4, 4 ty + l / 4).
inline constexpr int kTileEdge = 4;
inline constexpr int kLanes = 16;

/// A ray in grid space (voxels, relative to BrickVolume::gridOrigin), on the lattice of samples: sample k
/// stands at origin + (k + 0.5) * delta, k an integer counted from the ray's world origin.
struct LatticeRay {
  Vec3d origin, delta;
};

/// The first sample index at which a ray has passed the plane `x = plane` of one axis. Both bricks that share
/// the plane ask this one function, so a sample belongs to exactly one brick whatever the rounding. A ray
/// parallel to the plane counts as moving infinitely slowly in the positive direction. Clamped to +-2^30.
/// `delta` is 0 or no denormal number.
int32_t firstSampleBeyond(double plane, double origin, double delta);

/// Which samples a tile's lanes take and how bricks own them: what never changes about the tile.
struct TileSampling {
  /// Samples inside the volume and the clip box; empty for lanes off the image.
  int32_t kBegin[kLanes], kEnd[kLanes];
  /// Of slabs: samples kBegin and kEnd - 1 stand for the lattice's intervals around them, from k to k + 1.
  /// How much of the first one comes before the lane enters volume and clip box, and of the last after it
  /// leaves.
  float enter[kLanes], leave[kLanes];

  /// Sample ownership. A brick owns sample k of lane l when it contains the low corner of the sample's
  /// footprint. Where all 16 footprints together fit one brick with its apron along the whole tile
  /// (`packetOwned`), the low corner is that of their union, so that the packet never needs a second brick;
  /// it moves along `owner`, a ray of its own. Otherwise each lane has its own. Grid space, footprint shift
  /// included.
  bool packetOwned;
  LatticeRay owner;
  /// How far apart the lanes lie along each axis at sample k, in voxels: spread + (k + 0.5) * spreadDelta.
  Vec3d spread, spreadDelta;

  int32_t firstSample() const;
  int32_t lastSample() const;  // one past
};

/// The 16 rays of a tile, in grid space, lane by lane.
struct alignas(64) TileRays : TileSampling {
  double origin[3][kLanes], delta[3][kLanes];
  float direction[3][kLanes];  // unit vectors in world space; only where the view is shaded
};

/// Where a view's rays stand on the image: ray (i, j) at image position (x + i * stride, y + j * stride), in
/// pixels. By default one through each pixel's centre.
struct RayLattice {
  double stride = 1;
  double x = 0.5, y = 0.5;
  int columns = 0, rows = 0;  // 0: the image's width and height
};

/// All tiles' rays of one view of one lattice; immutable, safe to share between threads. Tiles group
/// neighbouring rays of `rays`, so that pixels, where they are spoken of, are its rays.
class ViewRays {
 public:
  /// Throws OptionError when the sample indices would not fit 30 bits (a camera absurdly far away for the
  /// step).
  ViewRays(const RenderSettings& settings, const Lattice& lattice, const Vec3i& gridOrigin,
           const RayLattice& rays = {});

  int width() const { return width_; }
  int height() const { return height_; }
  int tilesX() const { return tilesX_; }
  int tilesY() const { return tilesY_; }
  int tileCount() const { return tilesX_ * tilesY_; }
  /// How many of a tile's lanes carry a ray.
  int raysOf(int tile) const {
    return std::min(kTileEdge, width_ - tile % tilesX_ * kTileEdge) *
           std::min(kTileEdge, height_ - tile / tilesX_ * kTileEdge);
  }
  double worldStep() const { return worldStep_; }
  bool perspective() const { return perspective_; }
  /// Grid-space position of the eye.
  Vec3d eye() const { return eye_; }
  double footprintShift() const { return shift_; }
  /// So many samples may be looked at as one: 1, of slabs' finer lattice as many as span half a voxel.
  int sampleStride() const { return sampleStride_; }
  int footprintWidth() const { return footprintWidth_; }

  /// Everything about a tile's rays. `geometry` alone leaves out the TileSampling, which the
  /// caller may have kept.
  TileRays rays(int tile) const;
  void geometry(int tile, TileRays& rays) const;

 private:
  void findSampleRanges(int tile, TileRays& rays) const;
  void takeSamples(double enter, double leave, int lane, TileRays& rays) const;
  void decideOwnership(TileRays& rays) const;

  double imageX(int column) const { return rays_.x + column * rays_.stride; }
  double imageY(int row) const { return rays_.y + row * rays_.stride; }

  RayGenerator generator_;
  RayLattice rays_;
  int width_, height_, tilesX_, tilesY_;
  double worldStep_;
  bool perspective_;
  double shift_;
  int footprintWidth_;
  double footprintExtent_;
  int sampleStride_;
  bool slabs_, shaded_;
  Vec3d eye_;
  Vec3d right_, down_, forward_;  // image axes in grid space, one world unit long
  PointBox samplingBox_;          // grid space
  bool clipped_;
  PointBox clipBox_;  // world space
};

}  // namespace kairos

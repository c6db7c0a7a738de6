// The shader program that draws a subvolume's slices, and its inputs.
#pragma once

#include <vector>

#include "lod/gl_objects.h"
#include "lod/lod_settings.h"
#include "lod/slice_geometry.h"

namespace kairos {

class SliceProgram {
 public:
  SliceProgram(const LodSettings& settings, const Lattice& lattice, bool parallel, float valueScale);

  /// Prepares for the slices of a frame.
  void begin(const SliceView& view) const;
  /// Draws slices of one subvolume, whose texture is bound to unit 0, at one level of detail. All in one
  /// call.
  void draw(const SliceView& view, const Subvolume& subvolume, const PointBox& sampled, int lod,
            const SlicePolygons& polygons);

 private:
  struct Table {
    GlObject texture;
    float lo, scale, last;
  };

  int location(const char* uniform) const;
  const Table& table(int lod);

  LodSettings settings_;
  Lattice lattice_;
  float valueScale_;
  GlObject program_, vertices_, array_;
  int right_, down_, forward_, image_, boxLo_, boxHi_, spacing_, texelOrigin_, texelScale_, texelBias_,
      classification_;
  std::vector<Table> tables_;  // per level of detail; built at first use
};

}  // namespace kairos

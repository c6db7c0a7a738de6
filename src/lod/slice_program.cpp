#include "lod/slice_program.h"

#include <epoxy/gl.h>

#include <cmath>
#include <cstddef>
#include <limits>
#include <string>

#include "lod/shader_sources.h"

namespace kairos {
namespace {

std::string fragmentSource(const LodSettings& settings, bool parallel) {
  std::string source = "#version 330 core\n";
  if (settings.mode == LodMode::mip) source += "#define MIP\n";
  if (parallel) source += "#define PARALLEL\n";
  if (!parallel && settings.shape == SliceShape::shells) source += "#define SHELLS\n";
  if (!parallel && settings.shape == SliceShape::planes) source += "#define CORRECT\n";
  return source + kSliceFragmentShader;
}

void setVector(int location, const Vec3d& v) {
  glUniform3f(location, float(v.x), float(v.y), float(v.z));
}

}  // namespace

SliceProgram::SliceProgram(const LodSettings& settings, const Lattice& lattice, bool parallel,
                           float valueScale)
    : settings_(settings),
      lattice_(lattice),
      valueScale_(valueScale),
      program_(makeProgram(kSliceVertexShader, fragmentSource(settings, parallel))),
      vertices_(makeBuffer()),
      array_(makeVertexArray()),
      right_(location("right")),
      down_(location("down")),
      forward_(location("forward")),
      image_(location("image")),
      boxLo_(location("boxLo")),
      boxHi_(location("boxHi")),
      spacing_(location("spacing")),
      texelOrigin_(location("texelOrigin")),
      texelScale_(location("texelScale")),
      texelBias_(location("texelBias")),
      classification_(location("classification")) {
  glBindVertexArray(array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.id());
  glEnableVertexAttribArray(0);
  glEnableVertexAttribArray(1);
  glVertexAttribPointer(0, 2, GL_FLOAT, GL_FALSE, sizeof(SliceVertex), nullptr);
  glVertexAttribPointer(1, 4, GL_FLOAT, GL_FALSE, sizeof(SliceVertex),
                        reinterpret_cast<const void*>(offsetof(SliceVertex, base)));
  glUseProgram(program_.id());
  glUniform1i(location("volume"), 0);
  if (const int table = location("table"); table >= 0) glUniform1i(table, 1);
  checkGl("preparing the shaders");
}

int SliceProgram::location(const char* uniform) const {
  return glGetUniformLocation(program_.id(), uniform);
}

void SliceProgram::begin(const SliceView& view) const {
  glUseProgram(program_.id());
  glBindVertexArray(array_.id());
  glBindBuffer(GL_ARRAY_BUFFER, vertices_.id());
  glDisable(GL_DEPTH_TEST);
  glEnable(GL_BLEND);
  if (settings_.mode == LodMode::mip) {
    glBlendEquation(GL_MAX);
  } else {
    glBlendEquation(GL_FUNC_ADD);
    if (settings_.order == BlendOrder::frontToBack)
      glBlendFunc(GL_ONE_MINUS_DST_ALPHA, GL_ONE);
    else
      glBlendFunc(GL_ONE, GL_ONE_MINUS_SRC_ALPHA);
  }
  setVector(right_, view.right());
  setVector(down_, view.down());
  setVector(forward_, view.forward());
  glUniform3f(image_, float(view.pixel()), 0.5f * float(settings_.width), 0.5f * float(settings_.height));
}

const SliceProgram::Table& SliceProgram::table(int lod) {
  while (int(tables_.size()) <= lod) {
    const ClassificationTable t = settings_.classification(lattice_, int(tables_.size()));
    glActiveTexture(GL_TEXTURE1);
    tables_.push_back({makeTableTexture(t), t.range().lo, t.scale(), float(t.nodeCount() - 1)});
    glActiveTexture(GL_TEXTURE0);
  }
  return tables_[size_t(lod)];
}

void SliceProgram::draw(const SliceView& view, const Subvolume& subvolume, const PointBox& sampled, int lod,
                        const SlicePolygons& polygons) {
  if (polygons.slices() == 0) return;
  const Table& t = table(lod);
  glActiveTexture(GL_TEXTURE1);
  glBindTexture(GL_TEXTURE_2D, t.texture.id());
  glActiveTexture(GL_TEXTURE0);
  glUniform4f(classification_, valueScale_, t.lo, t.scale, t.last);

  const int level = settings_.levelOf(lod);
  const Vec3i texels = subvolume.vertices(level);
  Vec3d lo, hi, scale, bias;
  for (int a = 0; a < 3; ++a) {
    lo[a] = std::max(double(subvolume.cells.lo[a]), sampled.lo[a]) - view.anchor()[a];
    hi[a] = std::min(double(subvolume.cells.hi[a]), sampled.hi[a]) - view.anchor()[a];
    // The volume's own end is part of it; the shader's comparison leaves ends out.
    if (subvolume.cells.hi[a] >= sampled.hi[a])
      hi[a] = double(std::nextafter(float(hi[a]), std::numeric_limits<float>::infinity()));
    scale[a] = 1.0 / (double(1 << level) * texels[a]);
    bias[a] = 0.5 / texels[a];
  }
  setVector(boxLo_, lo);
  setVector(boxHi_, hi);
  glUniform1f(spacing_, lod > 0 ? float(settings_.worldStep(lattice_) * settings_.spacing(lod)) : 0.0f);
  setVector(texelOrigin_, Vec3d(subvolume.cells.lo) - view.anchor());
  setVector(texelScale_, scale);
  setVector(texelBias_, bias);
  glBufferData(GL_ARRAY_BUFFER, GLsizeiptr(polygons.vertices.size() * sizeof(SliceVertex)),
               polygons.vertices.data(), GL_STREAM_DRAW);
  glMultiDrawArrays(GL_TRIANGLE_FAN, polygons.first.data(), polygons.count.data(), polygons.slices());
  checkGl("drawing slices");
}

}  // namespace kairos

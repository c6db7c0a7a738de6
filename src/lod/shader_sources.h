// The shaders in src/lod/shaders, which the build puts into the library.
#pragma once

namespace kairos {

extern const char* const kSliceVertexShader;
/// Without its #version, so that definitions can come first.
extern const char* const kSliceFragmentShader;

}  // namespace kairos

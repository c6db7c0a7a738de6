#version 330 core
layout(location = 0) in vec2 position;  // clip space; window row 0 is the image's top row
layout(location = 1) in vec4 slice;     // xyz: the slice's point straight ahead; w: factor of image offsets
flat out vec4 sliceOfFragment;

void main() {
  sliceOfFragment = slice;
  gl_Position = vec4(position, 0.0, 1.0);
}

// One sample. #version and any of SHELLS, CORRECT and MIP are put in front of this.
//
// The sample's place follows from the pixel and the slice alone, by the same arithmetic in every subvolume, and
// a subvolume takes it only where it lies in its own half-open box: each sample is taken exactly once.
flat in vec4 sliceOfFragment;
out vec4 colour;

uniform sampler3D volume;
uniform sampler2D table;           // premultiplied, corrected for the distance between slices; one node a texel
uniform vec3 right, down, forward; // image axes in index space, one world unit long
uniform vec3 image;                // edge of a pixel; x and y of the image's centre
uniform vec3 boxLo, boxHi;
uniform vec3 texelOrigin;          // place of the texture's first vertex
uniform vec3 texelScale, texelBias;
uniform vec4 classification;       // value of a texel 1; table coordinate = (value - y) * z, at most w

void main() {
  vec2 q = (gl_FragCoord.xy - image.yz) * image.x;
  float squared = dot(q, q);
#ifdef SHELLS
  // On a sphere: the unit direction less `forward`, without cancellation.
  float s = sqrt(1.0 + squared);
  vec3 offset = forward * (-squared / (s * (1.0 + s))) + (right * q.x + down * q.y) / s;
#else
  vec3 offset = right * q.x + down * q.y;
#endif
  vec3 p = sliceOfFragment.xyz + sliceOfFragment.w * offset;
  if (any(lessThan(p, boxLo)) || any(greaterThanEqual(p, boxHi))) discard;
  float value = texture(volume, (p - texelOrigin) * texelScale + texelBias).r * classification.x;
#ifdef MIP
  colour = vec4(value);
#else
  float x = clamp((value - classification.y) * classification.z, 0.0, classification.w);
  int node = int(x);
  colour = mix(texelFetch(table, ivec2(node, 0), 0), texelFetch(table, ivec2(node + 1, 0), 0), x - float(node));
#ifdef CORRECT
  // Along an oblique ray the planes are further apart: core/compositing.h, correctedOpacity.
  float alpha = colour.a < 1.0 ? 1.0 - exp2(sqrt(1.0 + squared) * log2(1.0 - colour.a)) : 1.0;
  colour = colour.a > 0.0 ? vec4(colour.rgb * (alpha / colour.a), alpha) : vec4(0.0);
#endif
#endif
}

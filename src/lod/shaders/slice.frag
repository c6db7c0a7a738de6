// One sample. #version and any of PARALLEL, SHELLS, CORRECT and MIP are put in front of this.
//
// The sample's place follows from the pixel and the slice alone, by the same arithmetic in every subvolume, and
// a subvolume takes it only where it lies in its own half-open box: each sample is taken exactly once.
//
// Coarse slices are far apart. Where a ray enters and leaves a subvolume their first and last sample stand for what
// lies between the face and the middle to the next sample, however long that is; else faces would show, as strokes
// where the slices meet them.
flat in vec4 sliceOfFragment;
out vec4 colour;

uniform sampler3D volume;
uniform sampler2D table;           // premultiplied, corrected for the distance between slices; one node a texel
uniform vec3 right, down, forward; // image axes in index space, one world unit long
uniform vec3 image;                // edge of a pixel; x and y of the image's centre
uniform vec3 boxLo, boxHi;
uniform float spacing;             // of coarse slices, in world units; 0 at the finest level
uniform vec3 texelOrigin;          // place of the texture's first vertex
uniform vec3 texelScale, texelBias;
uniform vec4 classification;       // value of a texel 1; table coordinate = (value - y) * z, at most w

// How much of the ray a sample stands for, in units of the distance to the next one.
float share(vec3 p, vec3 toNext) {
  vec3 inverse = 1.0 / mix(toNext, vec3(1e-20), lessThan(abs(toNext), vec3(1e-20)));
  vec3 a = (boxLo - p) * inverse, b = (boxHi - p) * inverse;
  vec3 lower = min(a, b), upper = max(a, b);
  float enter = max(max(lower.x, lower.y), lower.z), leave = min(min(upper.x, upper.y), upper.z);
  return (enter > -1.0 ? -enter : 0.5) + (leave < 1.0 ? leave : 0.5);
}

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
  float stretch = 1.0;
#ifdef CORRECT
  // Along an oblique ray the planes are further apart: core/compositing.h, correctedOpacity.
  stretch = sqrt(1.0 + squared);
#endif
#ifdef PARALLEL
  vec3 ray = forward;
#else
  vec3 ray = forward + offset;
#endif
  if (spacing > 0.0) stretch *= share(p, spacing * ray);
  if (stretch != 1.0 && colour.a > 0.0 && colour.a < 1.0) {
    float alpha = 1.0 - exp2(stretch * log2(1.0 - colour.a));
    colour = vec4(colour.rgb * (alpha / colour.a), alpha);
  }
#endif
}

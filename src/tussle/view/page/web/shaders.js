// What runs on the graphics card.

const HEADER = '#version 300 es\nprecision highp float;\n';

/** Light from above and the left, a brighter sky than ground. */
const LIGHT = `
vec3 lit(vec3 colour, vec3 normal) {
  float sun = max(0.0, dot(normal, normalize(vec3(-0.35, -0.5, 0.8))));
  float sky = 0.5 + 0.5 * normal.z;
  return colour * (0.42 + 0.25 * sky + 0.5 * sun);
}`;

/** Numbers of the tables of the renderer. */
const TABLES = `
uniform highp usampler2D rows;
uvec4 texel(highp usampler2D table, int i) {
  return texelFetch(table, ivec2(i & 1023, i >> 10), 0);
}
vec4 numbers(highp usampler2D table, int i) {
  return uintBitsToFloat(texel(table, i));
}
vec4 bytes(uint word) {
  return vec4(uvec4(word, word >> 8, word >> 16, word >> 24) & 255u);
}`;

/** Models: one mesh at many places. Colours have the share of white that marks who is chosen in place of opacity. */
export const MODEL_CORNERS = `${HEADER}
${TABLES}
uniform highp usampler2D mesh;
uniform float corners;
uniform mat4 clip;
uniform float scale;
uniform float least;
out vec3 towards;
out vec4 paint;
vec3 turned(vec4 attitude, vec3 v) {
  return v + 2.0 * cross(attitude.yzw, cross(attitude.yzw, v) + attitude.x * v);
}
void main() {
  int instance = gl_VertexID / int(corners);
  int at = 2 * (gl_VertexID - instance * int(corners));
  uvec4 first = texel(rows, 3 * instance);
  vec3 place = uintBitsToFloat(first.xyz);
  vec4 attitude = numbers(rows, 3 * instance + 1);
  float depth = (clip * vec4(place, 1.0)).w;
  vec3 grown = scale * numbers(rows, 3 * instance + 2).xyz;
  grown *= max(1.0, least * depth / max(1e-9, max(grown.x, max(grown.y, grown.z))));
  gl_Position = clip * vec4(place + turned(attitude, grown * numbers(mesh, at).xyz), 1.0);
  towards = turned(attitude, numbers(mesh, at + 1).xyz / grown);
  paint = bytes(first.w) / 255.0;
}`;
export const MODEL_PAINT = `${HEADER}
in vec3 towards;
in vec4 paint;
uniform float opacity;
uniform float flatness;
uniform float bright;
out vec4 result;
${LIGHT}
void main() {
  vec3 normal = normalize(gl_FrontFacing ? towards : -towards);
  vec3 colour = mix(paint.rgb, vec3(1.0), 0.45 * paint.a);
  result = vec4(min(bright * mix(lit(colour, normal), colour, flatness), 1.0), 1.0) * opacity;
}`;

/** Lines of a width in pixels: six vertices go from a point to the next one, if that is joined to it. */
export const LINE_CORNERS = `${HEADER}
${TABLES}
uniform mat4 clip;
uniform vec3 offset;
uniform vec2 viewport;
uniform float width;
uniform float near;
out vec4 paint;
out float age;
out float side;
void main() {
  int point = gl_VertexID / 6;
  int corner = gl_VertexID - 6 * point;
  corner = corner < 3 ? corner : corner < 5 ? 5 - corner : 3;
  uvec4 start = texel(rows, point);
  uvec4 end = texel(rows, point + 1);
  vec4 a = clip * vec4(uintBitsToFloat(start.xyz) + offset, 1.0);
  vec4 b = clip * vec4(uintBitsToFloat(end.xyz) + offset, 1.0);
  if ((start.w & (1u << 24)) == 0u || (a.w < near && b.w < near)) {
    gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
    return;
  }
  vec2 ages = vec2(start.w >> 25, end.w >> 25) / 127.0;
  if (a.w < near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  if (b.w < near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 way = (b.xy / b.w - a.xy / a.w) * viewport;
  vec2 along = length(way) > 1e-6 ? normalize(way) : vec2(1.0, 0.0);
  bool isEnd = corner > 1;
  side = (corner & 1) == 1 ? 1.0 : -1.0;
  vec4 at = isEnd ? b : a;
  // One pixel more than asked for on each side, over which the line fades: that is its smooth edge.
  at.xy += vec2(-along.y, along.x) * side * (width + 2.0) / viewport * at.w;
  gl_Position = at;
  age = isEnd ? ages.y : ages.x;
  paint = bytes(start.w) / 255.0;
}`;
export const LINE_PAINT = `${HEADER}
in vec4 paint;
in float age;
in float side;
uniform float opacity;
uniform float width;
out vec4 result;
void main() {
  float edge = clamp((1.0 - abs(side)) * 0.5 * (width + 2.0), 0.0, 1.0);
  result = vec4(paint.rgb, 1.0) * (opacity * (1.0 - age) * (1.0 - 0.5 * age) * edge);
}`;

/** The ground grid: lines of three distances, ten times one another; the narrowest fade in as the eye comes nearer. */
const GRID_LINES = `
float lines(vec2 at, float spacing) {
  vec2 cell = at / spacing;
  vec2 width = fwidth(cell);
  vec2 off = abs(fract(cell - 0.5) - 0.5) / max(width, vec2(1e-9));
  vec2 line = (1.0 - min(off, 1.0)) * (1.0 - smoothstep(0.15, 0.5, width));
  return max(line.x, line.y);
}
float grid(vec2 at, float spacing, float nearer) {
  return max(lines(at, spacing) * 0.35 * nearer, max(lines(at, spacing * 10.0) * mix(0.35, 0.75, nearer), lines(at, spacing * 100.0) * 0.75));
}`;
export const GROUND_CORNERS = `${HEADER}
layout(location = 0) in vec2 corner;
uniform mat4 clip;
uniform vec3 middle;
uniform float reach;
out vec2 at;
void main() {
  vec3 place = middle + vec3(corner * reach, 0.0);
  at = place.xy;
  gl_Position = clip * vec4(place, 1.0);
}`;
export const GROUND_PAINT = `${HEADER}
in vec2 at;
uniform vec2 shift;
uniform vec2 centre;
uniform float reach;
uniform float spacing;
uniform float nearer;
uniform vec3 colour;
out vec4 result;
${GRID_LINES}
void main() {
  float fade = 1.0 - smoothstep(0.25, 1.0, length(at - centre) / reach);
  result = vec4(colour, 1.0) * (grid(at + shift, spacing, nearer) * fade * 0.8);
}`;

/** Ground of changing height: coloured by height, with the grid on it and contour lines. */
export const TERRAIN_CORNERS = `${HEADER}
layout(location = 0) in vec3 corner;
layout(location = 1) in vec3 normal;
uniform mat4 clip;
uniform vec3 offset;
out vec3 at;
out vec3 towards;
void main() {
  at = corner;
  towards = normal;
  gl_Position = clip * vec4(corner + offset, 1.0);
}`;
export const TERRAIN_PAINT = `${HEADER}
in vec3 at;
in vec3 towards;
uniform vec2 heights;
uniform float contour;
uniform float spacing;
uniform float nearer;
uniform vec2 shift;
uniform float lightness;
uniform vec2 corner;
uniform vec2 extent;
uniform float textured;
uniform sampler2D image;
out vec4 result;
${LIGHT}
${GRID_LINES}
void main() {
  float share = clamp((at.z - heights.x) / max(heights.y - heights.x, 1e-6), 0.0, 1.0);
  vec3 low = vec3(0.23, 0.33, 0.29);
  vec3 middle = vec3(0.45, 0.43, 0.33);
  vec3 high = vec3(0.72, 0.70, 0.67);
  vec3 colour = mix(mix(low, middle, min(1.0, 2.0 * share)), high, max(0.0, 2.0 * share - 1.0)) * lightness;
  vec2 share2 = (at.xy - corner) / extent;
  colour = lit(mix(colour, texture(image, vec2(share2.x, 1.0 - share2.y)).rgb, textured), normalize(towards));
  float level = at.z / contour;
  float line = 1.0 - min(abs(fract(level - 0.5) - 0.5) / max(fwidth(level), 1e-9), 1.0);
  colour *= 1.0 - 0.3 * (1.0 - textured) * line * (1.0 - smoothstep(0.2, 0.6, fwidth(level)));
  colour = mix(colour, vec3(1.0), 0.18 * grid(at.xy + shift, spacing, nearer));
  result = vec4(colour, 1.0);
}`;

/** Parts of meshes in their own colours, flat between edges. */
export const PART_CORNERS = `${HEADER}
layout(location = 0) in vec3 corner;
layout(location = 1) in vec2 place;
layout(location = 2) in vec3 colour;
uniform mat4 clip;
uniform vec3 offset;
out vec3 at;
out vec2 uv;
out vec3 paint;
void main() {
  at = corner;
  uv = vec2(place.x, 1.0 - place.y);
  paint = colour;
  gl_Position = clip * vec4(corner + offset, 1.0);
}`;
export const PART_PAINT = `${HEADER}
in vec3 at;
in vec2 uv;
in vec3 paint;
uniform sampler2D image;
out vec4 result;
${LIGHT}
void main() {
  vec3 normal = normalize(cross(dFdx(at), dFdy(at)));
  result = vec4(min(lit(paint * texture(image, uv).rgb, normal), 1.0), 1.0);
}`;

/** The sky: a little lighter at the horizon. */
export const SKY_CORNERS = `${HEADER}
layout(location = 0) in vec2 corner;
out float height;
void main() {
  height = 0.5 + 0.5 * corner.y;
  gl_Position = vec4(corner, 0.999999, 1.0);
}`;
export const SKY_PAINT = `${HEADER}
in float height;
uniform vec3 above;
uniform vec3 below;
out vec4 result;
void main() {
  // A grain of less than a step of colour hides the steps.
  float grain = fract(sin(dot(gl_FragCoord.xy, vec2(12.9898, 78.233))) * 43758.5453) / 255.0;
  result = vec4(mix(below, above, smoothstep(0.0, 1.0, height)) + grain, 1.0);
}`;

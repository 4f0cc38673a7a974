// The picture, in plain WebGL2: sky, ground with its dents, robot, shadow. Units are metres, z points up.

const WINDOW = 1024; // cells along an edge of the core's window of depths, as WEB_WINDOW of core.h
const HILLS = 512; // the same of its heights, WEB_HILLS
const SHADOW = 2048; // pixels along an edge of the shadow map
const SHADOW_REACH = 1.7; // [m] around the robot
const INNER = 2.5; // [m] half the edge of the fine mesh around the robot
const FAR = 90; // [m]
const LINKS = 13; // of the largest robot
const SHADES = 12; // spheres that keep light away
const BLADES = 46000; // of grass
const GRASS_REACH = 3.4; // [m]
export const LOOKS = 10; // of the ground: the presets, rigid

// ---- vectors and matrices, column major as WebGL has them ----

const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const clampTo = (x, low, high) => Math.min(Math.max(x, low), high);
const unit = (a) => { const n = Math.hypot(...a); return a.map((x) => x / n); };

function lookAt(eye, target, up) {
  const back = unit(sub(eye, target)), right = unit(cross(up, back)), over = cross(back, right);
  return [right[0], over[0], back[0], 0, right[1], over[1], back[1], 0, right[2], over[2], back[2], 0,
    -dot(right, eye), -dot(over, eye), -dot(back, eye), 1];
}

function times(a, b) {
  const c = new Float32Array(16);
  for (let i = 0; i < 16; i++) {
    for (let k = 0; k < 4; k++) c[i] += a[(k << 2) | (i & 3)] * b[(i & 12) | k];
  }
  return c;
}

function perspective(fovy, aspect, near, far) {
  const f = 1 / Math.tan(fovy / 2), d = near - far;
  return [f / aspect, 0, 0, 0, 0, f, 0, 0, 0, 0, (far + near) / d, -1, 0, 0, (2 * far * near) / d, 0];
}

function orthographic(reach, near, far) {
  const d = near - far;
  return [1 / reach, 0, 0, 0, 0, 1 / reach, 0, 0, 0, 0, 2 / d, 0, 0, 0, (far + near) / d, 1];
}

const SUN = unit([-0.42, -0.52, 0.74]);

// ---- the robot's parts as triangles: position 3, normal 3, link, colour 3, shine, glow ----

const BOX = 0, CYLINDER = 1, CAPSULE = 2; // WebShape; 3: ellipsoid
const VERTEX = 12;

class Mesh {
  constructor() { this.vertices = []; this.indices = []; }

  // A grid of rows x columns points of the function at(row, column) -> [position, normal], in the part's frame.
  grid(part, rows, columns, at) {
    const first = this.vertices.length / VERTEX, { position: p, rotation: R } = part;
    for (let i = 0; i <= rows; i++) {
      for (let j = 0; j <= columns; j++) {
        const [q, n] = at(i, j);
        for (let k = 0; k < 3; k++) {
          this.vertices.push(p[k] + R[3 * k] * q[0] + R[3 * k + 1] * q[1] + R[3 * k + 2] * q[2]);
        }
        for (let k = 0; k < 3; k++) this.vertices.push(R[3 * k] * n[0] + R[3 * k + 1] * n[1] + R[3 * k + 2] * n[2]);
        this.vertices.push(part.link, ...part.color, part.shine, part.glow);
      }
    }
    for (let i = 0; i < rows; i++) {
      for (let j = 0; j < columns; j++) {
        const a = first + i * (columns + 1) + j, b = a + columns + 1;
        this.indices.push(a, a + 1, b, b, a + 1, b + 1);
      }
    }
  }

  // A profile of points [radius, z, normal's radius, normal's z] turned about z.
  lathe(part, profile, columns = 28) {
    this.grid(part, profile.length - 1, columns, (i, j) => {
      const [r, z, nr, nz] = profile[i], a = (2 * Math.PI * j) / columns, c = Math.cos(a), s = Math.sin(a);
      return [[r * c, r * s, z], [nr * c, nr * s, nz]];
    });
  }

  // Six faces of a box with round edges.
  box(part) {
    const h = part.size, round = Math.min(0.3 * Math.min(...h), 0.012), steps = 5;
    const place = (t, half) => { // where node t of an edge is, and how far it leans over the edge
      const corner = half - round, angle = (Math.PI / 4) * (t <= 2 ? (2 - t) / 2 : (t - 3) / 2);
      return [(t <= 2 ? -1 : 1) * corner, (t <= 2 ? -1 : 1) * Math.tan(angle)];
    };
    for (let axis = 0; axis < 3; axis++) {
      for (const side of [-1, 1]) {
        const u = (axis + 1) % 3, v = (axis + 2) % 3;
        this.grid(part, steps, steps, (i, j) => {
          const [a, la] = place(side > 0 ? i : steps - i, h[u]), [b, lb] = place(j, h[v]);
          const n = [0, 0, 0], q = [0, 0, 0];
          n[axis] = side; n[u] = la; n[v] = lb;
          const m = unit(n);
          q[axis] = side * (h[axis] - round); q[u] = a; q[v] = b;
          return [q.map((x, k) => x + round * m[k]), m];
        });
      }
    }
  }

  add(part) {
    const [r, half] = part.size, profile = [];
    if (part.shape === BOX) {
      this.box(part);
    } else if (part.shape === CYLINDER) {
      const e = Math.min(0.2 * r, 0.3 * half, 0.004);
      profile.push([0, -half, 0, -1], [r - e, -half, 0, -1], [r, e - half, 0.7, -0.7], [r, e - half, 1, 0],
        [r, half - e, 1, 0], [r, half - e, 0.7, 0.7], [r - e, half, 0, 1], [0, half, 0, 1]);
      this.lathe(part, profile);
    } else if (part.shape === CAPSULE) {
      for (let i = 0; i <= 16; i++) {
        const a = Math.PI * (Math.min(i, 8) + Math.max(i - 9, 0)) / 15 - Math.PI / 2, c = Math.cos(a), s = Math.sin(a);
        profile.push([r * c, r * s + (i <= 8 ? -half : half), c, s]);
      }
      this.lathe(part, profile, 20);
    } else {
      this.grid(part, 18, 28, (i, j) => {
        const b = Math.PI * (i / 18 - 0.5), a = (2 * Math.PI * j) / 28;
        const n = [Math.cos(b) * Math.cos(a), Math.cos(b) * Math.sin(a), Math.sin(b)];
        return [n.map((x, k) => x * part.size[k]), unit(n.map((x, k) => x / part.size[k]))];
      });
    }
  }
}

// Spheres for the light that the robot keeps from the ground: of each link that has parts, around the middle of their volume, as large as
// they are; the largest SHADES of them.
function shadesOf(parts) {
  const links = new Map();
  for (const { shape, link, size, position } of parts) {
    const [a, b, c] = shape === BOX ? size : shape === CYLINDER ? [size[0], size[0], size[1]]
      : shape === CAPSULE ? [size[0], size[0], size[1] + size[0]] : size;
    const volume = a * b * c, sum = links.get(link) ?? links.set(link, { link, volume: 0, center: [0, 0, 0] }).get(link);
    sum.volume += volume;
    position.forEach((x, k) => { sum.center[k] += volume * x; });
  }
  const spheres = [...links.values()].sort((a, b) => b.volume - a.volume).slice(0, SHADES);
  return spheres.map(({ link, volume, center }) => ({ link, center: center.map((x) => x / volume), radius: 1.1 * Math.cbrt(volume) }));
}

// ---- meshes of the ground ----

// Squares of two cells of the window, in units of such squares.
function innerMesh(half, step) {
  const n = Math.round((2 * half) / step), points = new Float32Array(2 * (n + 1) * (n + 1)), indices = new Uint32Array(6 * n * n);
  for (let j = 0, at = 0; j <= n; j++) {
    for (let i = 0; i <= n; i++) { points[at++] = (i - n / 2) * step; points[at++] = (j - n / 2) * step; }
  }
  for (let j = 0, at = 0; j < n; j++) {
    for (let i = 0; i < n; i++) {
      const a = j * (n + 1) + i, b = a + n + 1;
      indices.set([a, a + 1, b, b, a + 1, b + 1], at);
      at += 6;
    }
  }
  return { points, indices };
}

// Rings that grow outward to the horizon.
function outerMesh(from, to) {
  const rings = 84, spokes = 224, points = [], indices = [];
  for (let i = 0; i <= rings; i++) {
    const r = from * (to / from) ** (i / rings);
    for (let j = 0; j <= spokes; j++) {
      const a = (2 * Math.PI * j) / spokes;
      points.push(r * Math.cos(a), r * Math.sin(a));
    }
  }
  for (let i = 0; i < rings; i++) {
    for (let j = 0; j < spokes; j++) {
      const a = i * (spokes + 1) + j, b = a + spokes + 1;
      indices.push(a, b, a + 1, a + 1, b, b + 1);
    }
  }
  return { points: new Float32Array(points), indices: new Uint32Array(indices) };
}

// ---- noise: a texture that repeats; red: clouds, green: grains, blue: fine clouds, alpha: pores ----

function noisePixels(size) {
  const random = (() => { let s = 12345; return () => (s = (s * 1103515245 + 12345) & 0x7fffffff) / 0x7fffffff; })();
  const layer = (cells) => {
    const values = Float32Array.from({ length: cells * cells }, random), smooth = (t) => t * t * (3 - 2 * t);
    return (x, y) => {
      const u = (x * cells) / size, v = (y * cells) / size, i = Math.floor(u), j = Math.floor(v);
      const s = smooth(u - i), t = smooth(v - j), at = (a, b) => values[((j + b) % cells) * cells + ((i + a) % cells)];
      return (1 - t) * ((1 - s) * at(0, 0) + s * at(1, 0)) + t * ((1 - s) * at(0, 1) + s * at(1, 1));
    };
  };
  const clouds = [4, 8, 16, 32].map(layer), fine = [32, 64, 128].map(layer), grains = Float32Array.from({ length: size * size }, random);
  const pores = Float32Array.from({ length: size * size }, () => 1);
  for (let n = 0; n < 900; n++) {
    const x = random() * size, y = random() * size, r = 1.2 + 2.6 * random() ** 2;
    for (let j = Math.floor(y - r); j <= y + r; j++) {
      for (let i = Math.floor(x - r); i <= x + r; i++) {
        const d = Math.hypot(i - x, j - y) / r, at = ((j + size) % size) * size + ((i + size) % size);
        pores[at] = Math.min(pores[at], 0.25 + 0.75 * Math.min(1, d * d));
      }
    }
  }
  const pixels = new Uint8Array(4 * size * size);
  for (let n = 0; n < size * size; n++) {
    const x = n % size, y = Math.floor(n / size);
    pixels[4 * n] = 255 * clouds.reduce((sum, f, k) => sum + f(x, y) * [0.5, 0.25, 0.15, 0.1][k], 0);
    pixels[4 * n + 1] = 255 * grains[n];
    pixels[4 * n + 2] = 255 * fine.reduce((sum, f, k) => sum + f(x, y) * [0.5, 0.3, 0.2][k], 0);
    pixels[4 * n + 3] = 255 * pores[n];
  }
  return pixels;
}

// ---- shaders ----

const LIGHT = `
const vec3 SUN = vec3(${SUN.map((x) => x.toFixed(5)).join(', ')});
const vec3 SUNLIGHT = vec3(1.0, 0.89, 0.73) * 2.1;
const vec3 HORIZON = vec3(0.70, 0.72, 0.72);
const vec3 ZENITH = vec3(0.22, 0.40, 0.62);
vec3 sky(vec3 d) {
  float up = max(d.z, 0.0);
  vec3 c = mix(HORIZON, ZENITH, 1.0 - exp(-3.4 * up));
  float s = max(dot(d, SUN), 0.0);
  return c + vec3(1.0, 0.85, 0.62) * (0.22 * pow(s, 8.0) + 0.35 * pow(s, 120.0));
}
vec3 linear(vec3 c) { return c * c * (0.305 * c + 0.695); }
vec3 film(vec3 c, vec2 pixel) {
  c = c * (2.51 * c + 0.03) / (c * (2.43 * c + 0.59) + 0.14);
  float noise = fract(52.9829189 * fract(dot(pixel, vec2(0.06711056, 0.00583715))));
  return pow(clamp(c, 0.0, 1.0), vec3(1.0 / 2.2)) + (noise - 0.5) / 255.0;
}`;

const SHADE = `
uniform highp sampler2DShadow shadowMap;
uniform mat4 shadowView;
float sunlit(vec3 p, vec3 n) {
  vec4 q = shadowView * vec4(p + 0.006 * n, 1.0);
  vec3 s = q.xyz * 0.5 + 0.5;
  if (any(lessThan(s.xy, vec2(0.0))) || any(greaterThan(s.xy, vec2(1.0)))) return 1.0;
  float sum = 0.0;
  for (int j = -1; j <= 1; j++)
    for (int i = -1; i <= 1; i++)
      sum += texture(shadowMap, vec3(s.xy + 1.3 * vec2(i, j) / ${SHADOW}.0, s.z - 0.0012));
  return sum / 9.0;
}`;

// Depth and height of the ground; the part of the vertex and of the fragment shader.
const GROUND = `
uniform sampler2D dents;
uniform sampler2D hills;
uniform vec2 middle;
uniform float cell;
uniform float period;
float inWindow(vec2 p) {
  vec2 d = abs(p - middle);
  return max(d.x, d.y) < cell * ${(WINDOW / 2 - 40).toFixed(1)} ? 1.0 : 0.0;
}
float dentAt(vec2 p) { return textureLod(dents, p / (cell * ${WINDOW}.0), 0.0).r; }
float hillAt(vec2 p) { return textureLod(hills, p / period, 0.0).r * (1.0 - smoothstep(14.0, 40.0, length(p - middle))); }`;

const SKY_VERTEX = `#version 300 es
out vec2 at;
void main() {
  at = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(at, 1.0, 1.0);
}`;
const SKY_FRAGMENT = `#version 300 es
precision highp float;
in vec2 at;
out vec4 color;
uniform vec3 rays[3];
${LIGHT}
void main() { color = vec4(film(sky(normalize(rays[0] + at.x * rays[1] + at.y * rays[2])), gl_FragCoord.xy), 1.0); }`;

const GROUND_VERTEX = `#version 300 es
layout(location = 0) in vec2 point;
uniform mat4 view;
uniform vec2 origin;
out vec3 place;
${GROUND}
void main() {
  vec2 p = point + origin;
  place = vec3(p, hillAt(p) - inWindow(p) * dentAt(p));
  gl_Position = view * vec4(place, 1.0);
}`;
const GROUND_FRAGMENT = `#version 300 es
precision highp float;
in vec3 place;
out vec4 color;
uniform vec3 eye;
uniform vec2 hole; // middle of the fine mesh, which the coarse one leaves out
uniform float coarse;
uniform int look; // -1: stripes
uniform vec3 looks[${LOOKS}];
uniform vec4 blockers[${SHADES}]; // spheres that keep the sky's light away
uniform sampler2D noise;
uniform float stripe;
${LIGHT}
${SHADE}
${GROUND}
int lookAt(vec2 p) { return look >= 0 ? look : int(mod(floor(p.x / stripe), 8.0)); }
void main() {
  vec2 p = place.xy;
  vec2 off = abs(p - hole);
  if (coarse > 0.5 && max(off.x, off.y) < ${(INNER - 0.03).toFixed(3)}) discard;
  float e = cell, far = distance(place, eye), inside = inWindow(p);
  float depth = 0.0, around = 0.0, shade = 1.0;
  vec2 slope = vec2(hillAt(p + vec2(0.02, 0.0)) - hillAt(p - vec2(0.02, 0.0)),
                    hillAt(p + vec2(0.0, 0.02)) - hillAt(p - vec2(0.0, 0.02))) / 0.04;
  vec2 steep = vec2(0.0);
  if (inside > 0.5 && far < 9.0) {
    float d00 = dentAt(p + e * vec2(-1.0, -1.0)), d10 = dentAt(p + e * vec2(0.0, -1.0)), d20 = dentAt(p + e * vec2(1.0, -1.0));
    float d01 = dentAt(p + e * vec2(-1.0, 0.0)), d11 = dentAt(p), d21 = dentAt(p + e * vec2(1.0, 0.0));
    float d02 = dentAt(p + e * vec2(-1.0, 1.0)), d12 = dentAt(p + e * vec2(0.0, 1.0)), d22 = dentAt(p + e * vec2(1.0, 1.0));
    steep = vec2(d00 + 2.0 * d01 + d02 - d20 - 2.0 * d21 - d22, d00 + 2.0 * d10 + d20 - d02 - 2.0 * d12 - d22) / (8.0 * e);
    depth = (d00 + d20 + d02 + d22 + 2.0 * (d10 + d01 + d21 + d12) + 4.0 * d11) / 16.0;
    float w = 5.0 * e;
    around = 0.25 * (dentAt(p + vec2(w, 0.0)) + dentAt(p - vec2(w, 0.0)) + dentAt(p + vec2(0.0, w)) + dentAt(p - vec2(0.0, w)));
    vec2 toward = SUN.xy / SUN.z; // the walls of a dent throw shadows into it
    for (int k = 1; k <= 6; k++) {
      float rise = 0.011 * float(k);
      shade = min(shade, 1.0 - smoothstep(0.0, 0.008, depth - rise - dentAt(p + rise * toward)));
    }
  }
  int kind = lookAt(p);
  vec4 large = texture(noise, p * 0.11), mid = texture(noise, p * 0.9), fine = texture(noise, p * 3.7);
  vec3 base = linear(looks[kind]);
  float near = exp(-0.22 * far), rough = 0.0, gloss = 0.0;
  vec2 bump = vec2(0.0);
  float tone = 1.0 + 0.20 * (large.r - 0.5);
  if (kind == 0) { // rubber: speckles
    base = mix(base, vec3(0.35, 0.38, 0.42), 0.5 * smoothstep(0.90, 0.94, texture(noise, p * 2.3).g) * near);
    gloss = 0.12; tone += 0.25 * (fine.g - 0.5) * near;
  } else if (kind <= 4) { // foam: pores
    float q = texture(noise, p * (kind == 1 ? 3.2 : kind == 2 ? 2.2 : 1.6)).a;
    vec2 g = abs(fract(p / 0.1 + 0.5) - 0.5) * 0.1, line = smoothstep(vec2(0.0), vec2(0.0015 + 1.2 * fwidth(p.x)), g);
    tone *= mix(1.0, q, 0.42 * near) * mix(1.0, line.x * line.y, 0.30 * near * near);
    tone += 0.05 * (mid.b - 0.5) - 0.30 * smoothstep(0.0, 0.05, depth);
  } else if (kind == 5) { // grass
    tone += 0.75 * (fine.b - 0.5) * (0.35 + near) + 0.5 * (mid.b - 0.5) + 0.5 * (large.r - 0.5);
    base = mix(base, base * vec3(1.15, 1.03, 0.75), clamp(1.6 * (mid.r - 0.45), 0.0, 0.6));
    base *= 1.0 - 0.35 * smoothstep(0.004, 0.03, depth);
    rough = 1.0;
  } else if (kind <= 7) { // sand: grains and soft ripples
    float a = texture(noise, p * 0.45 + vec2(0.01, 0.0)).r - texture(noise, p * 0.45 - vec2(0.01, 0.0)).r;
    bump = vec2(a, 0.4 * a) * 1.3 * (1.0 - smoothstep(0.002, 0.01, depth));
    tone += (0.34 * (fine.g - 0.5) + 0.22 * (texture(noise, p * 7.9).g - 0.5)) * near + 0.10 * (mid.b - 0.5);
    rough = 0.5;
  } else { // rigid: slabs
    vec2 g = abs(fract(p / 1.2 + 0.5) - 0.5) * 1.2, line = smoothstep(vec2(0.004), vec2(0.004 + 1.5 * fwidth(p.x) + 0.002), g);
    tone *= mix(0.72, 1.0, line.x * line.y); tone += 0.10 * (mid.b - 0.5) + 0.06 * (fine.g - 0.5) * near;
    gloss = 0.2;
  }
  if (look < 0) { // seams between the grounds
    float g = abs(fract(p.x / stripe + 0.5) - 0.5) * stripe;
    tone *= mix(0.62, 1.0, smoothstep(0.004, 0.02 + fwidth(p.x), g));
  }
  base *= tone;
  vec3 n = normalize(vec3(steep - slope + bump, 1.0)), v = normalize(eye - place);
  float light = max(dot(n, SUN), 0.0);
  light = mix(light, 0.75 * light + 0.14, 0.4 * rough);
  float sun = light * shade * sunlit(place, vec3(0.0, 0.0, 1.0));
  float open = exp(-26.0 * max(depth - around, 0.0)) * (1.0 - 0.55 * smoothstep(0.0, 0.05, depth));
  for (int k = 0; k < ${SHADES}; k++) {
    vec3 d = blockers[k].xyz - place;
    float q = dot(d, d), r = blockers[k].w;
    open *= 1.0 - 0.85 * clamp(dot(n, d) * inversesqrt(q), 0.0, 1.0) * min(r * r / q, 1.0);
  }
  vec3 c = base * (SUNLIGHT * sun * 0.62 + sky(n) * 0.60 * open + 0.02);
  vec3 h = normalize(v + SUN);
  c += gloss * (pow(max(dot(n, h), 0.0), 60.0) * sun * SUNLIGHT + 0.5 * pow(1.0 - max(dot(n, v), 0.0), 4.0) * sky(reflect(-v, n)) * open);
  c = mix(c, HORIZON, 1.0 - exp(-0.00055 * far * far - 0.008 * max(far - 4.0, 0.0)));
  color = vec4(film(c, gl_FragCoord.xy), 1.0);
}`;

const POSE = `
uniform vec4 links[${3 * LINKS}];
vec3 turned(int i, vec3 q) { return vec3(dot(links[3 * i].xyz, q), dot(links[3 * i + 1].xyz, q), dot(links[3 * i + 2].xyz, q)); }
vec3 posed(int i, vec3 q) { return turned(i, q) + vec3(links[3 * i].w, links[3 * i + 1].w, links[3 * i + 2].w); }`;
const ROBOT_VERTEX = `#version 300 es
layout(location = 0) in vec3 point;
layout(location = 1) in vec3 normal;
layout(location = 2) in float link;
layout(location = 3) in vec3 paint;
layout(location = 4) in vec2 finish;
uniform mat4 view;
out vec3 place, facing, tint;
out vec2 coat;
${POSE}
void main() {
  int i = int(link + 0.5);
  place = posed(i, point);
  facing = turned(i, normal);
  tint = paint;
  coat = finish;
  gl_Position = view * vec4(place, 1.0);
}`;
const ROBOT_FRAGMENT = `#version 300 es
precision highp float;
in vec3 place, facing, tint;
in vec2 coat;
out vec4 color;
uniform vec3 eye;
uniform vec3 bounce; // colour of the ground below
${LIGHT}
${SHADE}
void main() {
  vec3 n = normalize(facing), v = normalize(eye - place), base = linear(0.06 + 0.94 * tint), h = normalize(v + SUN);
  float light = max(dot(n, SUN), 0.0), sun = light * sunlit(place, n * 2.0), up = 0.5 + 0.5 * n.z;
  vec3 around = mix(linear(bounce) * 0.55, sky(vec3(n.xy, abs(n.z))) * 0.75, up);
  float low = smoothstep(-0.05, 0.35, place.z + 0.25 * n.z);
  vec3 c = base * (SUNLIGHT * sun * 0.62 + around * mix(0.55, 1.0, low));
  float sharp = mix(12.0, 90.0, coat.x), edge = pow(1.0 - max(dot(n, v), 0.0), 5.0);
  vec3 mirror = reflect(-v, n);
  vec3 seen = mirror.z > 0.0 ? sky(mirror) : mix(HORIZON * 0.6, linear(bounce) * 0.5, min(1.0, -3.0 * mirror.z));
  c += coat.x * (pow(max(dot(n, h), 0.0), sharp) * sun * SUNLIGHT * 0.5 + (0.05 + 0.6 * edge) * seen);
  c += base * coat.y * 2.5;
  color = vec4(film(mix(c, HORIZON, 1.0 - exp(-0.00055 * dot(eye - place, eye - place))), gl_FragCoord.xy), 1.0);
}`;
const SHADOW_VERTEX = `#version 300 es
layout(location = 0) in vec3 point;
layout(location = 2) in float link;
uniform mat4 view;
${POSE}
void main() { gl_Position = view * vec4(posed(int(link + 0.5), point), 1.0); }`;
const SHADOW_FRAGMENT = `#version 300 es
precision mediump float;
void main() {}`;

// Blades of grass on a grid fixed in the world, bent by the soles.
const GRASS_VERTEX = `#version 300 es
uniform mat4 view;
uniform int look;
uniform float stripe;
uniform float time;
uniform int across;
out vec3 place, tint;
out float height;
${GROUND}
float hash(ivec2 c, int k) {
  uint h = uint(c.x) * 0x9e3779b1u ^ uint(c.y) * 0x85ebca77u ^ uint(k) * 0xc2b2ae3du;
  h ^= h >> 15; h *= 0x2c1b3c6du; h ^= h >> 12; h *= 0x297a2d39u; h ^= h >> 15;
  return float(h & 0xffffu) / 65536.0;
}
void main() {
  float pitch = 2.0 * ${GRASS_REACH.toFixed(2)} / float(across);
  ivec2 c = ivec2(gl_InstanceID % across, gl_InstanceID / across) - across / 2 + ivec2(floor(middle / pitch));
  vec2 p = (vec2(c) + vec2(hash(c, 1), hash(c, 2))) * pitch;
  float away = length(p - middle) / ${GRASS_REACH.toFixed(2)};
  bool grows = (look >= 0 ? look : int(mod(floor(p.x / stripe), 8.0))) == 5 && away < 1.0;
  float dent = dentAt(p), lean = 6.2832 * hash(c, 3), pressed = smoothstep(0.003, 0.03, dent);
  float tall = (0.035 + 0.035 * hash(c, 4)) * (1.0 - 0.78 * pressed) * (1.0 - smoothstep(0.75, 1.0, away));
  float t = float(gl_VertexID / 2) / 2.0, side = float(gl_VertexID % 2) * 2.0 - 1.0;
  vec2 way = vec2(cos(lean), sin(lean)), wind = 0.004 * vec2(sin(1.7 * time + 3.0 * p.x), cos(1.3 * time + 2.0 * p.y));
  vec2 bend = (way * (0.25 + 0.5 * hash(c, 5) + 1.8 * pressed) * tall + wind * (1.0 - pressed)) * t * t;
  place = vec3(p + bend + vec2(-way.y, way.x) * side * 0.0028 * (1.0 - t), hillAt(p) - inWindow(p) * dent + tall * t);
  float kind = hash(c, 6);
  tint = mix(mix(vec3(0.25, 0.36, 0.17), vec3(0.43, 0.52, 0.25), kind), vec3(0.62, 0.59, 0.36), step(0.93, kind));
  height = t;
  gl_Position = grows ? view * vec4(place, 1.0) : vec4(2.0, 2.0, 2.0, 1.0);
}`;
const GRASS_FRAGMENT = `#version 300 es
precision highp float;
in vec3 place, tint;
in float height;
out vec4 color;
uniform vec3 eye;
${LIGHT}
${SHADE}
void main() {
  float sun = sunlit(place, vec3(0.0, 0.0, 1.0)), far = distance(place, eye);
  vec3 c = linear(tint) * mix(0.45, 1.25, height) * (SUNLIGHT * sun * 0.46 + sky(vec3(0.0, 0.0, 1.0)) * 0.55);
  c = mix(c, HORIZON, 1.0 - exp(-0.00055 * far * far - 0.008 * max(far - 4.0, 0.0)));
  color = vec4(film(c, gl_FragCoord.xy), 1.0);
}`;

// ---- the renderer ----

class Program {
  constructor(gl, vertex, fragment) {
    this.gl = gl;
    this.id = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text.replace('300 es', '300 es\nprecision highp float;\nprecision highp int;'));
      gl.compileShader(shader);
      gl.attachShader(this.id, shader);
    }
    gl.linkProgram(this.id);
    this.places = new Map();
  }

  check() {
    const { gl, id } = this;
    if (!gl.getProgramParameter(id, gl.LINK_STATUS)) {
      throw new Error(gl.getProgramInfoLog(id) + gl.getAttachedShaders(id).map((s) => gl.getShaderInfoLog(s)).join(''));
    }
  }

  // values: name -> number, vector, 4 x 4 matrix, or {int}.
  use(values) {
    const { gl } = this;
    gl.useProgram(this.id);
    for (const [name, value] of Object.entries(values)) {
      if (!this.places.has(name)) this.places.set(name, gl.getUniformLocation(this.id, name));
      const at = this.places.get(name);
      if (at === null) continue;
      if (typeof value === 'number') gl.uniform1f(at, value);
      else if ('int' in value) gl.uniform1i(at, value.int);
      else if ('matrix' in value) gl.uniformMatrix4fv(at, false, value.matrix);
      else if ('fours' in value) gl.uniform4fv(at, value.fours);
      else if ('threes' in value) gl.uniform3fv(at, value.threes);
      else if (value.length === 2) gl.uniform2fv(at, value);
      else gl.uniform3fv(at, value);
    }
  }
}

export class Picture {
  constructor(canvas) {
    const gl = canvas.getContext('webgl2', { antialias: true, powerPreference: 'high-performance' });
    if (!gl) throw new Error('This page needs WebGL2, which this browser does not have.');
    Object.assign(this, { canvas, gl, scale: 1, slow: 1 / 60, since: 0, period: 8, blades: 1 });
    const named = gl.getExtension('WEBGL_debug_renderer_info');
    const renderer = String(gl.getParameter(named ? named.UNMASKED_RENDERER_WEBGL : gl.RENDERER));
    if (/swiftshader|llvmpipe|software/i.test(renderer)) Object.assign(this, { scale: 0.3, blades: 0.05 }); // no GPU
    this.sky = new Program(gl, SKY_VERTEX, SKY_FRAGMENT);
    this.ground = new Program(gl, GROUND_VERTEX, GROUND_FRAGMENT);
    this.robot = new Program(gl, ROBOT_VERTEX, ROBOT_FRAGMENT);
    this.caster = new Program(gl, SHADOW_VERTEX, SHADOW_FRAGMENT);
    this.grass = new Program(gl, GRASS_VERTEX, GRASS_FRAGMENT);
    this.nothing = gl.createVertexArray();
    this.makeTextures();
  }

  // looks: [LOOKS] colours of the ground, sRGB in 0 .. 1. stripe: [m].
  setWorld(looks, stripe) {
    Object.assign(this, { looks: looks.flat(), stripe });
    const outer = outerMesh(INNER * 0.98, FAR);
    this.outerMesh = this.upload(outer.points, outer.indices, [2]);
    for (const program of [this.sky, this.ground, this.robot, this.caster, this.grass]) program.check();
  }

  // The robot and the ground around it, in the place of those before. cell: [m] of the window.
  setRobot(parts, cell) {
    const mesh = new Mesh(), fine = innerMesh(INNER, 2 * cell), inner = innerMesh(INNER, 5 * cell);
    for (const part of parts) mesh.add(part);
    for (const old of [this.robotMesh, this.fineMesh, this.innerMesh]) if (old) this.release(old);
    Object.assign(this, { cell, shades: shadesOf(parts) });
    this.robotMesh = this.upload(new Float32Array(mesh.vertices), new Uint32Array(mesh.indices), [3, 3, 1, 3, 2]);
    this.fineMesh = this.upload(fine.points, fine.indices, [2]);
    this.innerMesh = this.upload(inner.points, inner.indices, [2]);
  }

  release({ array, buffers }) {
    this.gl.deleteVertexArray(array);
    for (const buffer of buffers) this.gl.deleteBuffer(buffer);
  }

  upload(vertices, indices, widths) {
    const { gl } = this, array = gl.createVertexArray(), stride = 4 * widths.reduce((a, b) => a + b), buffers = [gl.createBuffer(), gl.createBuffer()];
    gl.bindVertexArray(array);
    gl.bindBuffer(gl.ARRAY_BUFFER, buffers[0]);
    gl.bufferData(gl.ARRAY_BUFFER, vertices, gl.STATIC_DRAW);
    gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, buffers[1]);
    gl.bufferData(gl.ELEMENT_ARRAY_BUFFER, indices, gl.STATIC_DRAW);
    let offset = 0;
    widths.forEach((width, i) => {
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, width, gl.FLOAT, false, stride, offset);
      offset += 4 * width;
    });
    return { array, buffers, count: indices.length };
  }

  texture(unit, format, size, filter, wrap) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    const texture = gl.createTexture();
    gl.bindTexture(gl.TEXTURE_2D, texture);
    gl.texStorage2D(gl.TEXTURE_2D, filter === gl.LINEAR_MIPMAP_LINEAR ? Math.log2(size) + 1 : 1, format, size, size);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.LINEAR);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, wrap);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, wrap);
    return texture;
  }

  // Units: 0 depths, 1 heights, 2 noise, 3 shadow.
  makeTextures() {
    const { gl } = this;
    this.texture(0, gl.R16F, WINDOW, gl.LINEAR, gl.REPEAT);
    this.texture(1, gl.R16F, HILLS, gl.LINEAR, gl.REPEAT);
    this.texture(2, gl.RGBA8, 256, gl.LINEAR_MIPMAP_LINEAR, gl.REPEAT);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, 256, 256, gl.RGBA, gl.UNSIGNED_BYTE, noisePixels(256));
    gl.generateMipmap(gl.TEXTURE_2D);
    const sharp = gl.getExtension('EXT_texture_filter_anisotropic');
    if (sharp) gl.texParameterf(gl.TEXTURE_2D, sharp.TEXTURE_MAX_ANISOTROPY_EXT, 8);
    const map = this.texture(3, gl.DEPTH_COMPONENT24, SHADOW, gl.LINEAR, gl.CLAMP_TO_EDGE);
    gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_COMPARE_MODE, gl.COMPARE_REF_TO_TEXTURE);
    this.shadow = gl.createFramebuffer();
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadow);
    gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.DEPTH_ATTACHMENT, gl.TEXTURE_2D, map, 0);
    gl.drawBuffers([gl.NONE]);
    gl.readBuffer(gl.NONE);
  }

  // depths: [WINDOW][WINDOW] [m]; dirty: rectangles [x, y, width, height], or null for all.
  setDents(depths, dirty) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0);
    gl.pixelStorei(gl.UNPACK_ROW_LENGTH, WINDOW);
    for (const [x, y, width, height] of dirty || [[0, 0, WINDOW, WINDOW]]) {
      gl.pixelStorei(gl.UNPACK_SKIP_PIXELS, x);
      gl.pixelStorei(gl.UNPACK_SKIP_ROWS, y);
      gl.texSubImage2D(gl.TEXTURE_2D, 0, x, y, width, height, gl.RED, gl.FLOAT, depths);
    }
    for (const what of [gl.UNPACK_ROW_LENGTH, gl.UNPACK_SKIP_PIXELS, gl.UNPACK_SKIP_ROWS]) gl.pixelStorei(what, 0);
  }

  // heights: [HILLS][HILLS] [m] over a period [m].
  setHills(heights, period) {
    const { gl } = this;
    this.period = period;
    gl.activeTexture(gl.TEXTURE1);
    gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, 0, HILLS, HILLS, gl.RED, gl.FLOAT, heights);
  }

  // Fewer pixels and blades where frames take long. seconds: of the last frame.
  adapt(seconds) {
    this.slow += (seconds - this.slow) * Math.min(1, 2 * seconds);
    this.since += seconds;
    const better = this.slow < 0.0175 && this.since > 3 && this.scale < 1, worse = this.slow > 0.026 && this.since > 0.7 && this.scale > 0.3;
    if (better || worse) {
      const factor = better ? 1.12 : clampTo(Math.sqrt(0.022 / this.slow), 0.5, 0.9);
      this.scale = clampTo(this.scale * factor, 0.3, 1);
      this.blades = clampTo(this.blades * factor ** 3, 0.05, 1);
      this.since = 0;
    }
  }

  resize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 2) * this.scale;
    const width = Math.max(1, Math.round(this.canvas.clientWidth * ratio)), height = Math.max(1, Math.round(this.canvas.clientHeight * ratio));
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, { width, height });
  }

  mesh(mesh) {
    this.gl.bindVertexArray(mesh.array);
    this.gl.drawElements(this.gl.TRIANGLES, mesh.count, this.gl.UNSIGNED_INT, 0);
  }

  drawShadow(links, base) {
    const { gl } = this, far = base.map((x, k) => x + 4 * SUN[k]);
    const view = times(orthographic(SHADOW_REACH, 0.5, 8), lookAt(far, base, [0, 0, 1]));
    gl.bindFramebuffer(gl.FRAMEBUFFER, this.shadow);
    gl.viewport(0, 0, SHADOW, SHADOW);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.POLYGON_OFFSET_FILL);
    gl.polygonOffset(1.5, 2);
    this.caster.use({ view: { matrix: view }, links: { fours: links } });
    this.mesh(this.robotMesh);
    gl.disable(gl.POLYGON_OFFSET_FILL);
    gl.bindFramebuffer(gl.FRAMEBUFFER, null);
    return view;
  }

  // links: [LINKS][12], camera: {eye, target}, look: of the ground, -1 for stripes; time [s].
  draw(links, camera, look, time) {
    const { gl, canvas, cell } = this, base = [links[3], links[7], links[11] - 0.25];
    this.resize();
    gl.enable(gl.DEPTH_TEST);
    const shadowView = { matrix: this.drawShadow(links, base) };
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clear(gl.DEPTH_BUFFER_BIT);
    const aspect = canvas.width / canvas.height, fovy = aspect < 0.8 ? 0.82 : 0.62, { eye, target } = camera;
    const view = { matrix: times(perspective(fovy, aspect, 0.05, FAR + 20), lookAt(eye, target, [0, 0, 1])) };
    const ahead = unit(sub(target, eye)), right = unit(cross(ahead, [0, 0, 1])), up = cross(right, ahead), t = Math.tan(fovy / 2);
    const shown = look >= 0 ? look : ((Math.floor(base[0] / this.stripe) % 8) + 8) % 8;
    const shared = {
      view, eye, shadowView, shadowMap: { int: 3 }, dents: { int: 0 }, hills: { int: 1 }, noise: { int: 2 },
      cell, period: this.period, middle: [base[0], base[1]], look: { int: look }, stripe: this.stripe,
    };
    this.robot.use({ ...shared, links: { fours: links }, bounce: this.looks.slice(3 * shown, 3 * shown + 3) });
    this.mesh(this.robotMesh);
    const snap = [0, 1].map((k) => 2 * cell * Math.round(base[k] / (2 * cell)));
    const blockers = { fours: this.blockers(links) };
    const common = { ...shared, hole: snap, looks: { threes: this.looks }, blockers };
    this.ground.use({ ...common, origin: snap, coarse: 0 });
    this.mesh(this.scale > 0.6 ? this.fineMesh : this.innerMesh);
    this.ground.use({ ...common, origin: snap, coarse: 1 });
    this.mesh(this.outerMesh);
    if (look === 5 || look < 0) {
      const across = Math.floor(Math.sqrt(BLADES * this.blades));
      this.grass.use({ ...shared, time, across: { int: across } });
      gl.bindVertexArray(this.nothing);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 5, across * across);
    }
    gl.depthFunc(gl.LEQUAL);
    this.sky.use({ rays: { threes: [...ahead, ...right.map((x) => x * t * aspect), ...up.map((x) => x * t)] } });
    gl.bindVertexArray(this.nothing);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    gl.depthFunc(gl.LESS);
  }

  // The same in the world: [12] x y z radius.
  blockers(links) {
    const spheres = new Float32Array(4 * SHADES);
    this.shades.forEach(({ link, center: q, radius }, n) => {
      const L = links.subarray(12 * link, 12 * link + 12);
      for (let k = 0; k < 3; k++) spheres[4 * n + k] = L[4 * k] * q[0] + L[4 * k + 1] * q[1] + L[4 * k + 2] * q[2] + L[4 * k + 3];
      spheres[4 * n + 3] = radius;
    });
    return spheres;
  }
}

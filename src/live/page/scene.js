// Points, lines and triangles in WebGL2, seen by a camera that turns around a point. What comes in
// is in the map's frame; the view is upright in the floor's: x right, y ahead, z up.
'use strict';

const kVertexShader = `#version 300 es
layout(location = 0) in vec3 p;
layout(location = 1) in vec3 colour;
uniform mat4 T;
uniform float size;
uniform vec4 floorPlane;
out vec3 c;
out vec3 q;
out float height;
void main() {
  q = p;
  height = dot(floorPlane.xyz, p) + floorPlane.w;
  gl_Position = T * vec4(p, 1.0);
  gl_PointSize = clamp(size / gl_Position.w, 1.5, 12.0);
  c = colour;
}`;
const kFragmentShader = `#version 300 es
precision highp float;
in vec3 c;
in vec3 q;
in float height;
uniform float shade, alpha, cut;
out vec4 colour;
const vec3 kLight = vec3(0.35, 0.45, 0.82);
void main() {
  if (height > cut) discard;
  vec3 n = cross(dFdx(q), dFdy(q));
  float lit = dot(n, n) > 0.0 ? abs(dot(normalize(n), kLight)) : 1.0;
  colour = vec4(c * (1.0 - shade * (1.0 - lit)), alpha);
}`;
// A line is a quad of so many pixels across; both ends behind the eye are clipped away.
const kLineShader = `#version 300 es
layout(location = 0) in vec3 a;
layout(location = 1) in vec3 b;
layout(location = 2) in vec4 colourA;
layout(location = 3) in vec4 colourB;
uniform mat4 T;
uniform vec2 screen;
uniform float width;
out vec4 c;
void main() {
  float along = float(gl_VertexID & 1), aside = float(gl_VertexID >> 1) - 0.5;
  vec4 p = T * vec4(a, 1.0), q = T * vec4(b, 1.0);
  const float kNear = 0.06;
  if (p.w < kNear && q.w < kNear) { gl_Position = vec4(0.0, 0.0, 2.0, 1.0); return; }
  if (p.w < kNear) p = mix(p, q, (kNear - p.w) / (q.w - p.w));
  if (q.w < kNear) q = mix(q, p, (kNear - q.w) / (p.w - q.w));
  vec2 way = (q.xy / q.w - p.xy / p.w) * screen;
  way = length(way) > 1e-4 ? normalize(way) : vec2(1.0, 0.0);
  gl_Position = mix(p, q, along);
  vec2 offset = (vec2(-way.y, way.x) * aside + way * (along - 0.5) * 0.5) * 2.0 * width / screen;
  gl_Position.xy += offset * gl_Position.w;
  c = mix(colourA, colourB, along);
}`;
const kLineFragmentShader = `#version 300 es
precision highp float;
in vec4 c;
uniform float alpha;
out vec4 colour;
void main() { colour = vec4(c.rgb, c.a * alpha); }`;

const kHalfView = 0.4;        // of the height [rad]
const kFilled = 0.9;          // of the pane, by what is framed
const kEase_ms = 220;
const kMostSamples = 64;      // of a layer, to frame it

class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl2', {antialias: true});
    this.layers = new Map();
    this.hidden = new Set();  // groups of layers
    this.level = {q: [0, 0, Math.SQRT1_2, Math.SQRT1_2], t: [0, 0, 0]};  // floor <- map; as the camera was held
    this.target = [0, 1.5, 0.5];
    this.yaw = -Math.PI / 2 - 0.45;
    this.pitch = 0.7;
    this.distance = 6;
    this.goal = null;         // of a view that is on its way: {target, distance}
    this.cut = Infinity;      // surfaces higher over the floor are left out [m]
    this.also = [];           // points of the map to be in the frame, too
    this.covered = [0, 0];    // of the pane, by what lies on it: above, below [px]
    this.tookMs = 0;          // of the last drawing
    if (!this.gl) return;
    this.start();
    this.listen();
  }

  start() {
    const gl = this.gl;
    const shader = (type, text) => {
      const s = gl.createShader(type);
      gl.shaderSource(s, text);
      gl.compileShader(s);
      if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
      return s;
    };
    const program = (vertex, fragment, uniforms) => {
      const p = gl.createProgram();
      gl.attachShader(p, shader(gl.VERTEX_SHADER, vertex));
      gl.attachShader(p, shader(gl.FRAGMENT_SHADER, fragment));
      gl.linkProgram(p);
      return {p, ...Object.fromEntries(uniforms.map((u) => [u, gl.getUniformLocation(p, u)]))};
    };
    this.solid = program(kVertexShader, kFragmentShader, ['T', 'size', 'shade', 'alpha', 'cut', 'floorPlane']);
    this.line = program(kLineShader, kLineFragmentShader, ['T', 'screen', 'width', 'alpha']);
    gl.enable(gl.DEPTH_TEST);
    gl.blendFunc(gl.SRC_ALPHA, gl.ONE_MINUS_SRC_ALPHA);
  }

  layer(name, attributes) {
    const gl = this.gl;
    let layer = this.layers.get(name);
    if (layer) return layer;
    layer = {array: gl.createVertexArray(), buffers: attributes.map(() => gl.createBuffer())};
    this.layers.set(name, layer);
    gl.bindVertexArray(layer.array);
    attributes.forEach(([size, type, normalized, perInstance], i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, layer.buffers[i]);
      gl.enableVertexAttribArray(i);
      gl.vertexAttribPointer(i, size, gl[type], normalized, 0, 0);
      gl.vertexAttribDivisor(i, perInstance ? 1 : 0);
    });
    return layer;
  }
  fill(layer, contents) {
    const gl = this.gl;
    contents.forEach((content, i) => {
      gl.bindBuffer(gl.ARRAY_BUFFER, layer.buffers[i]);
      gl.bufferData(gl.ARRAY_BUFFER, content, gl.DYNAMIC_DRAW);
    });
    this.ask();
  }
  /// positions: Float32Array of x, y, z; colours: Uint8Array of r, g, b. Of a point the size, of a
  /// triangle the shade tells how it looks; layers of a group are shown together.
  set(name, mode, positions, colours, {size = 0, shade = 0, alpha = 1, group = name, framed = false} = {}) {
    if (!this.gl) return;
    const layer = this.layer(name, [[3, 'FLOAT', false], [3, 'UNSIGNED_BYTE', true]]);
    const count = positions.length / 3;
    Object.assign(layer, {mode, size, shade, alpha, group, count, samples: framed ? sampled(positions) : null});
    this.fill(layer, [positions, colours]);
  }
  /// Lines between pairs of points; colours: r, g, b, a of each point, or one for all.
  lines(name, points, colours, {width = 1.5, alpha = 1, group = name, isOnTop = false} = {}) {
    if (!this.gl) return;
    const layer = this.layer(name, [[3, 'FLOAT', false, true], [3, 'FLOAT', false, true],
      [4, 'UNSIGNED_BYTE', true, true], [4, 'UNSIGNED_BYTE', true, true]]);
    const count = points.length / 2, ends = [0, 1].map(() => new Float32Array(3 * count));
    const tints = [0, 1].map(() => new Uint8Array(4 * count));
    points.forEach((p, i) => {
      ends[i % 2].set(p, 3 * (i >> 1));
      tints[i % 2].set(colours[0].length ? colours[i] : [...colours, 255].slice(0, 4), 4 * (i >> 1));
    });
    Object.assign(layer, {mode: 'LINES', width, alpha, group, count, isOnTop});
    this.fill(layer, [...ends, ...tints]);
  }
  show(group, shown) {
    if (shown) this.hidden.delete(group); else this.hidden.add(group);
    this.ask();
  }
  remove(name) {
    const gl = this.gl, layer = this.layers.get(name);
    if (!layer) return;
    gl.deleteVertexArray(layer.array);
    layer.buffers.forEach((b) => gl.deleteBuffer(b));
    this.layers.delete(name);
    this.ask();
  }
  removeGroup(group) {
    for (const [name, layer] of [...this.layers]) if (layer.group === group) this.remove(name);
  }

  onFloor(p) { return add(turned(this.level.q, p), this.level.t); }
  inMap(p) { return turned(inverted(this.level.q), sub(p, this.level.t)); }

  axes() {
    const level = Math.cos(this.pitch);
    const back = [level * Math.cos(this.yaw), level * Math.sin(this.yaw), Math.sin(this.pitch)];
    const right = unit(cross([0, 0, 1], back));
    return {right, up: cross(back, right), back};
  }
  eye() { return add(this.target, scaled(this.axes().back, this.distance)); }
  aspect() { return this.canvas.clientWidth / Math.max(1, this.canvas.clientHeight); }

  /// Points of what is looked at, in the floor's frame, without strays.
  content() {
    const points = this.also.map((p) => this.onFloor(p));
    for (const layer of this.layers.values())
      if (layer.samples && !this.hidden.has(layer.group)) for (const p of layer.samples) points.push(this.onFloor(p));
    if (points.length < 50) return points;
    const reach = [0, 1, 2].map((k) => {
      const values = points.map((p) => p[k]).sort((a, b) => a - b);
      const low = values[Math.floor(0.01 * values.length)], high = values[Math.floor(0.99 * values.length)];
      return [low - 0.1 * (high - low), high + 0.1 * (high - low)];
    });
    return points.filter((p) => reach.every(([low, high], k) => p[k] >= low && p[k] <= high));
  }
  /// Fills the pane with what is there, from where the eye looks now.
  frame(isAtOnce = false) {
    const points = this.content();
    if (points.length < 2) return;
    const {right, up, back} = this.axes();
    const slope = Math.tan(kHalfView) * kFilled, [above, below] = this.covered.map((px) => slope - Math.tan(kHalfView) * 2 * px / Math.max(1, this.canvas.clientHeight));
    const slopes = [[slope * this.aspect(), slope * this.aspect()], [above, below]];  // right, left; up, down
    const seen = points.map((p) => [dot(p, right), dot(p, up), dot(p, back), p[2]]).filter((p) => p[3] <= this.cut + 0.05);
    // The nearest eye from which all lie in the picture: x - eye_x <= slope (eye_z - z), and so on.
    const ends = slopes.map(([high, low], k) => {
      let most = -Infinity, least = -Infinity;
      for (const p of seen) { most = Math.max(most, p[k] + high * p[2]); least = Math.max(least, -p[k] + low * p[2]); }
      return {most, least, high, low};
    });
    const eyeBack = Math.max(...ends.map((e) => (e.most + e.least) / (e.high + e.low)));
    const aside = ends.map((e) => (e.most - e.least + (e.low - e.high) * eyeBack) / 2);
    const depth = seen.reduce((sum, p) => sum + p[2], 0) / seen.length;
    const distance = Math.max(1.5, eyeBack - depth);
    const target = add(add(scaled(right, aside[0]), scaled(up, aside[1])), scaled(back, eyeBack - distance));
    this.goal = {target, distance};
    if (isAtOnce || matchMedia('(prefers-reduced-motion: reduce)').matches) { Object.assign(this, this.goal); this.goal = null; }
    this.ask();
  }
  approach() {
    const now = performance.now(), share = 1 - Math.exp(-Math.min(100, now - (this.movedAt || now)) / kEase_ms);
    this.movedAt = now;
    if (!this.goal) return;
    const rest = sub(this.goal.target, this.target);
    this.target = add(this.target, scaled(rest, share));
    this.distance += share * (this.goal.distance - this.distance);
    if (Math.hypot(...rest) + Math.abs(this.goal.distance - this.distance) < 0.01) { Object.assign(this, this.goal); this.goal = null; }
    else this.ask();
  }

  /// Columns of the matrix from map to clip coordinates.
  matrix() {
    const eye = this.eye(), {right, up, back} = this.axes();
    const f = 1 / Math.tan(kHalfView), near = 0.05, far = 500, a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    const row = (v, s) => {
      const inMap = turned(inverted(this.level.q), v);  // v . (R p + t - eye)
      return [...scaled(inMap, s), s * dot(v, sub(this.level.t, eye))];
    };
    const x = row(right, f / this.aspect()), y = row(up, f), depth = row(back, 1);
    const z = [a * depth[0], a * depth[1], a * depth[2], a * depth[3] + b];
    const w = depth.map((v) => -v);
    const T = new Float32Array(16);
    for (let i = 0; i < 4; ++i) T.set([x[i], y[i], z[i], w[i]], 4 * i);
    return T;
  }
  /// Pixel of a point on the canvas' element and its distance, or null behind the eye.
  pixel(p) {
    const T = this.matrix();
    const at = (row) => T[row] * p[0] + T[4 + row] * p[1] + T[8 + row] * p[2] + T[12 + row];
    const w = at(3);
    if (w < 0.05) return null;
    return [(at(0) / w + 1) / 2 * this.canvas.clientWidth, (1 - at(1) / w) / 2 * this.canvas.clientHeight, w];
  }
  /// Of a metre at the point that the view turns about.
  pixelsPerMetre() { return this.canvas.clientHeight / (2 * Math.tan(kHalfView) * this.distance); }

  ask() {
    if (this.asked || !this.gl) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }
  draw() {
    const gl = this.gl, begin = performance.now();
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, {width, height});
    this.approach();
    gl.viewport(0, 0, width, height);
    gl.clearColor(...colourOf('--ground').map((v) => v / 255), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    const T = this.matrix(), shown = [...this.layers.values()].filter((l) => l.count && !this.hidden.has(l.group));
    this.drawSolid(shown.filter((l) => l.mode !== 'LINES' && l.alpha === 1), T, height);
    gl.enable(gl.BLEND);
    this.drawLines(shown.filter((l) => l.mode === 'LINES' && !l.isOnTop), T, [width, height], ratio);
    gl.depthMask(false);
    this.drawSolid(shown.filter((l) => l.mode !== 'LINES' && l.alpha < 1), T, height);
    gl.disable(gl.DEPTH_TEST);
    this.drawLines(shown.filter((l) => l.mode === 'LINES' && l.isOnTop), T, [width, height], ratio);
    gl.enable(gl.DEPTH_TEST);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
    if (this.drawn) this.drawn();
    this.tookMs = performance.now() - begin;
  }
  drawSolid(layers, T, height) {
    const gl = this.gl, u = this.solid, up = turned(inverted(this.level.q), [0, 0, 1]);
    gl.useProgram(u.p);
    gl.uniformMatrix4fv(u.T, false, T);
    gl.uniform4f(u.floorPlane, ...up, this.level.t[2]);
    for (const layer of layers) {
      // A wall is seen through from behind: whoever looks from outside sees into the room.
      if (layer.mode === 'TRIANGLES' && layer.alpha === 1) gl.enable(gl.CULL_FACE); else gl.disable(gl.CULL_FACE);
      gl.uniform1f(u.size, layer.size * height);
      gl.uniform1f(u.shade, layer.shade);
      gl.uniform1f(u.alpha, layer.alpha);
      gl.uniform1f(u.cut, layer.samples && Number.isFinite(this.cut) ? this.cut : 1e9);
      gl.bindVertexArray(layer.array);
      gl.drawArrays(gl[layer.mode], 0, layer.count);
    }
    gl.disable(gl.CULL_FACE);
  }
  drawLines(layers, T, screen, ratio) {
    const gl = this.gl, u = this.line;
    gl.useProgram(u.p);
    gl.uniformMatrix4fv(u.T, false, T);
    gl.uniform2f(u.screen, ...screen);
    for (const layer of layers) {
      gl.uniform1f(u.width, layer.width * ratio);
      gl.uniform1f(u.alpha, layer.alpha);
      gl.bindVertexArray(layer.array);
      gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, layer.count);
    }
  }

  listen() {
    const canvas = this.canvas, fingers = new Map();
    let span = 0;
    canvas.addEventListener('pointerdown', (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); span = 0; });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (e) => { fingers.delete(e.pointerId); span = 0; if (this.turned) this.turned(); });
    canvas.addEventListener('pointermove', (e) => {
      const before = fingers.get(e.pointerId);
      if (!before) return;
      const dx = e.clientX - before[0], dy = e.clientY - before[1];
      fingers.set(e.pointerId, [e.clientX, e.clientY]);
      if (fingers.size === 2) {
        const [a, b] = [...fingers.values()];
        const now = Math.hypot(a[0] - b[0], a[1] - b[1]);
        if (span) this.zoom(span / now);
        span = now;
        this.pan(dx / 2, dy / 2);
      } else if (e.shiftKey || e.buttons === 2) {
        this.pan(dx, dy);
      } else {
        this.yaw -= dx * 0.006;
        this.pitch = Math.min(1.55, Math.max(-1.55, this.pitch + dy * 0.006));
      }
      this.ask();
    });
    canvas.addEventListener('contextmenu', (e) => e.preventDefault());
    canvas.addEventListener('wheel', (e) => { e.preventDefault(); this.zoom(Math.exp(e.deltaY * 0.001)); this.ask(); }, {passive: false});
    new ResizeObserver(() => { this.ask(); if (this.turned) this.turned(); }).observe(canvas);
  }
  zoom(factor) { this.distance = Math.min(200, Math.max(0.3, this.distance * factor)); this.taken(); }
  pan(dx, dy) {
    const s = 1 / this.pixelsPerMetre(), {right, up} = this.axes();
    this.target = add(this.target, add(scaled(right, -dx * s), scaled(up, dy * s)));
    this.taken();
  }
  /// Somebody chose a view: it stays.
  taken() { this.goal = null; if (this.moved) this.moved(); }
}

/// Some points of many, evenly.
function sampled(positions) {
  const count = positions.length / 3, step = Math.max(1, Math.floor(count / kMostSamples)), points = [];
  for (let i = 0; i < count; i += step) points.push(Array.from(positions.subarray(3 * i, 3 * i + 3)));
  return points;
}

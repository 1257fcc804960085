// Points, lines and triangles in WebGL2, seen by a camera that turns around a point.
'use strict';

const kVertexShader = `#version 300 es
layout(location = 0) in vec3 p;
layout(location = 1) in vec3 colour;
uniform mat4 T;
uniform float size;
out vec3 c;
out vec3 q;
void main() {
  q = p;
  gl_Position = T * vec4(p, 1.0);
  gl_PointSize = clamp(size / gl_Position.w, 1.5, 12.0);
  c = colour;
}`;
const kFragmentShader = `#version 300 es
precision highp float;
in vec3 c;
in vec3 q;
uniform float shade;
out vec4 colour;
const vec3 kLight = vec3(0.35, 0.45, 0.82);
void main() {
  vec3 n = cross(dFdx(q), dFdy(q));
  float lit = dot(n, n) > 0.0 ? abs(dot(normalize(n), kLight)) : 1.0;
  colour = vec4(c * (1.0 - shade * (1.0 - lit)), 1.0);
}`;

const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => scaled(a, 1 / Math.hypot(...a));
/// Turns v by the quaternion q (x, y, z, w).
function turned(q, v) {
  const u = [q[0], q[1], q[2]];
  const t = scaled(cross(u, v), 2);
  return add(add(v, scaled(t, q[3])), cross(u, t));
}
function product(q, r) {
  const [x, y, z, w] = q, [a, b, c, d] = r;
  return [w * a + x * d + y * c - z * b, w * b - x * c + y * d + z * a, w * c + x * b - y * a + z * d, w * d - x * a - y * b - z * c];
}
/// T_a_c of T_a_b and T_b_c.
const composed = (ab, bc) => ({t: add(ab.t, turned(ab.q, bc.t)), q: product(ab.q, bc.q)});

class Scene {
  constructor(canvas) {
    this.canvas = canvas;
    this.gl = canvas.getContext('webgl2', {antialias: true});
    this.layers = new Map();
    this.hidden = new Set();  // groups of layers
    this.target = [2, 0, 0];
    this.yaw = Math.PI * 0.9;
    this.pitch = 0.6;
    this.distance = 6;
    this.tookMs = 0;  // of the last drawing
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
    this.program = gl.createProgram();
    gl.attachShader(this.program, shader(gl.VERTEX_SHADER, kVertexShader));
    gl.attachShader(this.program, shader(gl.FRAGMENT_SHADER, kFragmentShader));
    gl.linkProgram(this.program);
    this.uniform = {T: gl.getUniformLocation(this.program, 'T'), size: gl.getUniformLocation(this.program, 'size'), shade: gl.getUniformLocation(this.program, 'shade')};
    gl.enable(gl.DEPTH_TEST);
  }

  /// positions: Float32Array of x, y, z; colours: Uint8Array of r, g, b. Of a point the size, of a
  /// triangle the shade tells how it looks; layers of a group are shown together.
  set(name, mode, positions, colours, {size = 0, shade = 0, group = name} = {}) {
    const gl = this.gl;
    if (!gl) return;
    let layer = this.layers.get(name);
    if (!layer) {
      layer = {array: gl.createVertexArray(), p: gl.createBuffer(), c: gl.createBuffer()};
      this.layers.set(name, layer);
      gl.bindVertexArray(layer.array);
      gl.bindBuffer(gl.ARRAY_BUFFER, layer.p);
      gl.enableVertexAttribArray(0);
      gl.vertexAttribPointer(0, 3, gl.FLOAT, false, 0, 0);
      gl.bindBuffer(gl.ARRAY_BUFFER, layer.c);
      gl.enableVertexAttribArray(1);
      gl.vertexAttribPointer(1, 3, gl.UNSIGNED_BYTE, true, 0, 0);
    }
    Object.assign(layer, {mode, size, shade, group, count: positions.length / 3});
    gl.bindBuffer(gl.ARRAY_BUFFER, layer.p);
    gl.bufferData(gl.ARRAY_BUFFER, positions, gl.DYNAMIC_DRAW);
    gl.bindBuffer(gl.ARRAY_BUFFER, layer.c);
    gl.bufferData(gl.ARRAY_BUFFER, colours, gl.DYNAMIC_DRAW);
    this.ask();
  }
  show(group, shown) {
    if (shown) this.hidden.delete(group); else this.hidden.add(group);
    this.ask();
  }
  remove(name) {
    const gl = this.gl, layer = this.layers.get(name);
    if (!layer) return;
    gl.deleteVertexArray(layer.array);
    gl.deleteBuffer(layer.p);
    gl.deleteBuffer(layer.c);
    this.layers.delete(name);
    this.ask();
  }
  removeGroup(group) {
    for (const [name, layer] of [...this.layers]) if (layer.group === group) this.remove(name);
  }
  /// Lines given as pairs of points, all of one colour.
  lines(name, points, colour) {
    const colours = new Uint8Array(points.length * 3);
    for (let i = 0; i < points.length; ++i) colours.set(colour, 3 * i);
    this.set(name, 'LINES', new Float32Array(points.flat()), colours);
  }

  eye() {
    const level = Math.cos(this.pitch);
    return add(this.target, scaled([level * Math.cos(this.yaw), level * Math.sin(this.yaw), Math.sin(this.pitch)], this.distance));
  }
  /// Columns of the matrix from map to clip coordinates.
  matrix() {
    const eye = this.eye();
    const back = unit(sub(eye, this.target));
    const right = unit(cross([0, 0, 1], back));
    const up = cross(back, right);
    const f = 1 / Math.tan(0.45), aspect = this.canvas.width / Math.max(1, this.canvas.height);
    const near = 0.05, far = 500, a = (far + near) / (near - far), b = 2 * far * near / (near - far);
    const row = (v, s) => [s * v[0], s * v[1], s * v[2], -s * dot(v, eye)];
    const x = row(right, f / aspect), y = row(up, f), depth = row(back, 1);
    const z = [a * depth[0], a * depth[1], a * depth[2], a * depth[3] + b];
    const w = depth.map((v) => -v);
    const T = new Float32Array(16);
    for (let i = 0; i < 4; ++i) T.set([x[i], y[i], z[i], w[i]], 4 * i);
    return T;
  }
  /// Pixel of a point on the canvas' element, or null behind the eye.
  pixel(p) {
    const T = this.matrix();
    const at = (row) => T[row] * p[0] + T[4 + row] * p[1] + T[8 + row] * p[2] + T[12 + row];
    const w = at(3);
    if (w < 0.05) return null;
    return [(at(0) / w + 1) / 2 * this.canvas.clientWidth, (1 - at(1) / w) / 2 * this.canvas.clientHeight];
  }

  ask() {
    if (this.asked) return;
    this.asked = true;
    requestAnimationFrame(() => { this.asked = false; this.draw(); });
  }
  draw() {
    const gl = this.gl, begin = performance.now();
    const ratio = Math.min(2, window.devicePixelRatio || 1);
    const width = Math.round(this.canvas.clientWidth * ratio), height = Math.round(this.canvas.clientHeight * ratio);
    if (this.canvas.width !== width || this.canvas.height !== height) Object.assign(this.canvas, {width, height});
    gl.viewport(0, 0, width, height);
    const dark = matchMedia('(prefers-color-scheme: dark)').matches;
    gl.clearColor(...(dark ? [0.07, 0.086, 0.114] : [0.965, 0.969, 0.976]), 1);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.useProgram(this.program);
    gl.uniformMatrix4fv(this.uniform.T, false, this.matrix());
    for (const layer of this.layers.values()) {
      if (this.hidden.has(layer.group) || !layer.count) continue;
      // A wall is seen through from behind: whoever looks from outside sees into the room.
      if (layer.mode === 'TRIANGLES') gl.enable(gl.CULL_FACE); else gl.disable(gl.CULL_FACE);
      gl.uniform1f(this.uniform.size, layer.size * height);
      gl.uniform1f(this.uniform.shade, layer.shade);
      gl.bindVertexArray(layer.array);
      gl.drawArrays(gl[layer.mode], 0, layer.count);
    }
    if (this.drawn) this.drawn();
    this.tookMs = performance.now() - begin;
  }

  listen() {
    const canvas = this.canvas, fingers = new Map();
    let span = 0;
    canvas.addEventListener('pointerdown', (e) => { canvas.setPointerCapture(e.pointerId); fingers.set(e.pointerId, [e.clientX, e.clientY]); span = 0; });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (e) => { fingers.delete(e.pointerId); span = 0; });
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
    new ResizeObserver(() => this.ask()).observe(canvas);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => this.ask());
  }
  zoom(factor) { this.distance = Math.min(200, Math.max(0.3, this.distance * factor)); }
  pan(dx, dy) {
    const s = this.distance * 0.97 / Math.max(1, this.canvas.clientHeight);
    const back = unit(sub(this.eye(), this.target)), right = unit(cross([0, 0, 1], back)), up = cross(back, right);
    this.target = add(this.target, add(scaled(right, -dx * s), scaled(up, dy * s)));
    if (this.panned) this.panned();
  }
}

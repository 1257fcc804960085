// Vectors as [x, y, z], rotations as quaternions [x, y, z, w]; colours of the style sheet.
'use strict';

const $ = (id) => document.getElementById(id);
const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const scaled = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const unit = (a) => scaled(a, 1 / Math.hypot(...a));
const inverted = (q) => [-q[0], -q[1], -q[2], q[3]];
/// Turns v by the quaternion q.
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

/// r, g, b of a colour of the style sheet, as it is now (light or dark).
const colours = new Map();
function colourOf(name) {
  if (!colours.has(name)) {
    const hex = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
    colours.set(name, [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16)));
  }
  return colours.get(name);
}
const isDark = matchMedia('(prefers-color-scheme: dark)');
isDark.addEventListener('change', () => colours.clear());

const kEarlyToLate = [[43, 92, 255], [160, 64, 224], [255, 90, 95], [255, 171, 46]];
/// Of a time of the run: 0 its beginning, 1 now.
function timeColour(share) {
  const at = Math.min(1, Math.max(0, share)) * (kEarlyToLate.length - 1), low = Math.min(kEarlyToLate.length - 2, Math.floor(at));
  return kEarlyToLate[low].map((v, k) => Math.round(v + (at - low) * (kEarlyToLate[low + 1][k] - v)));
}

// What stands around the surfaces: grid, axes, scale, the camera and its path, boxes with names.
'use strict';

const kMostGridLines = 60;
const kCutOver_m = 2.0;      // over the floor: higher surfaces are a ceiling, lamps, tops of walls
const kRoom_m = 2.3;         // so high a scene has a ceiling to cut away
const kNameOver_m = 0.05;    // a box
const kBoxEdges = [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];
const kBoxSides = [[0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]];

class Surroundings {
  constructor(scene) {
    this.scene = scene;
    this.names = [];
    scene.drawn = () => { this.placeNames(); this.drawScale(); };
  }

  /// Once what is there has changed: floor, ceiling, grid, and the view if it follows.
  settle(isFramed, showsCeiling) {
    const points = this.scene.content(), heights = points.map((p) => p[2]).sort((a, b) => a - b);
    if (points.length) {
      const floor = this.floor ?? heights[Math.floor(0.02 * heights.length)];
      const top = heights[Math.floor(0.98 * heights.length)];
      this.scene.cut = showsCeiling || top - floor < kRoom_m ? Infinity : floor + kCutOver_m;
      this.drawGrid(points, floor);
    }
    if (isFramed) this.scene.frame();
  }
  /// floor <- map, as the run found it.
  setFloor(T_map_floor) {
    const q = inverted(T_map_floor.q);
    this.scene.level = {q, t: scaled(turned(q, T_map_floor.t), -1)};
    this.floor = 0;
  }
  drawGrid(points, floor) {
    const range = [0, 1].map((k) => [Math.floor(points.reduce((v, p) => Math.min(v, p[k]), Infinity)) - 1, Math.ceil(points.reduce((v, p) => Math.max(v, p[k]), -Infinity)) + 1]);
    const step = Math.max(1, Math.ceil(Math.max(range[0][1] - range[0][0], range[1][1] - range[1][0]) / kMostGridLines));
    const ends = [], height = floor - 0.03;  // below the floor's own surface
    for (const k of [0, 1])
      for (let at = Math.ceil(range[k][0] / step) * step; at <= range[k][1]; at += step)
        for (const end of range[1 - k]) ends.push(this.scene.inMap(k ? [end, at, height] : [at, end, height]));
    this.scene.lines('grid', ends, colourOf('--grid'), {width: 1});
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]], kinds = [[224, 62, 62], [52, 168, 83], [66, 120, 240]];
    this.scene.lines('axes', axes.flatMap((a) => [[0, 0, 0], scaled(a, 0.3)]),
      kinds.flatMap((c) => [[...c, 255], [...c, 255]]), {width: 3});
  }
  drawScale() {
    const perMetre = this.scene.pixelsPerMetre();
    let length = 0.1;
    for (const next of [0.2, 0.5, 1, 2, 5, 10, 20, 50]) if (next * perMetre <= 130) length = next;
    const [text, bar] = $('scale').children;
    text.textContent = length < 1 ? `${100 * length} cm` : `${length} m`;
    bar.style.width = `${length * perMetre}px`;
  }

  /// The camera's path, coloured by time; what comes after the moment looked at is faint.
  drawPath(entries, now) {
    const from = entries.length ? entries[0].t : 0, span = Math.max(1e-3, entries.length ? entries.at(-1).t - from : 1);
    const ends = [], tints = [];
    for (let i = 1; i < entries.length; ++i) {
      const a = entries[i - 1], b = entries[i];
      if (!a.pose || !b.pose || isGap(entries, i)) continue;
      ends.push(a.pose.t, b.pose.t);
      for (const e of [a, b]) tints.push([...timeColour((e.t - from) / span), now !== null && e.t > entries[now].t ? 60 : 255]);
    }
    this.scene.lines('way', ends, tints, {width: 3.5, isOnTop: true});
    $('time-legend').hidden = !entries.length;
    $('time-end').textContent = `${span < 10 ? span.toFixed(1) : span.toFixed(0)} s`;
    this.scene.also = entries.filter((e) => e.pose).map((e) => e.pose.t);
  }
  drawCamera(pose) {
    const corner = (y, z) => add(pose.t, turned(pose.q, [0.25, 0.16 * y, 0.12 * z]));
    const corners = [corner(1, 1), corner(-1, 1), corner(-1, -1), corner(1, -1)];
    const edges = corners.flatMap((c, i) => [pose.t, c, c, corners[(i + 1) % 4]]);
    this.scene.lines('camera', edges, colourOf('--accent'), {width: 2.5, isOnTop: true});
  }

  drawBoxes(markers) {
    const edges = [], tints = [], sides = [], tops = new Map();
    const axes = [[1, 0, 0], [0, 1, 0], [0, 0, 1]].map((a) => turned(inverted(this.scene.level.q), a));
    for (const m of markers.filter((o) => o.ns === 'objects')) {
      // They come along the map's axes, and are drawn upright on the floor: as long along each of
      // its axes as an ellipsoid that fills the box.
      const halves = axes.map((a) => Math.hypot(...a.map((v, k) => v * m.scale[k] / 2)));
      const corner = (i) => axes.reduce((p, a, k) => add(p, scaled(a, (2 * (i >> k & 1) - 1) * halves[k])), m.pose.t);
      tops.set(m.id, add(m.pose.t, scaled(axes[2], halves[2] + kNameOver_m)));
      const tint = [...m.colour.slice(0, 3).map((v) => Math.round(255 * v)), 230];
      for (const [a, b] of kBoxEdges) { edges.push(corner(a), corner(b)); tints.push(tint, tint); }
      for (const [a, b, c, d] of kBoxSides) sides.push(...[a, b, c, a, c, d].map((i) => ({p: corner(i), tint})));
    }
    for (const m of markers) {
      if (m.ns !== 'velocities') continue;
      edges.push(...triples(m.points));
      for (let i = 0; i < m.points.length / 3; ++i) tints.push([...colourOf('--dynamic'), 255]);
    }
    this.scene.lines('objects', edges, tints, {width: 1.5});
    this.scene.set('object sides', 'TRIANGLES', new Float32Array(sides.flatMap((s) => s.p)),
      new Uint8Array(sides.flatMap((s) => s.tint.slice(0, 3))), {alpha: 0.13, group: 'objects'});
    this.names = markers.filter((m) => m.ns === 'names').map((m) => ({text: m.text, at: tops.get(m.id) ?? m.pose.t}));
  }
  /// The nearest first; one that would lie on another moves up, or is left out.
  placeNames() {
    const taken = [], kHeight = 20, spans = [];
    const shown = this.scene.hidden.has('objects') ? [] : this.names;
    const placed = shown.map(({text, at}) => ({text, pixel: this.scene.pixel(at)})).filter((n) => n.pixel);
    for (const {text, pixel} of placed.sort((a, b) => a.pixel[2] - b.pixel[2])) {
      const half = 4 * text.length + 8;
      let y = pixel[1];
      const hits = () => taken.find((o) => Math.abs(o.x - pixel[0]) < o.half + half && Math.abs(o.y - y) < kHeight);
      for (let tries = 0; tries < 3 && hits(); ++tries) y = hits().y - kHeight;
      if (hits()) continue;
      taken.push({x: pixel[0], y, half});
      const span = document.createElement('span');
      span.textContent = text;
      span.style.left = `${pixel[0]}px`;
      span.style.top = `${y}px`;
      spans.push(span);
    }
    $('names').replaceChildren(...spans);
  }
}

function triples(numbers) { return Array.from({length: numbers.length / 3}, (_, i) => Array.from(numbers.subarray(3 * i, 3 * i + 3))); }

// The run so far: of each frame pose, how sure it is, times, points and mask age; the curves of it, and the
// scrubber through it.
'use strict';

const kMostEntries = 4096;
const kGap_s = 0.4, kGapFrames = 8;
const kCurves = {
  time: {colours: ['--accent', '--static', '--unknown'], names: ['features', 'motion', 'pose'], of: (e) => e.stages, isStacked: true},
  points: {colours: ['--static', '--dynamic', '--unknown'], names: ['static', 'dynamic', 'unknown'], of: (e) => e.points},
  age: {colours: ['--accent'], names: ['mask'], of: (e) => [e.age < 0 ? NaN : e.age]},
};

class RunRecord {
  constructor() {
    this.entries = [];   // in the order of their frames
    this.cursor = null;  // of the entry that is looked at; null: the newest, as they come
    $('scrub').addEventListener('input', () => this.look(Number($('scrub').value)));
    $('live').addEventListener('click', () => this.look(null));
    for (const name of Object.keys(kCurves)) {
      const canvas = $(`plot-${name}`);
      canvas.addEventListener('pointerdown', (e) => this.lookAt(canvas, e));
      canvas.addEventListener('pointermove', (e) => { if (e.buttons) this.lookAt(canvas, e); });
      new ResizeObserver(() => this.draw()).observe(canvas);
    }
    isDark.addEventListener('change', () => this.draw());
  }
  /// What the server kept, in place of all up to its last frame.
  load(past) {
    const last = past.length ? past.at(-1).frame : -1;
    this.entries = past.length ? [...past, ...this.entries.filter((e) => e.frame > last)] : [];
    this.changed();
  }
  add(entry) {
    if (this.entries.length && entry.frame <= this.entries.at(-1).frame) return;
    this.entries.push(entry);
    if (this.entries.length > kMostEntries) {
      this.entries = this.entries.filter((_, i) => i % 2 === 0);
      if (this.cursor !== null) this.cursor >>= 1;
    }
    this.changed();
  }
  forget() { this.entries = []; this.look(null); }

  /// @param index of an entry, or null for now.
  look(index) {
    const last = this.entries.length - 1;
    this.cursor = index === null || index >= last ? null : Math.max(0, index);
    this.changed();
    if (this.looked) this.looked();
  }
  step(by) { this.look((this.cursor ?? this.entries.length - 1) + by); }
  lookAt(canvas, event) {
    const box = canvas.getBoundingClientRect(), {left, right} = kMargins;
    const share = (event.clientX - box.x - left) / (box.width - left - right);
    const [from, to] = this.span(), t = from + share * (to - from);
    this.look(this.entries.findIndex((e) => e.t >= t));
  }
  get entry() { return this.entries[this.cursor ?? this.entries.length - 1]; }
  span() { return this.entries.length ? [this.entries[0].t, Math.max(this.entries[0].t + 0.5, this.entries.at(-1).t)] : [0, 1]; }

  changed() {
    const last = Math.max(0, this.entries.length - 1), scrub = $('scrub');
    if (this.cursor !== null && this.cursor >= last) this.cursor = null;
    scrub.max = last;
    scrub.value = this.cursor ?? last;
    scrub.disabled = !last;
    $('live').disabled = this.cursor === null;
    $('live').title = this.cursor === null ? 'This is now' : 'Back to now (End)';
    this.isOld = true;
  }
  draw() {
    this.isOld = false;
    const entry = this.entry;
    $('moment').textContent = entry ? `${(entry.t - this.entries[0].t).toFixed(1)} s \u00b7 frame ${entry.frame}` : '';
    $('ms').textContent = entry ? `${entry.stages.reduce((a, b) => a + b, 0).toFixed(1)} in all` : '';
    $('points').textContent = entry ? `${entry.points.reduce((a, b) => a + b, 0)} in all` : '';
    $('age').textContent = !entry ? '' : entry.age < 0 ? 'no mask' : `${entry.age}`;
    for (const [name, curve] of Object.entries(kCurves)) drawCurves($(`plot-${name}`), curve, this);
    this.drawMarks();
  }
  /// Over the scrubber: where there was no pose, and where it was unsure.
  drawMarks() {
    const canvas = $('marks'), last = this.entries.length - 1, width = canvas.width = canvas.clientWidth;
    const g = canvas.getContext('2d'), x = (i) => kThumb_px / 2 + i / Math.max(1, last) * (width - kThumb_px);
    for (const [colour, holds] of [['--unknown', (e) => e.unsure], ['--dynamic', (e) => e.lost]]) {
      g.fillStyle = `rgb(${colourOf(colour).join(' ')})`;
      this.entries.forEach((e, i) => { if (holds(e)) g.fillRect(Math.floor(x(i - 0.5)), 0, Math.ceil(x(i + 0.5)) - Math.floor(x(i - 0.5)), canvas.height); });
    }
  }
  /// Of what the camera gives: between frames, in the median.
  get period_ms() {
    const gaps = this.entries.slice(1).map((e, i) => (e.t - this.entries[i].t) / (e.frame - this.entries[i].frame)).sort((a, b) => a - b);
    return gaps.length ? 1e3 * gaps[gaps.length >> 1] : NaN;
  }
}

const kThumb_px = 16;  // as wide as browsers draw a scrubber's
const kMargins = {left: 34, right: 6, top: 16, bottom: 14};

/// Axes with three marks up and some along, a legend with the values of the moment, the curves.
function drawCurves(canvas, {colours: names, names: labels, of, isStacked}, record) {
  const ratio = window.devicePixelRatio || 1, {left, right, top, bottom} = kMargins;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width) return;
  Object.assign(canvas, {width: Math.round(width * ratio), height: Math.round(height * ratio)});
  const g = canvas.getContext('2d'), entries = record.entries, [from, to] = record.span();
  const css = (name) => `rgb(${colourOf(name).join(' ')})`;
  g.scale(ratio, ratio);
  g.font = '10px system-ui, sans-serif';
  const rows = entries.map(isStacked ? (e) => summed(of(e)) : of), budget = isStacked ? record.period_ms : NaN;
  const most = Math.max(highest(rows), budget ? roundUp(budget) : 0);
  const x = (t) => left + (t - from) / (to - from) * (width - left - right);
  const y = (v) => height - bottom - Math.min(1, v / most) * (height - top - bottom);
  g.lineWidth = 1;
  g.strokeStyle = css('--line');
  g.fillStyle = css('--faint');
  g.textAlign = 'right';
  g.textBaseline = 'middle';
  for (const v of most > 1 ? [0, most / 2, most] : [0, most]) {
    g.beginPath();
    g.moveTo(left, Math.round(y(v)) + 0.5);
    g.lineTo(width - right, Math.round(y(v)) + 0.5);
    g.stroke();
    g.fillText(`${v}`, left - 4, y(v));
  }
  g.textBaseline = 'alphabetic';
  const step = roundUp((to - from) / 4);
  for (let t = 0; t <= to - from; t += step) {
    g.textAlign = t === 0 ? 'left' : t > 0.95 * (to - from) ? 'right' : 'center';
    g.fillText(`${Number(t.toFixed(2))} s`, x(from + t), height - 2);
  }
  g.fillStyle = `rgb(${colourOf('--dynamic').join(' ')} / 0.2)`;
  entries.forEach((e, i) => {
    if (!e.lost) return;
    const until = i + 1 < entries.length && !isGap(entries, i + 1) ? entries[i + 1].t : e.t;
    g.fillRect(x(e.t), top, Math.max(1, x(until) - x(e.t)), height - top - bottom);
  });
  g.lineJoin = 'round';
  g.lineWidth = 1.5;
  for (let k = names.length; k-- > 0;) {
    g.strokeStyle = g.fillStyle = css(names[k]);
    for (const piece of unbroken(entries, rows.map((row) => row[k]))) {
      g.beginPath();
      if (isStacked) g.moveTo(x(piece[0][0]), y(0));
      for (const [t, v] of piece) g.lineTo(x(t), y(v));
      if (!isStacked) { g.stroke(); continue; }
      g.lineTo(x(piece.at(-1)[0]), y(0));
      g.fill();
    }
  }
  if (budget) {  // with more than that it does not keep up
    g.strokeStyle = css('--ink');
    g.lineWidth = 1;
    g.setLineDash([4, 3]);
    g.beginPath();
    g.moveTo(left, y(budget));
    g.lineTo(width - right, y(budget));
    g.stroke();
    g.setLineDash([]);
  }
  let at = left;
  g.textAlign = 'left';
  const now = record.entry && of(record.entry);
  labels.forEach((label, k) => {
    const text = now && !Number.isNaN(now[k]) ? `${label} ${Number(now[k].toFixed(1))}` : label;
    g.fillStyle = css(names[k]);
    g.fillRect(at, 4, 10, 3);
    g.fillStyle = css('--ink');
    g.fillText(text, at + 14, 9);
    at += g.measureText(text).width + 28;
  });
  if (record.cursor === null) return;
  g.strokeStyle = css('--ink');
  g.beginPath();
  g.moveTo(x(record.entry.t), top - 4);
  g.lineTo(x(record.entry.t), height - bottom);
  g.stroke();
}
/// [t, value] of entries between which none is missing.
function unbroken(entries, values) {
  const pieces = [];
  let isOpen = false;
  values.forEach((v, i) => {
    if (isGap(entries, i) || Number.isNaN(v)) isOpen = false;
    if (Number.isNaN(v)) return;
    if (!isOpen) pieces.push([]);
    pieces.at(-1).push([entries[i].t, v]);
    isOpen = true;
  });
  return pieces;
}
/// Whether frames are missing before this entry: far longer than frames take in the mean.
function isGap(entries, i) {
  const mean_s = (entries.at(-1).t - entries[0].t) / entries.length;
  return i > 0 && entries[i].t - entries[i - 1].t > Math.max(kGap_s, kGapFrames * mean_s);
}
/// Each on top of those before it.
function summed(values) {
  let sum = 0;
  return values.map((v) => sum += v);
}
/// The end of the axis: a few peaks stand out beyond it.
function highest(rows) {
  const values = rows.flat().filter((v) => v > 0).sort((a, b) => a - b);
  return values.length ? roundUp(Math.max(1, 1.3 * values[Math.floor(0.98 * (values.length - 1))])) : 1;
}
/// 1, 2 or 5 times a power of ten.
function roundUp(value) {
  const power = 10 ** Math.floor(Math.log10(Math.max(value, 1e-9)));
  return [1, 2, 5, 10].map((f) => f * power).find((v) => v >= value * 0.999);
}

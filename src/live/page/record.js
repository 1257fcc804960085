// The run so far: of each frame pose, whether it is lost, times, points and mask age; the curves of it, and the
// scrubber through it.
'use strict';

const kMostEntries = 4096;
const kGap_s = 0.4, kGapFrames = 8;
const kCurves = {
  time: {colours: ['--accent', '--static', '--unknown'], names: ['features', 'motion', 'pose'], of: (e) => e.stages},
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
  }
}

const kMargins = {left: 34, right: 6, top: 16, bottom: 14};

/// Axes with three marks up and some along, a legend with the values of the moment, the curves.
function drawCurves(canvas, {colours: names, names: labels, of}, record) {
  const ratio = window.devicePixelRatio || 1, {left, right, top, bottom} = kMargins;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (!width) return;
  Object.assign(canvas, {width: Math.round(width * ratio), height: Math.round(height * ratio)});
  const g = canvas.getContext('2d'), entries = record.entries, [from, to] = record.span();
  const css = (name) => `rgb(${colourOf(name).join(' ')})`;
  g.scale(ratio, ratio);
  g.font = '10px system-ui, sans-serif';
  const rows = entries.map(of), most = highest(rows);
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
  names.forEach((name, k) => {
    g.strokeStyle = css(name);
    g.beginPath();
    let isDown = false;
    rows.forEach((row, i) => {
      if (Number.isNaN(row[k])) { isDown = false; return; }
      if (isGap(entries, i)) isDown = false;
      g[isDown ? 'lineTo' : 'moveTo'](x(entries[i].t), y(row[k]));
      isDown = true;
    });
    g.stroke();
  });
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
/// Whether frames are missing before this entry: far longer than frames take in the mean.
function isGap(entries, i) {
  const mean_s = (entries.at(-1).t - entries[0].t) / entries.length;
  return i > 0 && entries[i].t - entries[i - 1].t > Math.max(kGap_s, kGapFrames * mean_s);
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

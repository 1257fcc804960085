// The camera's images with what is said of them: those of the last moments are kept.
'use strict';

const kMostKept = 240, kSaidOf = 120;
const kMaskFades_s = 1.2;  // a mask of longer ago is not drawn
const kSame_s = 0.06;      // images this near are looked at as one moment
const kOutline = 4, kPoints = 1, kLoop = 2;  // types of PointsAnnotation

class ImagePane {
  constructor(canvas) {
    this.canvas = canvas;
    this.kept = [];            // {stamp, data}: images of the run so far, thinner the more there are
    this.said = new Map();     // of an image, by its stamp
    this.requests = this.done = 0;  // images asked for; the last of them that was shown
    this.masks = [];           // outlines with the boxes of their own image
  }
  forget() { this.kept = []; this.said.clear(); this.masks = []; this.shown = null; this.done = ++this.requests; }

  async add(stamp, data) {
    this.kept.push({stamp, data});
    // Every second goes, but for the newest.
    if (this.kept.length > kMostKept) this.kept = this.kept.filter((_, i) => i % 2 || i > kMostKept / 2);
    if (this.past === undefined) await this.load(this.kept.at(-1));
  }
  tell(said) {
    const stamp = said.shapes[0].stamp, outline = said.shapes.find((shape) => shape.type === kOutline);
    this.said.set(stamp, said);
    if (outline) {
      const own = this.near(this.said.keys(), outline.stamp);
      this.masks.push({outline, boxes: own === undefined ? [] : boxesOf(this.said.get(own))});
      if (this.masks.length > kSaidOf) this.masks.shift();
    }
    if (this.said.size > kMostKept + kSaidOf) this.said.delete(this.said.keys().next().value);
    if (this.shown === stamp) this.draw();
  }
  near(stamps, stamp, reach = kSame_s) {
    let best;
    for (const s of stamps) if (Math.abs(s - stamp) <= reach && (best === undefined || Math.abs(s - stamp) < Math.abs(best - stamp))) best = s;
    return best;
  }

  /// Shows the image of a moment if one is kept; undefined: the newest, as they come.
  async look(stamp) {
    this.past = stamp;
    const wanted = stamp === undefined ? this.kept.at(-1) : this.kept.find((k) => k.stamp === this.near(this.kept.map((o) => o.stamp), stamp, 0.2));
    if (this.bitmap) {  // else it says that none came yet
      $('no-image').textContent = 'no image is kept of this moment';
      $('no-image').hidden = stamp === undefined || !!wanted;
      this.canvas.classList.toggle('faint', !$('no-image').hidden);
    }
    if (wanted) await this.load(wanted);
  }
  /// Decoding may end in another order than it began: nothing is shown over what was asked for later.
  async load({stamp, data}) {
    const request = ++this.requests;
    const bitmap = await createImageBitmap(new Blob([data], {type: 'image/jpeg'}));
    if (request < this.done) { bitmap.close(); return; }
    this.done = request;
    if (this.bitmap) this.bitmap.close();
    else { $('no-image').hidden = true; this.canvas.classList.remove('faint'); }  // none had come
    this.bitmap = bitmap;
    this.shown = stamp;
    this.draw();
  }

  /// Of what is drawn, as the pane shows images of all sizes alike.
  get scale() { return this.canvas.width / 640; }
  draw() {
    if (!this.bitmap) return;
    const {canvas, bitmap} = this;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) Object.assign(canvas, {width: bitmap.width, height: bitmap.height});
    const g = canvas.getContext('2d');
    g.drawImage(bitmap, 0, 0);
    const said = this.said.get(this.shown);  // of this image: those of another would lie beside things
    if (!said) return;
    if ($('show-masks').checked) this.drawMask(g, said);
    for (const shape of said.shapes) {
      if (shape.type === kPoints && $('show-points').checked) {
        g.fillStyle = css(shape.colour);
        const side = 4 * this.scale;
        for (const p of shape.points) g.fillRect(p[0] - side / 2, p[1] - side / 2, side, side);
      } else if (shape.type === kLoop && $('show-boxes').checked) {
        g.strokeStyle = css(shape.colour);
        g.lineWidth = 3 * this.scale;
        trace(g, shape.points, (i) => i === 0);
        g.closePath();
        g.stroke();
      }
    }
    if ($('show-boxes').checked) this.drawNames(g, said.texts);
  }
  /// A mask that is older than the image goes along with the boxes of its objects, and fades.
  drawMask(g, said) {
    let mask;
    for (const m of this.masks) if (m.outline.stamp <= this.shown + 1e-6) mask = m;
    if (!mask) return;
    const age_s = this.shown - mask.outline.stamp, now = boxesOf(said);
    if (age_s > kMaskFades_s) return;
    const points = age_s < kSame_s ? mask.outline.points : carried(mask.outline.points, mask.boxes, now);
    g.globalAlpha = 1 - age_s / kMaskFades_s;
    g.strokeStyle = css(mask.outline.colour);
    g.lineWidth = 2.5 * this.scale;
    trace(g, points, (i) => i % 2 === 0);
    g.stroke();
    g.globalAlpha = 1;
  }
  drawNames(g, texts) {
    const taken = [], {scale} = this;
    g.save();
    g.scale(scale, scale);
    g.font = '16px system-ui, sans-serif';
    for (const {at, text} of texts) {
      const width = g.measureText(text).width + 8, x = Math.max(0, Math.min(at[0] / scale, this.canvas.width / scale - width));
      let y = Math.max(18, at[1] / scale);
      while (taken.some((o) => Math.abs(o.y - y) < 20 && o.x < x + width && x < o.x + o.width)) y += 20;
      taken.push({x, y, width});
      g.fillStyle = '#000a';
      g.fillRect(x, y - 18, width, 20);
      g.fillStyle = '#fff';
      g.fillText(text, x + 4, y - 3);
    }
    g.restore();
  }
}

const css = (c) => `rgb(${c.slice(0, 3).map((v) => Math.round(255 * v)).join(' ')})`;
function trace(g, points, begins) {
  g.beginPath();
  points.forEach((p, i) => begins(i) ? g.moveTo(...p) : g.lineTo(...p));
}
/// Boxes of objects in an image, by their names, which begin at a box's corner.
function boxesOf(said) {
  const loops = said.shapes.filter((shape) => shape.type === kLoop);
  return new Map(said.texts.map(({text}, i) => {
    const [low, , high] = loops[i].points;
    return [text, {x: low[0], y: low[1], width: high[0] - low[0], height: high[1] - low[1]}];
  }));
}
/// Lines of an outline, moved as the smallest box around them did; those of no box that is still
/// there are left out.
function carried(points, before, now) {
  const moved = [], kSlack_px = 8;
  const around = (p, b) => p[0] > b.x - kSlack_px && p[1] > b.y - kSlack_px && p[0] < b.x + b.width + kSlack_px && p[1] < b.y + b.height + kSlack_px;
  const boxes = [...before].filter(([name]) => now.has(name)).sort(([, a], [, b]) => a.width * a.height - b.width * b.height);
  for (let i = 0; i + 1 < points.length; i += 2) {
    const found = boxes.find(([, b]) => around(points[i], b) && around(points[i + 1], b));
    if (!found) continue;
    const from = found[1], to = now.get(found[0]);
    for (const p of [points[i], points[i + 1]])
      moved.push([to.x + (p[0] - from.x) * to.width / Math.max(1, from.width), to.y + (p[1] - from.y) * to.height / Math.max(1, from.height)]);
  }
  return moved;
}

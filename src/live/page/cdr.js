// ROS 2's CDR: little-endian, numbers aligned to their size after a head of four bytes.
'use strict';

class Cdr {
  constructor(buffer, from) {
    this.view = new DataView(buffer, from + 4);
    this.buffer = buffer;
    this.base = from + 4;
    this.at = 0;
  }
  align(size) { this.at = Math.ceil(this.at / size) * size; }
  u8() { return this.view.getUint8(this.at++); }
  u32() { this.align(4); this.at += 4; return this.view.getUint32(this.at - 4, true); }
  i32() { this.align(4); this.at += 4; return this.view.getInt32(this.at - 4, true); }
  f32() { this.align(4); this.at += 4; return this.view.getFloat32(this.at - 4, true); }
  f64() { this.align(8); this.at += 8; return this.view.getFloat64(this.at - 8, true); }
  string() {
    const length = this.u32();
    const bytes = new Uint8Array(this.buffer, this.base + this.at, Math.max(0, length - 1));
    this.at += length;
    return new TextDecoder().decode(bytes);
  }
  bytes() {
    const length = this.u32();
    this.at += length;
    return new Uint8Array(this.buffer, this.base + this.at - length, length);
  }
  /// A copy: in the message numbers may lie at any byte.
  many(Type, count) {
    if (!count) return new Type(0);
    this.align(Type.BYTES_PER_ELEMENT);
    const from = this.base + this.at, size = count * Type.BYTES_PER_ELEMENT;
    this.at += size;
    return new Type(this.buffer.slice(from, from + size));
  }
  list(read) { return Array.from({length: this.u32()}, () => read()); }
  numbers(count) { return Array.from({length: count}, () => this.f64()); }

  time() { return this.i32() + 1e-9 * this.u32(); }
  header() { return {stamp: this.time(), frame: this.string()}; }
  pose() { return {t: this.numbers(3), q: this.numbers(4)}; }
}

// What each topic's bytes say, as far as the page shows it.
const decoders = {
  'tf2_msgs/msg/TFMessage': (c) => {
    const of = {};
    c.list(() => {
      const header = c.header();
      const child = c.string();
      of[child] = {parent: header.frame, ...c.pose()};
      of.stamp = header.stamp;
    });
    return of;
  },
  'sensor_msgs/msg/CompressedImage': (c) => ({header: c.header(), format: c.string(), data: c.bytes()}),
  'foxglove_msgs/msg/ImageAnnotations': (c) => {
    const circles = c.u32();
    if (circles) throw new Error('circles are not drawn');
    const shapes = c.list(() => {
      const stamp = c.time();
      const type = c.u8();
      const points = c.list(() => c.numbers(2));
      const colour = c.numbers(4);
      const colours = c.list(() => c.numbers(4));
      c.numbers(5);
      return {stamp, type, points, colour, colours};
    });
    const texts = c.list(() => {
      c.time();
      const at = c.numbers(2);
      const text = c.string();
      c.numbers(9);
      return {at, text};
    });
    return {shapes, texts};
  },
  'visualization_msgs/msg/MarkerArray': (c) => c.list(() => {
    c.header();
    const m = {ns: c.string(), id: c.i32(), type: c.i32(), action: c.i32(), pose: c.pose(), scale: c.numbers(3)};
    m.colour = [c.f32(), c.f32(), c.f32(), c.f32()];
    c.i32(); c.u32(); c.u8();
    m.points = c.many(Float64Array, 3 * c.u32());   // x, y, z, x, ...
    m.colours = c.many(Float32Array, 4 * c.u32());  // r, g, b, a, r, ...
    c.string(); c.header(); c.string(); c.bytes();
    c.list(() => { c.f32(); c.f32(); });
    m.text = c.string();
    c.string(); c.string(); c.bytes(); c.u8();
    return m;
  }),
  'diagnostic_msgs/msg/DiagnosticArray': (c) => {
    const {stamp} = c.header();
    return c.list(() => {
      const s = {stamp, level: c.u8(), name: c.string(), message: c.string(), hardware: c.string(), values: {}};
      c.list(() => { const key = c.string(); s.values[key] = c.string(); });
      return s;
    });
  },
  'sensor_msgs/msg/PointCloud2': (c) => {
    c.header();
    const height = c.u32(), width = c.u32();
    const fields = c.list(() => ({name: c.string(), offset: c.u32(), type: c.u8(), count: c.u32()}));
    c.u8();
    const step = c.u32();
    c.u32();
    return {count: height * width, fields, step, data: c.bytes()};
  },
  'nav_msgs/msg/Path': (c) => { c.header(); return c.list(() => { c.header(); return c.pose(); }); },
};

// The page: a client of the same protocol that Foxglove speaks.
'use strict';

const $ = (id) => document.getElementById(id);
const kHistory = 300, kMostSteps = 20000, kMaskStays = 10, kRecent = 60;

const scene = new Scene($('scene'));
const channels = new Map();       // topic to channel
const topicOf = new Map();        // subscription to topic
const services = new Map();       // name to number
const waiting = new Map();        // topic to what came of it and is not shown yet
// Of these every message counts, of the others the newest.
const kCounted = new Set(['/tf', '/state', '/camera/annotations', '/mesh', '/mesh/classes']);
const kQuick_ms = 30, kHidden_ms = 500;
const history = {time: [], points: [], age: []};
const way = [];                   // where the camera was, in map
const kSurfaces = {points: '/cloud', mesh: '/mesh', classes: '/mesh/classes'};
const tilesOf = new Map();        // class to its tiles that are shown
let stateFrame;                   // that was told of last
let picture, pictureStamp;        // the newest image
const recent = new Map();         // what is said of the last images, by their stamps
let masks = null;                 // the newest outline, and for how many frames it is still shown
let socket, calls = 0, frames = [], token = location.hash.slice(1);

function say(text) { $('said').textContent = text; }

function connect() {
  const query = token ? `?token=${encodeURIComponent(token)}` : '';
  socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws${query}`, ['foxglove.websocket.v1']);
  socket.binaryType = 'arraybuffer';
  socket.onmessage = (event) => typeof event.data === 'string' ? hear(JSON.parse(event.data)) : take(event.data);
  socket.onclose = () => { setState('not reached: the run has ended, or its token is another', 'error'); for (const b of $('drive').children) b.disabled = true; setTimeout(connect, 2000); };
}

function hear(message) {
  if (message.op === 'advertise') {
    channels.clear();
    topicOf.clear();
    waiting.clear();
    for (const channel of message.channels) {
      if (!decoders[channel.schemaName]) continue;
      channels.set(channel.topic, channel);
      topicOf.set(channel.id, channel.topic);
    }
    way.length = 0;
    frames = [];
    setState('waiting for a frame', '');
    const choice = $('surfaces');
    for (const option of choice.options) option.disabled = option.value !== 'none' && !channels.has(kSurfaces[option.value]);
    if (choice.selectedOptions[0].disabled) choice.value = 'points';
    surfaces = choice.value;
    for (const group of Object.keys(kSurfaces)) forgetSurfaces(group);
    // Of the surfaces what is looked at alone: the others are not even made.
    const others = Object.values(kSurfaces).filter((topic) => topic !== kSurfaces[choice.value]);
    subscribe([...channels.keys()].filter((topic) => !others.includes(topic)));
  } else if (message.op === 'advertiseServices') {
    for (const service of message.services) services.set(service.name, service.id);
    for (const b of $('drive').children) { b.disabled = !token; b.title = token ? '' : 'open the address with the token that the run printed'; }
  } else if (message.op === 'serviceCallFailure' || message.op === 'status') {
    say(message.message);
  }
}

function subscribe(topics) {
  const ids = topics.filter((topic) => channels.has(topic)).map((topic) => channels.get(topic).id);
  socket.send(JSON.stringify({op: 'subscribe', subscriptions: ids.map((id) => ({id, channelId: id}))}));
}
function unsubscribe(topics) {
  const subscriptionIds = topics.filter((topic) => channels.has(topic)).map((topic) => channels.get(topic).id);
  socket.send(JSON.stringify({op: 'unsubscribe', subscriptionIds}));
}
function forgetSurfaces(group) {
  scene.removeGroup(group);
  tilesOf.clear();
  drawClasses();
}
let surfaces = $('surfaces').value;
$('surfaces').addEventListener('change', (e) => {
  const before = surfaces;
  surfaces = e.target.value;
  if (socket.readyState !== WebSocket.OPEN) return;
  if (kSurfaces[before]) unsubscribe([kSurfaces[before]]);
  forgetSurfaces(before);
  if (kSurfaces[surfaces]) subscribe([kSurfaces[surfaces]]);
});

function call(name) {
  const bytes = new Uint8Array(1 + 4 + 4 + 4 + 3 + 4), view = new DataView(bytes.buffer);
  bytes[0] = 2;
  view.setUint32(1, services.get(name), true);
  view.setUint32(5, ++calls, true);
  view.setUint32(9, 3, true);
  bytes.set(new TextEncoder().encode('cdr'), 13);
  bytes.set([0, 1, 0, 0], 16);
  socket.send(bytes);
}
for (const button of $('drive').children) button.addEventListener('click', () => { say(`${button.textContent.trim()} ...`); call(button.dataset.service); });

function take(buffer) {
  const view = new DataView(buffer);
  if (view.getUint8(0) === 3) {  // a service's answer
    const reader = new Cdr(buffer, 13 + view.getUint32(9, true));
    const done = reader.u8() !== 0;
    say((done ? '' : 'not done: ') + reader.string());
    if (done && view.getUint32(1, true) === services.get('reset')) way.length = 0;
    return;
  }
  const topic = topicOf.get(view.getUint32(1, true));
  if (view.getUint8(0) !== 1 || !topic) return;
  if (waiting.has(topic) && kCounted.has(topic)) waiting.get(topic).push(buffer); else waiting.set(topic, [buffer]);
  askToShow();
}

/// At most once for each picture of the display, and no more than half of the time: a slow browser
/// shows less, and its buttons work all the same.
let isAsked = false, tookMs = 0;
function askToShow() {
  if (isAsked) return;
  isAsked = true;
  const busyMs = tookMs + scene.tookMs;
  if (document.hidden) setTimeout(showWaiting, kHidden_ms);
  else setTimeout(() => requestAnimationFrame(showWaiting), busyMs > kQuick_ms ? busyMs : 0);
}
let isWayOld = false, arePlotsOld = false;
function showWaiting() {
  const begin = performance.now();
  isAsked = false;
  const came = [...waiting];
  waiting.clear();
  for (const [topic, buffers] of came) {
    const channel = channels.get(topic), show = shows[topic];
    if (channel && show) for (const buffer of buffers) show(decoders[channel.schemaName](new Cdr(buffer, 13)));
  }
  if (isWayOld) drawWay();
  if (arePlotsOld) drawPlots();
  isWayOld = arePlotsOld = false;
  tookMs = performance.now() - begin;
}

const shows = {
  '/tf': (of) => {
    if (!of.odom || !of.camera) return;
    const pose = composed(of.odom, of.camera);
    way.push(pose.t);
    if (way.length > kMostSteps) way.splice(0, way.length - kMostSteps);
    isWayOld = true;
    const corner = (y, z) => add(pose.t, turned(pose.q, [0.25, 0.16 * y, 0.12 * z]));
    const corners = [corner(1, 1), corner(-1, 1), corner(-1, -1), corner(1, -1)];
    const edges = corners.flatMap((c, i) => [pose.t, c, c, corners[(i + 1) % 4]]);
    scene.lines('camera', edges, colourOf('--accent'));
    if ($('follow').checked) scene.target = add(pose.t, turned(pose.q, [1.5, 0, 0]));
  },
  '/camera/image/compressed': async (image) => {
    const bitmap = await createImageBitmap(new Blob([image.data], {type: 'image/jpeg'}));
    if (picture) picture.close();
    picture = bitmap;
    pictureStamp = image.header.stamp;
    drawImage();
  },
  '/camera/annotations': (said) => {
    const outline = said.shapes.find((shape) => shape.type === 4);
    if (outline) masks = {outline, left: kMaskStays};
    recent.set(said.shapes[0].stamp, {...said, mask: masks && masks.outline});
    if (recent.size > kRecent) recent.delete(recent.keys().next().value);
    if (masks && --masks.left <= 0) masks = null;
    if (said.shapes[0].stamp === pictureStamp) drawImage();
  },
  '/objects': (markers) => {
    const boxes = markers.filter((m) => m.ns === 'objects'), edges = [];
    for (const m of boxes) {
      const corner = (i) => [0, 1, 2].map((k) => m.pose.t[k] + ((i >> k & 1) - 0.5) * m.scale[k]);
      for (let i = 0; i < 8; ++i) for (const k of [1, 2, 4]) if (!(i & k)) edges.push(corner(i), corner(i | k));
    }
    for (const m of markers) if (m.ns === 'velocities') edges.push(...triples(m.points));
    scene.lines('objects', edges, colourOf('--dynamic'));
    scene.names = markers.filter((m) => m.ns === 'names').map((m) => ({text: m.text, at: m.pose.t}));
    const rows = markers.filter((m) => m.ns === 'velocities').map((m) => {
      const name = markers.find((o) => o.ns === 'names' && o.id === m.id).text;
      const [from, to] = triples(m.points);
      const speed = Math.hypot(...sub(to, from));
      const row = document.createElement('tr');
      for (const text of [name, from.map((v) => v.toFixed(1)).join(', '), speed.toFixed(2)]) row.insertCell().textContent = text;
      return row;
    });
    document.querySelector('#objects tbody').replaceChildren(...rows);
  },
  '/state': (all) => {
    const {level, message, values} = all[0];
    setState(message, ['ok', 'warn', 'error'][level]);
    const isNew = 'frame' in values && values.frame !== stateFrame;  // paused, the last one is told again
    stateFrame = values.frame;
    if (!isNew) return;
    const number = (key) => Number(values[key]);
    const stages = ['features [ms]', 'motion check [ms]', 'pose [ms]'].map(number);
    remember('time', stages);
    remember('points', ['static points', 'dynamic points', 'unknown points'].map(number));
    remember('age', [Math.max(0, number('mask age [frames]'))]);
    $('ms').textContent = `${stages.reduce((a, b) => a + b, 0).toFixed(1)}: features ${stages[0]}, motion ${stages[1]}, pose ${stages[2]}`;
    $('points').textContent = `${values['static points']} static, ${values['dynamic points']} dynamic, ${values['unknown points']} unknown`;
    $('age').textContent = number('mask age [frames]') < 0 ? 'no mask' : values['mask age [frames]'];
    const now = performance.now();
    frames = frames.filter((t) => now - t < 2000);
    frames.push(now);
    $('rate').textContent = `frame ${values.frame}, ${(frames.length / 2).toFixed(0)} shown/s, ${values.inliers} of ${values.matches} matches`;
    arePlotsOld = true;
  },
  '/cloud': (cloud) => { if (surfaces === 'points') showCloud('points', cloud, 0.02); },
  '/mesh': (markers) => { if (surfaces === 'mesh') showTiles('mesh', markers, 0.35); },
  '/mesh/classes': (markers) => {
    if (surfaces !== 'classes') return;
    showTiles('classes', markers, 0.6);
    for (const m of markers) {
      if (!tilesOf.has(m.ns)) tilesOf.set(m.ns, {colour: m.colour, tiles: new Set()});
      const {tiles} = tilesOf.get(m.ns);
      if (m.action === 0) tiles.add(m.id); else tiles.delete(m.id);
    }
    drawClasses();
  },
  '/landmarks': (cloud) => showCloud('landmarks', cloud, 0.015),
  '/loops': (markers) => scene.lines('loops', markers.flatMap((m) => triples(m.points)), colourOf('--accent')),
  '/path': (poses) => {
    const marks = poses.flatMap((p) => [p.t, add(p.t, turned(p.q, [0.08, 0, 0]))]);
    scene.lines('path', marks, colourOf('--unknown'));
  },
};

function drawWay() { scene.set('way', 'LINE_STRIP', new Float32Array(way.flat()), repeated(colourOf('--accent'), way.length)); }
function setState(text, kind) { $('state').textContent = text; $('state').className = `state ${kind}`; }
function remember(name, values) { history[name].push(values); if (history[name].length > kHistory) history[name].shift(); }
function repeated(colour, count) { const all = new Uint8Array(3 * count); for (let i = 0; i < count; ++i) all.set(colour, 3 * i); return all; }
function colourOf(name) {
  const hex = getComputedStyle(document.documentElement).getPropertyValue(name).trim();
  return [1, 3, 5].map((i) => parseInt(hex.slice(i, i + 2), 16));
}

function triples(numbers) { return Array.from({length: numbers.length / 3}, (_, i) => Array.from(numbers.subarray(3 * i, 3 * i + 3))); }

/// Triangles of tiles of the world; those of other tiles stay.
function showTiles(group, markers, shade) {
  for (const m of markers) {
    const name = `${group} ${m.ns} ${m.id}`;
    if (m.action !== 0) { scene.remove(name); continue; }
    const count = m.points.length / 3, colours = new Uint8Array(3 * count);
    for (let i = 0; i < count; ++i)
      for (let k = 0; k < 3; ++k) colours[3 * i + k] = 255 * (m.colours.length ? m.colours[4 * i + k] : m.colour[k]);
    scene.set(name, 'TRIANGLES', Float32Array.from(m.points), colours, {shade, group});
  }
}

function drawClasses() {
  const names = [...tilesOf.keys()].filter((name) => tilesOf.get(name).tiles.size).sort((a, b) => (a === 'unknown') - (b === 'unknown') || a.localeCompare(b));
  const legend = $('classes');
  legend.hidden = !names.length;
  if (legend.dataset.names === names.join()) return;
  legend.dataset.names = names.join();
  legend.replaceChildren(...names.map((name) => {
    const entry = document.createElement('span'), dot = document.createElement('i');
    dot.className = 'dot';
    dot.style.background = `rgb(${tilesOf.get(name).colour.slice(0, 3).map((v) => Math.round(255 * v)).join(' ')})`;
    entry.append(dot, name);
    return entry;
  }));
}

function showCloud(name, cloud, size) {
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const positions = new Float32Array(3 * cloud.count), colours = new Uint8Array(3 * cloud.count);
  const coloured = cloud.fields.some((f) => f.name === 'rgb');
  const plain = colourOf('--static');
  for (let i = 0; i < cloud.count; ++i) {
    const at = i * cloud.step;
    for (let k = 0; k < 3; ++k) positions[3 * i + k] = view.getFloat32(at + 4 * k, true);
    if (coloured) {
      const rgb = view.getUint32(at + 12, true);
      colours.set([rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255], 3 * i);
    } else {
      colours.set(plain, 3 * i);
    }
  }
  scene.set(name, 'POINTS', positions, colours, {size});
}

function drawImage() {
  if (!picture) return;
  const canvas = $('image');
  if (canvas.width !== picture.width || canvas.height !== picture.height) Object.assign(canvas, {width: picture.width, height: picture.height});
  const g = canvas.getContext('2d');
  g.drawImage(picture, 0, 0);
  const said = recent.get(pictureStamp);  // of this image: those of another would lie beside things
  if (!said) return;
  const css = (c) => `rgb(${c.slice(0, 3).map((v) => Math.round(255 * v)).join(' ')})`;
  for (const shape of said.shapes) {
    if (shape.type === 1 && $('show-points').checked) {
      g.fillStyle = css(shape.colour);
      for (const p of shape.points) g.fillRect(p[0] - 2, p[1] - 2, 4, 4);
    } else if (shape.type === 2 && $('show-boxes').checked) {
      g.strokeStyle = css(shape.colour);
      g.lineWidth = 3;
      g.beginPath();
      shape.points.forEach((p, i) => i ? g.lineTo(...p) : g.moveTo(...p));
      g.closePath();
      g.stroke();
    }
  }
  if (said.mask && $('show-masks').checked) {
    g.strokeStyle = css(said.mask.colour);
    g.lineWidth = 2;
    g.beginPath();
    said.mask.points.forEach((p, i) => i % 2 ? g.lineTo(...p) : g.moveTo(...p));
    g.stroke();
  }
  if (!$('show-boxes').checked) return;
  g.font = '16px system-ui, sans-serif';
  for (const {at, text} of said.texts) {
    const y = Math.max(18, at[1]);
    g.fillStyle = '#000a';
    g.fillRect(at[0], y - 18, g.measureText(text).width + 8, 20);
    g.fillStyle = '#fff';
    g.fillText(text, at[0] + 4, y - 3);
  }
}

function drawPlots() {
  const colours = {time: ['--accent', '--static', '--unknown'], points: ['--static', '--dynamic', '--unknown'], age: ['--accent']};
  for (const name of Object.keys(colours)) {
    const canvas = $(`plot-${name}`), ratio = window.devicePixelRatio || 1;
    const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
    if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, {width, height});
    const g = canvas.getContext('2d'), rows = history[name];
    g.clearRect(0, 0, width, height);
    const top = Math.max(1, ...rows.map((row) => Math.max(...row))) * 1.1;
    const style = getComputedStyle(document.documentElement);
    g.lineWidth = 1.5 * ratio;
    colours[name].forEach((colour, k) => {
      g.strokeStyle = style.getPropertyValue(colour);
      g.beginPath();
      rows.forEach((row, i) => {
        const x = width * (1 - (rows.length - 1 - i) / (kHistory - 1)), y = height - row[k] / top * (height - 2) - 1;
        i ? g.lineTo(x, y) : g.moveTo(x, y);
      });
      g.stroke();
    });
    g.fillStyle = style.getPropertyValue('--faint');
    g.font = `${10 * ratio}px system-ui, sans-serif`;
    g.fillText(top.toFixed(0), 2, 10 * ratio);
  }
}

scene.drawn = () => {
  const shown = $('show-objects').checked ? scene.names || [] : [];
  $('names').replaceChildren(...shown.flatMap(({text, at}) => {
    const pixel = scene.pixel(at);
    if (!pixel) return [];
    const span = document.createElement('span');
    span.textContent = text;
    span.style.left = `${pixel[0]}px`;
    span.style.top = `${pixel[1]}px`;
    return [span];
  }));
};
scene.panned = () => { $('follow').checked = false; };
for (const name of ['landmarks', 'path', 'loops', 'objects'])
  $(`show-${name}`).addEventListener('change', (e) => scene.show(name, e.target.checked));
for (const name of ['points', 'boxes', 'masks']) $(`show-${name}`).addEventListener('change', drawImage);
$('from-above').addEventListener('click', () => { scene.pitch = 1.54; scene.ask(); });

addEventListener('hashchange', () => location.reload());  // another run's token

if (!scene.gl) say('this browser has no WebGL2: the map is not drawn');
connect();

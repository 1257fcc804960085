// The page: a client of the same protocol that Foxglove speaks.
'use strict';

const scene = new Scene($('scene'));
const surroundings = new Surroundings(scene);
const image = new ImagePane($('image'));
const record = new RunRecord();
const drive = new Drive(call, record);
const channels = new Map();       // topic to channel
const topicOf = new Map();        // subscription to topic
const services = new Map();       // name to number
const waiting = new Map();        // topic to what came of it and is not shown yet
// Of these every message counts, of the others the newest.
const kCounted = new Set(['/tf', '/state', '/camera/annotations', '/mesh', '/mesh/classes']);
const kQuick_ms = 30, kHidden_ms = 500, kRetry_ms = 2000, kSettles_ms = 400, kMostPoses = 60;
const kSurfaces = {points: '/cloud', mesh: '/mesh', classes: '/mesh/classes'};
const tilesOf = new Map();        // class to its tiles that are shown
const poses = new Map();          // of the last frames, by their stamps
let boxes = [];                   // the newest of /objects
let socket, calls = 0, frames = [], token = location.hash.slice(1);

function connect() {
  const query = token ? `?token=${encodeURIComponent(token)}` : '';
  socket = new WebSocket(`${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/ws${query}`, ['foxglove.websocket.v1']);
  socket.binaryType = 'arraybuffer';
  socket.onmessage = (event) => typeof event.data === 'string' ? hear(JSON.parse(event.data)) : take(event.data);
  socket.onclose = () => {
    setState('not reached: the run has ended, or its token is another', 'error');
    drive.refuseAll('not connected');
    setTimeout(connect, kRetry_ms);
  };
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
    frames = [];
    record.forget();
    image.forget();
    setState('waiting for a frame', '');
    const choice = $('surfaces');
    for (const option of choice.options) option.disabled = option.value !== 'none' && !channels.has(kSurfaces[option.value]);
    if (choice.selectedOptions[0].disabled) choice.value = 'points';
    surfaces = choice.value;
    for (const group of Object.keys(kSurfaces)) forgetSurfaces(group);
    // Of the surfaces what is looked at alone: the others are not even made.
    const unseen = Object.values(kSurfaces).filter((topic) => topic !== kSurfaces[choice.value]);
    if (!$('show-landmarks').checked) unseen.push('/landmarks');
    subscribe([...channels.keys()].filter((topic) => !unseen.includes(topic)));
  } else if (message.op === 'advertiseServices') {
    for (const service of message.services) services.set(service.name, service.id);
  } else if (message.op === 'serviceCallFailure' || message.op === 'status') {
    say(message.message);
  }
}

function subscribe(topics) {
  if (socket.readyState !== WebSocket.OPEN) return;
  const ids = topics.filter((topic) => channels.has(topic)).map((topic) => channels.get(topic).id);
  socket.send(JSON.stringify({op: 'subscribe', subscriptions: ids.map((id) => ({id, channelId: id}))}));
}
function unsubscribe(topics) {
  if (socket.readyState !== WebSocket.OPEN) return;
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

function take(buffer) {
  const view = new DataView(buffer);
  if (view.getUint8(0) === 3) {  // a service's answer
    const reader = new Cdr(buffer, 13 + view.getUint32(9, true));
    const done = reader.u8() !== 0;
    say((done ? '' : 'not done: ') + reader.string());
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
function showWaiting() {
  const begin = performance.now();
  isAsked = false;
  const came = [...waiting];
  waiting.clear();
  for (const [topic, buffers] of came) {
    const channel = channels.get(topic), show = shows[topic];
    if (channel && show) for (const buffer of buffers) show(decoders[channel.schemaName](new Cdr(buffer, 13)));
  }
  if (record.isOld) showRecord();
  tookMs = performance.now() - begin;
}

/// Path, camera and curves, as of now or of the moment looked at.
function showRecord() {
  record.draw();
  surroundings.drawPath(record.entries, record.cursor);
  const isPast = record.cursor !== null, pose = isPast ? record.entry.pose : [...poses.values()].at(-1) ?? record.entry?.pose;
  if (pose) surroundings.drawCamera(pose);
  scene.show('objects', !isPast && $('show-objects').checked);  // they are those of now
  settleSoon();
}
record.looked = () => { image.look(record.cursor === null ? undefined : record.entry.t); showRecord(); };

let settles;
function settleSoon() {
  settles ??= setTimeout(() => { settles = undefined; scene.covered = [34, $('layers').offsetHeight + 8]; surroundings.settle($('follow').checked, $('show-ceiling').checked); }, kSettles_ms);
}

const shows = {
  '/tf': (of) => {
    const pose = of.odom && of.camera ? composed(of.odom, of.camera) : null;
    poses.set(of.stamp, pose);
    if (poses.size > kMostPoses) poses.delete(poses.keys().next().value);
  },
  '/floor': (of) => { if (of.floor) { surroundings.setFloor(of.floor); surroundings.drawBoxes(boxes); settleSoon(); } },
  '/camera/image/compressed': (picture) => image.add(picture.header.stamp, picture.data),
  '/camera/annotations': (said) => image.tell(said),
  '/objects': (markers) => {
    boxes = markers;
    surroundings.drawBoxes(boxes);
    const rows = markers.filter((m) => m.ns === 'velocities').map((m) => {
      const name = markers.find((o) => o.ns === 'names' && o.id === m.id).text;
      const [from, to] = triples(m.points);
      const speed = Math.hypot(...sub(to, from)), eye = [...poses.values()].at(-1)?.t;
      const away = eye ? Math.hypot(...sub(from, eye)).toFixed(1) : '';
      const row = document.createElement('tr');
      for (const text of [name, away, from.map((v) => v.toFixed(1)).join(', '), speed.toFixed(2)]) row.insertCell().textContent = text;
      return row;
    });
    document.querySelector('#objects tbody').replaceChildren(...rows);
    $('objects').hidden = !rows.length;
  },
  '/state': (all) => {
    const {stamp, level, message, values} = all[0], driven = all.find((s) => s.name === 'ygslam: drive');
    setState(message, ['ok', 'warn', 'error'][level]);
    if (driven) drive.tell(driven.values, (service) => token ? driven.values[service] ?? '' : 'open the address with the token that the run printed');
    if (!('frame' in values)) return;
    const number = (key) => Number(values[key]);
    if (!record.entries.length || number('frame') > record.entries.at(-1).frame) {  // paused, the last one is told again
      record.add({
        t: stamp, frame: number('frame'), pose: poses.get(stamp) ?? null, lost: level === 2, unsure: level === 1, age: number('mask age [frames]'),
        stages: ['features [ms]', 'motion check [ms]', 'pose [ms]'].map(number),
        points: ['static points', 'dynamic points', 'unknown points'].map(number),
      });
      const now = performance.now();
      frames = frames.filter((t) => now - t < 2000);
      frames.push(now);
    }
    // Where a map begins its points match nothing yet.
    const fit = !number('inliers') ? '' : number('inliers') > number('matches') ? `${values.inliers} points begin a map` : `${values.inliers} of ${values.matches} matches`;
    const missed = number('missed frames') ? `${values['missed frames']} frames missed` : '';
    $('rate').textContent = [`frame ${values.frame}`, frames.length > 1 ? `${(frames.length / 2).toFixed(0)}/s` : '', missed, fit].filter(Boolean).join(' \u00b7 ');
  },
  '/history': (cloud) => record.load(rowsOf(cloud).map((r) => ({
    t: r.t, frame: r.frame, pose: r.tracked ? {t: [r.x, r.y, r.z], q: [r.qx, r.qy, r.qz, r.qw]} : null, lost: !r.tracked, unsure: r.tracked > 0 && r.tracked < 1,
    stages: [r.features_ms, r.motion_ms, r.pose_ms], points: [r.static, r.dynamic, r.unknown], age: r.mask_age,
  }))),
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
  '/landmarks': (cloud) => { if ($('show-landmarks').checked) showCloud('landmarks', cloud, 0.01); },
  '/loops': (markers) => scene.lines('loops', markers.flatMap((m) => triples(m.points)), [...colourOf('--accent'), 160]),
  '/path': (keyframes) => {
    const marks = keyframes.flatMap((p) => [p.t, add(p.t, turned(p.q, [0.08, 0, 0]))]);
    scene.lines('path', marks, colourOf('--unknown'), {width: 1.5});
  },
};

function setState(text, kind) {
  const s = $('state');
  s.textContent = s.title = text;
  s.className = `state ${kind}`;
  document.title = `${text} \u00b7 YG-SLAM`;
}

/// Triangles of tiles of the world; those of other tiles stay.
function showTiles(group, markers, shade) {
  for (const m of markers) {
    const name = `${group} ${m.ns} ${m.id}`;
    if (m.action !== 0) { scene.remove(name); continue; }
    const count = m.points.length / 3, tints = new Uint8Array(3 * count);
    for (let i = 0; i < count; ++i)
      for (let k = 0; k < 3; ++k) tints[3 * i + k] = 255 * (m.colours.length ? m.colours[4 * i + k] : m.colour[k]);
    scene.set(name, 'TRIANGLES', Float32Array.from(m.points), tints, {shade, group, framed: true});
  }
  settleSoon();
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
    dot.style.background = css(tilesOf.get(name).colour);
    entry.append(dot, name);
    return entry;
  }));
}

/// The fields of each point by their names. Of those that are no float the type tells.
function rowsOf(cloud) {
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const read = {6: 'getUint32', 7: 'getFloat32', 8: 'getFloat64'};
  return Array.from({length: cloud.count}, (_, i) => Object.fromEntries(
    cloud.fields.map((f) => [f.name, view[read[f.type]](i * cloud.step + f.offset, true)])));
}
function showCloud(name, cloud, size) {
  const view = new DataView(cloud.data.buffer, cloud.data.byteOffset, cloud.data.byteLength);
  const positions = new Float32Array(3 * cloud.count), tints = new Uint8Array(3 * cloud.count);
  const coloured = cloud.fields.some((f) => f.name === 'rgb');
  const plain = colourOf('--static');
  for (let i = 0; i < cloud.count; ++i) {
    const at = i * cloud.step;
    for (let k = 0; k < 3; ++k) positions[3 * i + k] = view.getFloat32(at + 4 * k, true);
    if (coloured) {
      const rgb = view.getUint32(at + 12, true);
      tints.set([rgb >> 16 & 255, rgb >> 8 & 255, rgb & 255], 3 * i);
    } else {
      tints.set(plain, 3 * i);
    }
  }
  scene.set(name, 'POINTS', positions, tints, {size, framed: coloured});
  settleSoon();
}

scene.moved = () => { $('follow').checked = false; };
scene.turned = settleSoon;
for (const name of ['path', 'loops', 'objects'])
  $(`show-${name}`).addEventListener('change', (e) => scene.show(name, e.target.checked));
$('show-landmarks').addEventListener('change', (e) => {
  if (e.target.checked) subscribe(['/landmarks']); else { unsubscribe(['/landmarks']); scene.remove('landmarks'); }
});
for (const name of ['points', 'boxes', 'masks']) $(`show-${name}`).addEventListener('change', () => image.draw());
for (const id of ['follow', 'show-ceiling']) $(id).addEventListener('change', settleSoon);
$('from-above').addEventListener('click', () => {
  const isAbove = scene.pitch > 1.5;
  scene.pitch = isAbove ? 0.7 : 1.54;
  $('from-above').textContent = isAbove ? 'From above' : 'At an angle';
  settleSoon();
  scene.ask();
});
isDark.addEventListener('change', () => { surroundings.drawBoxes(boxes); showRecord(); });

addEventListener('hashchange', () => location.reload());  // another run's token

if (!scene.gl) say('this browser has no WebGL2: the map is not drawn');
connect();

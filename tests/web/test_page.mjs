// The page without a browser: its classes on a document of the test's own. What keys, stick, gamepad and sliders ask for, by sign
// and size; that it reads WebView (core.h) in its order; that each number appears at its own foot. Usage: node test_page.mjs ROOT
import assert from 'node:assert/strict';
import fs from 'node:fs';

const root = process.argv[2];

// ---- a document ----

class Element {
  constructor(id) {
    Object.assign(this, { id, style: {}, handlers: {}, children: [], value: '0', textContent: '', drawn: [], width: 440, height: 480 });
    this.classList = { add() {}, remove() {}, toggle() {} };
  }

  get firstElementChild() { return this.children[0] ??= new Element(); }
  addEventListener(what, act) { this.handlers[what] = act; }
  append(...more) { this.children.push(...more); }
  prepend(first) { this.children.unshift(first); }
  replaceChildren(...all) { this.children = all; }
  setAttribute() {}
  setPointerCapture() {}
  focus() {}
  getBoundingClientRect() { return { left: 100, top: 200, width: 80, height: 80 }; }
  getContext() { // of a canvas: what is filled and stroked
    const shape = {}, drawn = this.drawn;
    return {
      canvas: this, clearRect() { drawn.length = 0; }, beginPath() {},
      roundRect(x, y, w, h) { Object.assign(shape, { what: 'element', x: x + w / 2, y: y + h / 2 }); },
      arc(x, y) { Object.assign(shape, { what: 'center', x, y }); },
      fill() { drawn.push({ ...shape, color: this.fillStyle }); }, stroke() { drawn.push({ ...shape }); },
    };
  }
}

const elements = new Map(), handlers = {};
const $ = (id) => elements.get(id) ?? elements.set(id, new Element(id)).get(id);
let pads = [];
Object.defineProperty(globalThis, 'navigator', { value: { getGamepads: () => pads }, configurable: true });
Object.assign(globalThis, {
  document: { getElementById: $, createElement: () => new Element() }, location: { search: '' },
  addEventListener: (what, act) => { (handlers[what] ??= []).push(act); },
});

const source = fs.readFileSync(`${root}/web/mild.js`, 'utf8').replace(/^import .*$/m, '').replace(/^main\(\)\.catch[\s\S]*$/m, '');
const { Core, Driver, Panel, App, ENDS, ROBOTS } = await import(`data:text/javascript,${encodeURIComponent(`${source}\nexport { Core, Driver, Panel, App, ENDS, ROBOTS };`)}`);

// ---- what a hand does: [forward, left, turn to the left] ----

const key = (what, code) => handlers[what].forEach((act) => act({ code, key: code, target: {}, preventDefault() {} }));
const near = (found, wanted, what) => found.forEach((x, i) => assert.ok(Math.abs(x - wanted[i]) < 1e-5, `${what}: ${found} and not ${wanted}`));
const driver = new Driver();
const pace = 0.55; // of a key without Shift
for (const [codes, asks] of [
  [['KeyW'], [pace, 0, 0]], [['ArrowUp'], [pace, 0, 0]], [['KeyS'], [-pace, 0, 0]], [['ArrowDown'], [-pace, 0, 0]],
  [['KeyQ'], [0, 1, 0]], [['KeyE'], [0, -1, 0]], [['KeyA'], [0, 0, 1]], [['ArrowLeft'], [0, 0, 1]], [['KeyD'], [0, 0, -1]],
  [['ArrowRight'], [0, 0, -1]], [['KeyW', 'ShiftLeft'], [1, 0, 0]], [['KeyS', 'ShiftRight'], [-1, 0, 0]], [['KeyW', 'KeyD'], [pace, 0, -1]],
]) {
  codes.forEach((code) => key('keydown', code));
  near(driver.ask(), asks, codes);
  codes.forEach((code) => key('keyup', code));
  near(driver.ask(), [0, 0, 0], `${codes} let go`);
}

const touch = (what, x, y) => $('stick').handlers[what]({ clientX: 140 + x, clientY: 240 + y, pointerId: 1, pressure: 1, buttons: 1 });
for (const [x, y, asks] of [[40, 0, [0, 0, -1]], [-40, 0, [0, 0, 1]], [0, -40, [1, 0, 0]], [0, 20, [-0.5, 0, 0]], [400, 0, [0, 0, -1]]]) {
  touch('pointerdown', x, y);
  near(driver.ask(), asks, `stick at ${x} right, ${y} down`);
  const knob = $('stick').firstElementChild.style.transform.match(/-?[\d.e-]+(?=px)/g).map(Number), reach = Math.max(40, Math.hypot(x, y));
  near(knob, [(40 * x) / reach, (40 * y) / reach], 'the knob is under the finger');
  touch('pointerup', x, y);
  near(driver.ask(), [0, 0, 0], 'stick let go');
}
for (const [axes, asks] of [[[0, -1, 0], [1, 0, 0]], [[-1, 0, 0], [0, 1, 0]], [[0, 0, -1], [0, 0, 1]], [[0.1, 0.1, 0.1], [0, 0, 0]]]) {
  pads = [null, { axes, buttons: [{ pressed: false }] }];
  near(driver.ask(), asks, `gamepad ${axes}`);
}
pads = [{ axes: [], buttons: [{ pressed: true }] }];
assert.ok(!driver.again && driver.ask() && driver.again);
pads = [];

// The command: its largest numbers and their rates [m/s, m/s, rad/s], and a heading that is held.
const steps = (count, wanted, yaw) => { driver.wanted = wanted; let last; for (let i = 0; i < count; i++) last = driver.next(yaw); return last; };
near(steps(1, [1, 1, 1], 0), [0.011, 0.009, 0.03, 0], 'a first step');
near(steps(400, [1, 1, 1], 0), [1.15, 0.35, 1, 0], 'in the end');
near(steps(400, [-1, -1, -1], 0), [-0.9, -0.35, -1, 0], 'and backwards');
near(steps(400, [1, 0, 0], 0.3), [1.15, 0, 0, 0], 'straight');
near(driver.next(0.4), [1.15, 0, -0.12, 0], 'too far to the left: back to the right');
near(driver.next(0.3 + 2 * Math.PI - 0.1), [1.15, 0, 0.12, 0], 'and the other way round');

// Every command of a robot that jumps is a jump, of a stance and a free flight: Space and the stick's middle in place; what is let go ends.
const jumper = ROBOTS.find(({ rises }) => rises), [high, low] = jumper.rises, flight = (rise) => 2 * Math.sqrt((2 * rise) / 9.81);
const stance = Number(fs.readFileSync(`${root}/configs/g1_jump.ini`, 'utf8').match(/^jump_stance = (\S+)/m)[1]);
const untilItStands = () => { let count = 0; while (driver.next(0)[3] && count < 1e4) count++; return count; };
key('keydown', 'Space');
assert.equal(driver.next(0)[3], 0, 'nobody else jumps');
key('keyup', 'Space');
Object.assign(driver, { most: jumper.most, rises: jumper.rises, command: [0, 0, 0], heading: null, touched: false });
near(steps(1, [0, 0, 0], 0), [0, 0, 0, 0], 'it stands');
for (const ask of [() => key('keydown', 'Space'), () => touch('pointerdown', 0, 0)]) {
  ask();
  near(driver.next(0), [0, 0, 0, high], 'in place');
  assert.equal(untilItStands(), Math.ceil((stance + flight(high)) / 0.01) - 1);
  assert.ok(driver.touched);
}
near(steps(Math.ceil((3 * (stance + flight(low))) / 0.01), [1, 0, 0], 0), [jumper.most[0], 0, 0, low], 'three forward');
driver.wanted = [0, 0, 0];
assert.equal(untilItStands(), 0, 'are three whole ones');
near(driver.next(0), [0, 0, 0, 0], 'and then it stands');
Object.assign(driver, { most: ROBOTS[0].most, rises: undefined, heading: null });

// ---- what is read from the core ----

// The fields of WebView in the order of core.h, in words.
const header = fs.readFileSync(`${root}/web/core.h`, 'utf8'), sizes = { ENGINE_LINKS_MAX: 41, ROBOT_FEET_MAX: 4, WEB_ELEMENTS_MAX: 128, WEB_DIRTY_MAX: 64, WebDirty: 4 };
const fields = new Map();
let words = 0;
for (const [, type, name, array] of header.match(/typedef struct \{([^}]*)\} WebView;/)[1].matchAll(/(\w+) (\w+)((?:\[\w+\])*);/g)) {
  fields.set(name, words);
  words += [...array.matchAll(/\w+/g)].reduce((product, [size]) => product * (sizes[size] ?? Number(size)), sizes[type] ?? 1);
}
const memory = new ArrayBuffer(4 * words), numbers = new Float32Array(memory), whole = new Int32Array(memory);
numbers.forEach((_, i) => { numbers[i] = i; });
for (const name of ['links', 'feet', 'elements', 'knows', 'dirty_count', 'dirty']) whole[fields.get(name)] = fields.get(name);
whole[0] = 4 * words;
const core = Object.assign(Object.create(Core.prototype), { c: { memory: { buffer: memory }, web_view: () => 0 } });
const seen = core.view();
for (const [name, at] of fields) {
  const found = seen[name.replace(/_(.)/g, (_, letter) => letter.toUpperCase())];
  if (name !== 'bytes') assert.equal(found[0] ?? found, at, `${name} of WebView`);
}

// A sentence for each end of a trial, in the order of TaskEnd.
const ends = [...fs.readFileSync(`${root}/src/env/task/state.h`, 'utf8').match(/#define TASK_ENDS[\s\S]*?\n#define/)[0].matchAll(/X\((\w+),/g)].map((end) => end[1]);
assert.equal(ENDS.length, ends.length, 'ends of a trial');
for (const [end, word] of [['time', /^$/], ['tilt', /leans/], ['base', /body/], ['shell', /leg/], ['joint', /joint/]]) assert.match(ENDS[ends.indexOf(end)], word);
near(seen.load, [0, 1, 2, 3].map((f) => fields.get('load') + f), 'load');

// ---- what is shown ----

const changed = [], stepped = [], started = [];
Object.assign(core, { names: ['sand_loose', 'rigid'], c: { ...core.c, web_change: (...all) => changed.push(all), web_step: (...all) => { stepped.push(all); } } });
const app = Object.assign(Object.create(App.prototype), { core, ground: 0, shape: 0, driver, before: new Float32Array(12 * 41), steps: 0, time: 0, robot: 0 });
const panel = app.panel = new Panel(app);
assert.deepEqual(changed, [[1, 1]]);
$('stiffness').value = '0.5';
$('friction').value = '-1';
$('friction').handlers.input();
assert.deepEqual(changed[1], [2, 0.2], 'the sliders: stiffness, friction');
assert.deepEqual([$('stiffness-value').textContent, $('friction-value').textContent], ['× 2.00', '× 0.20']);

// Two elements of each foot: one in front and to the left of its middle, one behind and to the right; only the former presses.
const view = { feet: 2, knows: 1, cell: 0.01, elements: 2, pitch: 0.02, load: [300, 25, 4, 5], depth: [0.012, 0.003, 0.004, 0.005],
  center: [0.05, 0.01, 0.05, 0.01, 0.05, 0.01, 0.05, 0.01], x: new Float32Array(512), y: new Float32Array(512), pressure: new Float32Array(512),
  velocity: [0.5, -0.1, 0.2], yaw: 0, shellLoad: 0, link: new Float32Array(12 * 41) };
core.view = () => view;
panel.entered();
const loads = () => $('loads').children.map((load) => load.textContent);
for (const f of [0, 1, 2, 3]) [view.x[128 * f], view.y[128 * f], view.x[128 * f + 1], view.y[128 * f + 1]] = [0.05, 0.01, -0.05, -0.02];
view.pressure[0] = 4e4;
view.pressure[128] = 1e3;
panel.drawSoles(view);
assert.deepEqual(loads(), ['300 N · 12 mm', '25 N · 3 mm']);
assert.equal($('shells').textContent, '');
panel.drawSoles({ ...view, shellLoad: 41.6 });
assert.equal($('shells').textContent, 'legs and body 42 N');
const [front, back, center, front2, back2, center2] = $('soles').drawn;
assert.ok([front, back, center].every((at) => at.x < 220) && [front2, back2, center2].every((at) => at.x > 220), 'the left foot is on the left');
for (const [a, b, c] of [[front, back, center], [front2, back2, center2]]) {
  assert.ok(a.x < b.x && a.y < b.y, 'left is to the left, front above');
  near([a.x - c.x, a.y - c.y], [0, 0], 'the centre of pressure lies on the only element that presses');
}
const light = ({ color }) => color.match(/\d+/g).reduce((sum, n) => sum + Number(n), 0);
assert.ok(front.color !== front2.color && back.color === back2.color && light(front) !== light(front2), 'each foot has its own pressures');
const known = [9, 12, 16, 210, 380, 700, 90, 150, 230, 0.4, 0.6, 0.9, 20, 300, 900];
panel.drawKnowledge({ ...view, footsteps: 4, alarms: 2, known: Float32Array.from(known) });
assert.deepEqual($('knows').textContent.split('\n'), ['sinks at rest 12 mm (9.0 to 16)', 'k_pen 380 N/m (210 to 700)', 'sigma 150 kN/m³ (90 to 230)',
  'friction 0.60 (0.40 to 0.90)', 'slip length 300 mm (20 to 900)', '4 steps on it; it changed 2 times']);
panel.drawKnowledge({ ...view, footsteps: 0, alarms: 0, known: new Float32Array(15) });
assert.match($('knows').textContent, /not felt/);
panel.drawKnowledge({ ...view, knows: 0, footsteps: 0 });
assert.match($('knows').textContent, /Nobody has taught the SA01/);
app.ground = 1;
panel.drawSoles(view);
assert.equal(loads()[1], '25 N · rigid');
panel.drawSpeed(view, [-0.65, 0.1, 0.2], 1, 1e3);
assert.equal($('numbers').innerHTML, '<b>0.50</b> m/s · -0.65 asked');
near([parseFloat($('asked').style.left), parseFloat($('measured').style.left), parseFloat($('measured').style.width)], [25, 50, 50 * 0.5 / 1.3], 'speeds on their scale');

// A step hands the command over as web_step takes it: forward, left, turn, rise.
Object.assign(driver, { command: [0, 0, 0], heading: null, wanted: [1, -1, 1] });
app.step();
near(stepped[0], [0.011, -0.009, 0.03, 0], 'web_step');
app.core.start = (...all) => started.push(all);
Object.assign(app, { picture: { setHills() {} }, camera: {} });
Object.assign(core, { hills: () => 0 });
app.choose(1, 2);
assert.deepEqual(started, [[1, 2]], 'ground, shape');

// A soil's file goes to the core as bytes with a 0; what is wrong is said under the file's name.
const heap = { buffer: new ArrayBuffer(1 << 17) }, soilBytes = new Uint8Array(heap.buffer), said = [];
const putText = (text, at) => new TextEncoder().encodeInto(`${text}\0`, soilBytes.subarray(at));
const soils = Object.assign(Object.create(Core.prototype), { c: { memory: heap, web_text: () => 100, web_soil: () => soils.answer }, answer: 0 });
soilBytes.fill(1);
soils.soil('mars.ini', '[ground]');
assert.deepEqual([...soilBytes.subarray(100, 109)], [...new TextEncoder().encode('[ground]\0')]);
putText("soil.ini:2: unknown key 'x'", 9e4);
soils.answer = 9e4;
assert.throws(() => soils.soil('mars.ini', 'x'), { message: "mars.ini:2: unknown key 'x'" });
assert.throws(() => soils.soil('mars.ini', ' '.repeat(65536)), /mars.ini: is no soil/);
assert.throws(() => soils.soil('mars.ini', '\0'), /mars.ini: is no soil/);
core.soil = (...all) => soils.soil(...all);
app.panel.say = (text) => said.push(text);
await app.takeSoil({ name: 'mars.ini', text: async () => 'x' });
assert.deepEqual([said, started.length], [["mars.ini:2: unknown key 'x'"], 1], 'a soil that is none changes nothing');
soils.answer = 0;
await app.takeSoil({ name: 'mars.ini', text: async () => '[ground]' });
assert.deepEqual([said[1], started[1]], ['mars.ini', [3, 2]], 'the own soil is the ground');

// Another robot comes when somebody asks for it: once from the server, and the last one asked for, not the last that arrives.
const fetched = [], opened = [], arrive = {}, pictures = [];
globalThis.fetch = (file) => new Promise((done) => { fetched.push(file); arrive[file] = (ok) => done({ ok, status: 404, arrayBuffer: async () => new ArrayBuffer(8) }); });
const fourFeet = { ...view, feet: 4, knows: 0 };
const later = () => new Promise((done) => setTimeout(done));
Object.assign(core, {
  robots: new Map([['sa01', [16, 8]]]), readParts() {}, check(wrong) { assert.equal(wrong, 0); },
  c: { ...core.c, memory: { buffer: new ArrayBuffer(1 << 12) }, malloc: () => 100, web_open: (...all) => { opened.push(all); return 0; } },
});
Object.assign(app.picture, { setRobot: (...all) => pictures.push(all) });
app.ground = 0;
const g1 = app.takeRobot(1);
core.view = () => fourFeet;
const go1 = app.takeRobot(2);
assert.deepEqual([fetched, app.robot, opened.length], [['g1.bin', 'go1.bin'], 0, 0], 'the first walks on until another is here');
arrive['go1.bin'](true);
await go1;
arrive['g1.bin'](true);
await g1;
await later();
assert.deepEqual([app.robot, opened, pictures.length, driver.most], [2, [[112, 8]], 1, ROBOTS[2].most], 'the last one asked for');
panel.drawSoles(fourFeet);
const [at, , , right, , , rear] = $('soles').drawn;
assert.ok(at.x < right.x && at.y === right.y && rear.y > at.y && rear.x === at.x, 'front left, front right, rear left');
assert.deepEqual([loads(), $('end').textContent], [['300 N · 12 mm', '25 N · 3 mm', '4 N · 4 mm', '5 N · 5 mm'], 120]);
await app.takeRobot(1);
assert.deepEqual([app.robot, fetched.length, opened[1]], [1, 2, [112, 8]], 'what is here is not fetched again');
core.robots.delete('g1');
const lost = app.takeRobot(1);
arrive['g1.bin'](false);
await lost;
assert.deepEqual([app.robot, said.at(-1)], [1, 'G1: g1.bin: 404']);

// What a robot is asked lies within what its policy was trained for.
for (const { file, most, rises = [] } of ROBOTS) {
  const config = fs.readFileSync(`${root}/configs/${file === 'sa01' ? 'walk' : file}.ini`, 'utf8');
  const range = (name) => (config.match(new RegExp(`^${name} = (\\S+) (\\S+)`, 'm')) ?? [0, 0, 0]).slice(1).map(Number);
  const [vx, back, vy, wz, jump] = ['vx', 'backward_vx', 'vy', 'wz', 'jump'].map(range);
  assert.ok(most[0] <= vx[1] && most[1] <= -Math.min(vx[0], back[0]) && most[2] <= vy[1] && most[3] <= wz[1], `${file}: ${most}`);
  assert.ok(rises.every((rise) => rise >= jump[0] && rise <= jump[1]), `${file}: ${rises}`);
}
console.log(`page: robots, keys, stick, gamepad; ${fields.size} fields of WebView; soles and speeds`);

// The page: it loads the core (core.c as mild.wasm) and a robot, steps them in real time, and shows what they do. The other robots come
// when somebody asks for them.
import { Picture } from './draw.js';

const PERIOD = 0.01; // [s] policy step
const BEHIND = 1.5; // [s] the most that is made good after a pause
const TICK = 20; // [ms] between steps where drawing takes longer
const STRIPE = 2.4; // [m] WEB_STRIPE
const LEVEL = 0;
const JUMP_STANCE = 0.6, GRAVITY = 9.81; // [s, m/s^2] of a jump's clock: docs/task.md, section 7

// The robots: the file, the name; what it is asked at most, within what its policy was trained for: forward, backward, aside [m/s], turn
// [rad/s]; the end of the pressures' scale [Pa]; how far away the camera is, and how far below the base it looks [m]. Where it jumps: the
// rise [m] in place and under way.
const ROBOTS = [
  { file: 'sa01', name: 'SA01', most: [1.15, 0.9, 0.35, 1.0], pressure: 40e3, away: 3, below: 0.33 },
  { file: 'g1', name: 'G1', most: [0.9, 0.4, 0.2, 0.8], pressure: 80e3, away: 3.4, below: 0.15 },
  { file: 'go1', name: 'Go1', most: [1.0, 0.4, 0.2, 0.8], pressure: 120e3, away: 2.2, below: 0.11 },
  { file: 'g1_run', name: 'running G1', most: [3.0, 0.4, 0.2, 0.8], pressure: 120e3, away: 4.4, below: 0.15 },
  { file: 'g1_jump', name: 'jumping G1', most: [0.7, 0.2, 0.1, 0.5], pressure: 120e3, away: 4.4, below: 0.15, rises: [0.4, 0.2] },
];

// What a ground is called, and its colour as drawn.
const GROUNDS = {
  rubber: ['Rubber', [0.25, 0.29, 0.34]],
  foam60: ['Foam, firm', [0.50, 0.61, 0.71]],
  foam45: ['Foam, medium', [0.86, 0.81, 0.69]],
  foam28: ['Foam, soft', [0.83, 0.62, 0.56]],
  foam25: ['Foam, very soft', [0.72, 0.64, 0.79]],
  grass: ['Grass', [0.36, 0.43, 0.23]],
  sand_loose: ['Sand, loose', [0.86, 0.72, 0.56]],
  sand_dense: ['Sand, dense', [0.74, 0.58, 0.43]],
  rigid: ['Rigid floor', [0.69, 0.70, 0.69]],
};
const OWN = [0.71, 0.48, 0.36]; // colour of a soil of one's own
const SHAPES = ['Level', 'Waves', 'Rough'];

const $ = (id) => document.getElementById(id);
const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
const wrap = (a) => a - 2 * Math.PI * Math.round(a / (2 * Math.PI));
const options = new URLSearchParams(location.search);
// A number of the address below `count`, or another where it names none.
const choice = (key, count, otherwise) => {
  const number = options.has(key) ? Number(options.get(key)) : otherwise;
  return Number.isInteger(number) && number >= 0 && number < count ? number : otherwise;
};

const FIRST = Math.max(0, ROBOTS.findIndex(({ file }) => file === options.get('robot'))); // `?robot=go1`

// Why a trial ends: TaskEnd.
const ENDS = ['', 'It is no longer finite', 'It leans too far', 'Its body touches the ground', 'A leg touches the ground', 'Its feet cross',
  'A joint broke out'];

// What the robot knows of its ground: BeliefParameter. Low to high: 90 %.
const KNOWN = [['sinks at rest', ' mm'], ['k_pen', ' N/m'], ['sigma', ' kN/m³'], ['friction', ''], ['slip length', ' mm']];

// ---- the core ----

async function bytesOf(file) {
  const answer = await fetch(file);
  if (!answer.ok) throw new Error(`${file}: ${answer.status}`);
  return answer.arrayBuffer();
}

class Core {
  static async load(robot) {
    const nothing = new Proxy({}, { get: () => () => 0 });
    const [wasm, bytes] = await Promise.all([bytesOf('mild.wasm'), bytesOf(`${robot}.bin`)]);
    const { instance } = await WebAssembly.instantiate(wasm, { env: nothing, wasi_snapshot_preview1: nothing });
    const core = new Core(instance.exports);
    core.keep(robot, bytes);
    core.open(robot);
    return core;
  }

  constructor(exports) {
    this.c = exports;
    this.robots = new Map(); // what web_open takes
    if (exports._initialize) exports._initialize();
    const paper = Object.keys(GROUNDS).length - 1; // WEB_PRESETS of core.h
    this.names = Array.from({ length: paper }, (_, i) => this.text(exports.mild_material_preset_name(i))).concat('rigid');
  }

  keep(robot, bytes) {
    const at = (this.c.malloc(bytes.byteLength + 16) + 15) & ~15;
    new Uint8Array(this.c.memory.buffer).set(new Uint8Array(bytes), at);
    this.robots.set(robot, [at, bytes.byteLength]);
  }

  // Until a robot's file is here; at once where it is.
  async need(robot) {
    if (!this.robots.has(robot)) this.keep(robot, await bytesOf(`${robot}.bin`));
  }

  open(robot) {
    this.check(this.c.web_open(...this.robots.get(robot)));
    this.readParts();
  }

  text(at) {
    const bytes = new Uint8Array(this.c.memory.buffer);
    return String.fromCharCode(...bytes.subarray(at, bytes.indexOf(0, at)));
  }

  check(message) {
    if (message) throw new Error(this.text(message));
  }

  floats(at, count) { return new Float32Array(this.c.memory.buffer, at, count); }
  ints(at, count) { return new Int32Array(this.c.memory.buffer, at, count); }

  readParts() { // WebGeom
    const at = this.c.web_picture(), words = 22;
    this.parts = Array.from({ length: this.ints(at, 1)[0] }, (_, i) => {
      const [shape, link] = this.ints(at + 4 + 4 * words * i, 2), f = this.floats(at + 12 + 4 * words * i, words - 2);
      return {
        shape, link, size: [...f.subarray(0, 3)], position: [...f.subarray(3, 6)], rotation: [...f.subarray(6, 15)],
        color: [...f.subarray(15, 18)], shine: f[18], glow: f[19],
      };
    });
  }

  // WebView, word by word.
  view() {
    const start = this.c.web_view();
    let at = start;
    const take = (count) => { at += 4 * count; return this.floats(at - 4 * count, count); };
    const takeInts = (count) => { at += 4 * count; return this.ints(at - 4 * count, count); };
    const [bytes, links, feet, elements, knows] = takeInts(5), [pitch, cell, period] = take(3);
    const view = {
      links, feet, elements, knows, pitch, cell, period, velocity: take(3), yaw: take(1)[0], load: take(4), depth: take(4),
      center: take(8), shellLoad: take(1)[0], footsteps: take(1)[0], alarms: take(1)[0], known: take(15), x: take(512), y: take(512),
      pressure: take(512), link: take(12 * 41), dirtyCount: takeInts(1), dirty: takeInts(4 * 64),
    };
    if (at - start !== bytes) throw new Error('mild.wasm and mild.js are of different builds');
    return view;
  }

  // A soil's file (docs/soil.md), whose name stands in what is wrong with it.
  soil(name, text) {
    const bytes = new TextEncoder().encode(text), at = this.c.web_text();
    if (bytes.length >= 65536 || bytes.includes(0)) throw new Error(`${name}: is no soil's file`);
    new Uint8Array(this.c.memory.buffer).set([...bytes, 0], at);
    const message = this.c.web_soil();
    if (message) throw new Error(this.text(message).replace(/^soil\.ini/, name));
  }

  start(ground, shape) { this.check(this.c.web_start(ground, shape, 1)); }
  window() { return this.floats(this.c.web_window(), 1024 * 1024); }
  hills() { return this.floats(this.c.web_hills(), 512 * 512); }
}

// ---- what the driver asks for: keys, touch, gamepad ----

class Driver {
  constructor() {
    this.keys = new Set();
    this.stick = [0, 0];
    this.wanted = [0, 0, 0];
    this.command = [0, 0, 0];
    this.heading = null;
    this.most = ROBOTS[0].most;
    this.jumps = false; // a jump in place is asked for
    this.jump = { rise: 0, left: 0 }; // the present one [m, s]
    this.touched = false; // somebody has driven
    this.again = false; // somebody wants it to stand up
    addEventListener('keydown', (e) => {
      if (e.target.tagName === 'INPUT' && e.key.startsWith('Arrow')) return;
      this.keys.add(e.code);
      if (e.code === 'Space' && !e.repeat) this.hop();
      if (e.code.startsWith('Arrow') || e.code === 'Space') e.preventDefault();
    });
    addEventListener('keyup', (e) => this.keys.delete(e.code));
    addEventListener('blur', () => this.keys.clear());
    this.followStick($('stick'));
  }

  hop() { if (this.rises) this.jumps = this.touched = true; }

  followStick(stick) {
    const knob = stick.firstElementChild, move = (e) => {
      const box = stick.getBoundingClientRect(), r = box.width / 2;
      let x = (e.clientX - box.left) / r - 1, y = 1 - (e.clientY - box.top) / r;
      const n = Math.max(1, Math.hypot(x, y));
      x /= n; y /= n;
      this.stick = [y, x];
      knob.style.transform = `translate(${x * 40}px, ${-y * 40}px)`;
    };
    stick.addEventListener('pointerdown', (e) => { stick.setPointerCapture(e.pointerId); this.hop(); move(e); });
    stick.addEventListener('pointermove', (e) => { if (e.pressure > 0 || e.buttons) move(e); });
    for (const end of ['pointerup', 'pointercancel']) {
      stick.addEventListener(end, () => { this.stick = [0, 0]; knob.style.transform = ''; });
    }
  }

  // [forward, left, turn], each in -1 .. 1, and whether somebody asks at all.
  ask() {
    const key = (...codes) => (codes.some((code) => this.keys.has(code)) ? 1 : 0);
    const pace = key('ShiftLeft', 'ShiftRight') ? 1 : 0.55;
    let forward = pace * (key('KeyW', 'ArrowUp') - key('KeyS', 'ArrowDown')) + this.stick[0];
    let left = key('KeyQ') - key('KeyE'), turn = key('KeyA', 'ArrowLeft') - key('KeyD', 'ArrowRight') - this.stick[1];
    for (const pad of navigator.getGamepads ? navigator.getGamepads() : []) {
      if (!pad) continue;
      const axis = (i) => (Math.abs(pad.axes[i] || 0) > 0.12 ? pad.axes[i] : 0);
      forward -= axis(1); left -= axis(0); turn -= axis(2);
      this.again ||= Boolean(pad.buttons[0] && pad.buttons[0].pressed);
    }
    this.touched ||= Boolean(forward || left || turn);
    return [clamp(forward, -1, 1), clamp(left, -1, 1), clamp(turn, -1, 1)];
  }

  // [m] The rise of the next policy step, 0: none. Every command of a robot that jumps is a jump, and one that has begun is finished. A
  // command below 0.3, as of a tap on the stick's middle, is none.
  rise() {
    const { jump, rises } = this;
    if (jump.left <= 0) {
      jump.rise = Math.hypot(...this.wanted) > 0.3 ? rises[1] : this.jumps ? rises[0] : 0;
      jump.left = jump.rise ? jump.left + JUMP_STANCE + 2 * Math.sqrt((2 * jump.rise) / GRAVITY) : 0;
      this.jumps = false;
    }
    if (jump.rise) jump.left -= PERIOD;
    return jump.rise;
  }

  // The command of the next policy step [m/s, m/s, rad/s, m]: gentle changes, and the heading held where nobody turns.
  next(yaw) {
    const rise = this.rises ? this.rise() : 0;
    if (this.rises && !rise) {
      this.command = [0, 0, 0];
      return [0, 0, 0, 0];
    }
    const [ahead, back, aside, turning] = this.most, limits = [this.wanted[0] > 0 ? ahead : back, aside, turning], rate = [1.1, 0.9, 3.0];
    this.command = this.command.map((now, i) => now + clamp(this.wanted[i] * limits[i] - now, -rate[i] * PERIOD, rate[i] * PERIOD));
    if (this.heading === null || this.command[2] !== 0) this.heading = yaw;
    const moves = rise || this.command.some((x) => Math.abs(x) > 0.1);
    const turn = this.command[2] || (moves ? clamp(1.2 * wrap(this.heading - yaw), -0.5, 0.5) : 0);
    return [this.command[0], this.command[1], turn, rise];
  }
}

// ---- what one sees beside the picture ----

// Dark to bright, t in 0 .. 1.
function heat(t) {
  const stops = [[236, 230, 221], [169, 196, 200], [72, 140, 160], [58, 84, 128], [92, 46, 92], [200, 70, 50], [245, 140, 40]];
  const x = clamp(t, 0, 1) * (stops.length - 1), i = Math.min(Math.floor(x), stops.length - 2);
  return stops[i].map((a, k) => Math.round(a + (stops[i + 1][k] - a) * (x - i)));
}

class Panel {
  constructor(app) {
    this.app = app;
    this.soles = $('soles').getContext('2d');
    $('scale').firstElementChild.style.background =
      `linear-gradient(90deg, ${Array.from({ length: 13 }, (_, i) => `rgb(${heat(0.08 + (0.92 * i) / 12)})`).join(', ')})`;
    this.makeGrounds();
    this.robots = ROBOTS.map(({ name }, i) => this.add($('robots'), name, null, () => app.takeRobot(i)));
    for (const id of ['stiffness', 'friction']) $(id).addEventListener('input', () => this.change());
    $('more').addEventListener('click', () => $('side').classList.toggle('on'));
    this.change();
  }

  // A button; color: of its dot, or null.
  add(to, text, color, act) {
    const button = document.createElement('button'), dot = document.createElement('i');
    if (color) { dot.style.background = color; button.append(dot); }
    button.append(text);
    button.addEventListener('click', () => { act(); $('picture').focus(); });
    to.append(button);
    return button;
  }

  makeGrounds() {
    const { app } = this, list = $('grounds'), add = (...all) => this.add(...all);
    const rgb = (c) => `rgb(${c.map((x) => Math.round(255 * x))})`, { names } = app.core;
    const all = `conic-gradient(${names.map((n, i) => `${rgb(GROUNDS[n][1])} ${i / names.length}turn ${(i + 1) / names.length}turn`)})`;
    this.grounds = names.map((name, i) => add(list, GROUNDS[name][0], rgb(GROUNDS[name][1]), () => app.choose(i, app.shape)));
    this.grounds.push(add(list, 'All in stripes', all, () => app.choose(names.length, app.shape)));
    list.prepend(this.grounds[names.length]);
    const file = $('soil');
    file.addEventListener('change', () => { if (file.files[0]) app.takeSoil(file.files[0]); file.value = ''; });
    this.grounds.push(add(list, 'Your soil …', rgb(OWN), () => file.click()));
    const shapes = document.createElement('div');
    shapes.className = 'shapes';
    this.shapes = SHAPES.map((text, i) => add(shapes, text, null, () => app.choose(app.ground, i)));
    list.append(shapes);
  }

  chosen() {
    this.grounds.forEach((button, i) => button.setAttribute('aria-pressed', i === this.app.ground));
    this.shapes.forEach((button, i) => button.setAttribute('aria-pressed', i === this.app.shape));
  }

  // Another robot: as many feet, and pressures of its own.
  entered() {
    const { app } = this, { feet } = app.core.view(), end = ROBOTS[app.robot].pressure;
    this.robots.forEach((button, i) => button.setAttribute('aria-pressed', i === app.robot));
    this.loads = Array.from({ length: feet }, () => document.createElement('output'));
    $('loads').replaceChildren(...this.loads);
    $('jumps').hidden = !ROBOTS[app.robot].rises;
    $('middle').textContent = end / 2e3;
    $('end').textContent = end / 1e3;
  }

  change() {
    const stiffness = 4 ** Number($('stiffness').value), friction = 5 ** Number($('friction').value);
    $('stiffness-value').textContent = `× ${stiffness.toFixed(2)}`;
    $('friction-value').textContent = `× ${friction.toFixed(2)}`;
    this.app.core.c.web_change(stiffness, friction);
  }

  // Left feet on the left; of four the front ones above.
  drawSoles(view) {
    const { soles } = this, { width, height } = soles.canvas, size = 0.94 * view.pitch, four = view.feet > 2;
    const scale = height / (four ? 0.12 : 0.30), end = ROBOTS[this.app.robot].pressure;
    soles.clearRect(0, 0, width, height);
    for (let f = 0; f < view.feet; f++) {
      const middle = width * (f % 2 === 0 ? 0.28 : 0.72), foot = height * (four ? (f < 2 ? 0.27 : 0.73) : 0.68);
      let area = 0;
      for (let e = 0; e < view.elements; e++) {
        const pressure = view.pressure[128 * f + e];
        const x = middle - scale * view.y[128 * f + e], y = foot - scale * view.x[128 * f + e];
        soles.fillStyle = pressure > 0 ? `rgb(${heat(0.08 + (0.92 * pressure) / end)})` : 'rgba(60, 50, 40, 0.07)';
        soles.beginPath();
        soles.roundRect(x - (scale * size) / 2, y - (scale * size) / 2, scale * size, scale * size, 5);
        soles.fill();
        area += pressure > 0;
      }
      if (area > 0) {
        soles.strokeStyle = 'rgba(255, 255, 255, 0.95)';
        soles.lineWidth = 4;
        soles.beginPath();
        soles.arc(middle - scale * view.center[2 * f + 1], foot - scale * view.center[2 * f], 9, 0, 7);
        soles.stroke();
      }
      const depth = this.app.core.names[this.app.ground] === 'rigid' ? 'rigid' : `${Math.round(1e3 * view.depth[f])} mm`;
      this.loads[f].textContent = `${Math.round(view.load[f])} N · ${depth}`;
    }
    $('shells').textContent = view.shellLoad > 0 ? `legs and body ${Math.round(view.shellLoad)} N` : '';
  }

  drawKnowledge(view) {
    const number = (x) => (x >= 100 ? x.toFixed(0) : x.toPrecision(2));
    if (!view.knows) {
      $('knows').textContent = `Nobody has taught the ${ROBOTS[this.app.robot].name} to estimate its ground from its sensors. The SA01 can.`;
      return;
    }
    $('knows').textContent = view.footsteps === 0 ? 'It has not felt the ground yet.' : KNOWN.map(([name, unit], i) => {
      const [low, middle, high] = view.known.subarray(3 * i, 3 * i + 3);
      return `${name} ${number(middle)}${unit} (${number(low)} to ${number(high)})`;
    }).concat(`${view.footsteps} steps on it; it changed ${view.alarms} times`).join('\n');
  }

  drawSpeed(view, command, pace, seconds) {
    const place = (v) => 50 + (50 * clamp(v, -1.3, 1.3)) / 1.3;
    const v = this.smooth = (this.smooth || 0) + (view.velocity[0] - (this.smooth || 0)) * (1 - Math.exp(-3 * seconds));
    const zero = place(0), now = place(v);
    $('measured').style.left = `${Math.min(zero, now)}%`;
    $('measured').style.width = `${Math.abs(now - zero)}%`;
    $('asked').style.left = `${place(command[0])}%`;
    $('numbers').innerHTML = `<b>${v.toFixed(2)}</b> m/s · ${command[0].toFixed(2)} asked`;
    $('pace').textContent = `${pace.toFixed(2)} × real time`;
  }

  say(text, seconds) {
    const toast = $('toast');
    toast.textContent = text;
    toast.classList.add('on');
    clearTimeout(this.quiet);
    if (seconds) this.quiet = setTimeout(() => toast.classList.remove('on'), 1e3 * seconds);
  }
}

// ---- the camera: behind the robot, at a distance, unhurried ----

class Camera {
  constructor(canvas) {
    Object.assign(this, { turn: -0.62, tilt: 0.2, distance: 3, yaw: 0, target: null, idle: 9 });
    const held = new Map();
    canvas.addEventListener('pointerdown', (e) => { held.set(e.pointerId, e); canvas.setPointerCapture(e.pointerId); canvas.focus(); });
    canvas.addEventListener('pointermove', (e) => {
      const before = held.get(e.pointerId);
      if (!before) return;
      const others = [...held.values()].filter((o) => o.pointerId !== e.pointerId);
      if (others.length) {
        const gap = (p) => Math.hypot(p.clientX - others[0].clientX, p.clientY - others[0].clientY);
        this.zoom(gap(before) / Math.max(gap(e), 1));
      } else {
        this.turn -= 0.006 * (e.clientX - before.clientX);
        this.tilt = clamp(this.tilt + 0.005 * (e.clientY - before.clientY), -0.02, 1.35);
      }
      held.set(e.pointerId, e);
    });
    for (const end of ['pointerup', 'pointercancel']) canvas.addEventListener(end, (e) => held.delete(e.pointerId));
    canvas.addEventListener('wheel', (e) => { e.preventDefault(); this.zoom(Math.exp(0.0012 * e.deltaY)); }, { passive: false });
  }

  zoom(factor) { this.distance = clamp(this.distance * factor, 0.9, 8); }

  follow(base, yaw, height, seconds, drift) {
    const goal = [base[0], base[1], height];
    if (!this.target || Math.hypot(goal[0] - this.target[0], goal[1] - this.target[1]) > 1.5) { this.target = goal; this.yaw = yaw; }
    const share = [1 - Math.exp(-seconds * 5), 1 - Math.exp(-seconds * 2.5)];
    this.target = this.target.map((x, k) => x + (goal[k] - x) * share[k < 2 ? 0 : 1]);
    this.yaw += wrap(yaw - this.yaw) * (1 - Math.exp(-seconds * 0.9));
    this.turn += drift * seconds;
    const a = this.yaw + Math.PI + this.turn, c = Math.cos(this.tilt) * this.distance;
    return { eye: [this.target[0] + c * Math.cos(a), this.target[1] + c * Math.sin(a), this.target[2] + Math.sin(this.tilt) * this.distance],
      target: this.target };
  }
}

// ---- the whole ----

class App {
  constructor(core, picture) {
    Object.assign(this, { core, picture });
    this.ground = choice('ground', core.names.length + 1, core.names.length); // all in stripes
    this.shape = choice('shape', SHAPES.length, LEVEL);
    const looks = core.names.map((name) => GROUNDS[name][1]);
    looks.push(OWN);
    while (looks.length < 10) looks.push([0.5, 0.5, 0.5]);
    picture.setWorld(looks, STRIPE);
    this.driver = new Driver();
    this.camera = new Camera($('picture'));
    this.panel = new Panel(this);
    this.links = core.view().link.slice();
    Object.assign(this, { owed: 0, steps: 0, time: 0, pace: 1, fallen: 0, last: null });
    this.enter(FIRST);
    for (const what of ['dragover', 'drop']) addEventListener(what, (e) => {
      e.preventDefault();
      if (what === 'drop' && e.dataTransfer.files[0]) this.takeSoil(e.dataTransfer.files[0]);
    });
    addEventListener('keydown', (e) => {
      const digit = /^Digit(\d)$/.exec(e.code);
      if (e.code === 'KeyR') this.driver.again = true;
      if (digit && !e.repeat) this.choose(digit[1] === '0' ? core.names.length : Number(digit[1]) - 1, this.shape);
    });
  }

  // Somebody asks for a robot. Its file is fetched the first time, and the one before walks on meanwhile.
  async takeRobot(robot) {
    const { file, name } = ROBOTS[robot];
    this.asks = robot;
    try {
      this.panel.say(`${name} is on its way`);
      await this.core.need(file);
      if (this.asks === robot) this.enter(robot); // and for no other one since
    } catch (error) {
      this.panel.say(`${name}: ${error.message}`, 12);
    }
  }

  enter(robot) {
    const { core } = this, { file, most, rises, away } = ROBOTS[robot];
    this.robot = robot;
    core.open(file);
    this.picture.setRobot(core.parts, core.view().cell);
    Object.assign(this.driver, { most, rises });
    this.camera.distance = away;
    this.panel.entered();
    this.choose(this.ground, this.shape);
  }

  // The file of a soil: the ground from now on, or a line that says what is wrong with it.
  async takeSoil(file) {
    try {
      this.core.soil(file.name, await file.text());
      this.choose(this.core.names.length + 1, this.shape);
      this.panel.say(file.name, 4);
    } catch (error) {
      this.panel.say(error.message, 12);
    }
  }

  choose(ground, shape) {
    Object.assign(this, { ground, shape, fallen: 0 });
    this.core.start(ground, shape);
    this.panel.change();
    this.picture.setHills(this.core.hills(), this.core.view().period);
    this.panel.chosen();
    this.restart();
  }

  standUp() {
    this.core.c.web_again();
    this.fallen = 0;
    this.restart();
  }

  restart() {
    Object.assign(this.driver, { command: [0, 0, 0], heading: null, again: false, jumps: false, jump: { rise: 0, left: 0 } });
    this.camera.target = null;
    this.before = this.core.view().link.slice();
    $('toast').classList.remove('on');
  }

  // Nobody drives: it walks on its own, and wanders a little, or jumps every four seconds.
  wander() {
    const t = this.time, { rises } = this.driver;
    if (rises) {
      this.driver.jumps = t % 4 < 1;
      return [0, 0, 0];
    }
    return t < 0.8 ? [0, 0, 0] : [0.45, 0, 0.16 * Math.sin(0.21 * t)];
  }

  step() {
    const { core, driver } = this, command = driver.next(core.view().yaw);
    this.before.set(core.view().link);
    this.asked = command;
    this.steps++;
    this.time += PERIOD;
    const end = core.c.web_step(...command);
    if (end && !this.fallen) {
      this.fallen = this.time;
      this.panel.say(`${ENDS[end]}. It stands up again in a moment.`, 2.2);
    }
  }

  // Called by every frame, and by a timer, so that a slow picture does not slow the robot.
  physics(now) {
    const seconds = this.last === null ? 0 : Math.min((now - this.last) / 1e3, BEHIND), before = this.time;
    this.last = now;
    this.owed = Math.min(this.owed + seconds, BEHIND);
    const asked = this.driver.ask();
    if (this.driver.again) this.standUp();
    this.driver.wanted = this.script ? this.script(this.time) : this.driver.touched ? asked : this.wander();
    while (this.owed >= PERIOD) {
      this.owed -= PERIOD;
      if (this.fallen) {
        this.time += PERIOD;
        if (this.time > this.fallen + 1.6) this.standUp();
      } else {
        this.step();
      }
    }
    this.pace += (this.time - before - seconds * this.pace) * 0.5;
  }

  // A processor that draws, and does so slowly, rests as long as it drew.
  rest(next) {
    const { slow } = this.picture;
    if (slow > 0.06) setTimeout(next, 1e3 * Math.min(slow, 0.2));
    else next();
  }

  frame(now) {
    const seconds = Math.min((now - (this.drawn ?? now)) / 1e3, 0.25);
    this.drawn = now;
    this.physics(performance.now());
    const view = this.core.view(), share = this.owed / PERIOD;
    for (let i = 0; i < 12 * view.links; i++) this.links[i] = this.before[i] + (view.link[i] - this.before[i]) * share;
    if (view.dirtyCount[0]) {
      const all = view.dirtyCount[0] < 0;
      this.picture.setDents(this.core.window(), all ? null : Array.from({ length: view.dirtyCount[0] }, (_, i) => view.dirty.subarray(4 * i, 4 * i + 4)));
      view.dirtyCount[0] = 0;
    }
    const base = [this.links[3], this.links[7], this.links[11]];
    const camera = this.camera.follow(base, view.yaw, base[2] - ROBOTS[this.robot].below, Math.max(seconds, 1e-3), this.driver.touched || this.script ? 0 : 0.05);
    const { names } = this.core, links = this.links.subarray(0, 12 * view.links);
    this.picture.adapt(seconds);
    const look = this.ground === names.length ? -1 : Math.min(this.ground, names.length);
    this.picture.draw(links, camera, look, this.time);
    if (this.driver.touched) $('hint').classList.add('gone');
    this.panel.drawSoles(view);
    this.panel.drawKnowledge(view);
    this.panel.drawSpeed(view, this.asked || [0, 0, 0], this.pace, seconds);
    this.rest(() => requestAnimationFrame((t) => this.frame(t)));
  }
}

// ---- the test hook: ?test walks ten seconds and reports the result to window.report ----

function runTest(app) {
  const speed = Number(options.get('test') || 0.6), start = performance.now();
  let x = null;
  app.script = () => [speed / app.driver.most[0], 0, 0];
  app.steps = 0;
  const watch = () => {
    const { link } = app.core.view(), elapsed = (performance.now() - start) / 1e3;
    if (app.steps >= 300 && !x) x = [link[3], link[7], app.steps];
    if (elapsed < 10 || !x) { setTimeout(watch, 50); return; }
    const report = {
      elapsed, simulated: PERIOD * app.steps, upright: link[10], fell: app.fallen, asked: speed,
      speed: Math.hypot(link[3] - x[0], link[7] - x[1]) / (PERIOD * (app.steps - x[2])), scale: app.picture.scale,
    };
    const before = performance.now();
    for (let i = 0; i < 100; i++) app.core.c.web_step(speed, 0, 0, 0);
    window.report = {
      ...report, step_ms: (performance.now() - before) / 100,
      bytes: performance.getEntriesByType('resource').concat(performance.getEntriesByType('navigation'))
        .reduce((sum, e) => sum + (e.transferSize || e.encodedBodySize), 0),
    };
  };
  watch();
}

async function main() {
  const loading = Core.load(ROBOTS[FIRST].file);
  const picture = new Picture($('picture')); // its programs are compiled meanwhile
  const app = new App(await loading, picture);
  window.app = app;
  if (options.has('soil')) { // a file beside the page
    const name = options.get('soil');
    fetch(name).then((r) => {
      if (!r.ok) throw new Error(`${name}: ${r.status}`);
      return app.takeSoil({ name, text: () => r.text() });
    }).catch((error) => app.panel.say(error.message, 12));
  }
  setInterval(() => app.physics(performance.now()), TICK);
  requestAnimationFrame((t) => {
    app.frame(t);
    $('veil').classList.add('clear');
    app.ready = performance.now() / 1e3; // [s]
    if (options.has('test')) runTest(app);
  });
}

main().catch((error) => {
  console.error(error);
  $('veil').classList.add('clear');
  $('toast').textContent = error.message;
  $('toast').classList.add('on');
});

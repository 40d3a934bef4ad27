"use strict";
// The page of runs: unpacks the tables, plays the mechanism, and keeps every chart at the same time.
// Everything shown comes from the two elements `data` (JSON) and `numbers` (packed columns).

const byId = (id) => document.getElementById(id);

/** An element with attributes, text and children; text never becomes markup. */
function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name === "text") element.textContent = value;
    else if (name.startsWith("on")) element.addEventListener(name.slice(2), value);
    else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

// ---------------------------------------------------------------------------------------------- numbers

/** Bytes from base64; older browsers have no function for it. */
function decoded(text) {
  if (Uint8Array.fromBase64) return Uint8Array.fromBase64(text);
  const letters = atob(text);
  const bytes = new Uint8Array(letters.length);
  for (let k = 0; k < letters.length; k++) bytes[k] = letters.charCodeAt(k);
  return bytes;
}

/** The bytes of the packed columns. */
async function inflated(text) {
  const stream = new Blob([decoded(text)]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Uint8Array(await new Response(stream).arrayBuffer());
}

/** A column as numbers: bytes in planes, signs folded in, differences summed up; 0 stands for a missing one. */
function unpacked(column, rows, bytes) {
  const numbers = new Float64Array(rows);
  const { begin, planes, order, offset, quantum } = column;
  let first = 0, second = 0, third = 0;
  for (let k = 0; k < rows; k++) {
    let code = 0;
    for (let plane = planes - 1; plane >= 0; plane--) code = code * 256 + bytes[begin + plane * rows + k];
    let number = code % 2 === 1 ? -(code + 1) / 2 : code / 2;
    if (order > 2) number = third += number;
    if (order > 1) number = second += number;
    if (order > 0) number = first += number;
    numbers[k] = number === 0 ? NaN : offset + quantum * (number - 1);
  }
  return numbers;
}

/** The columns of a table, each unpacked when it is first asked for. */
function unpackedLater({ columns, rows }, bytes) {
  const values = [];
  columns.forEach((column, k) => Object.defineProperty(values, k, {
    configurable: true,
    enumerable: true,
    get() {
      const value = unpacked(column, rows, bytes);
      Object.defineProperty(values, k, { value, enumerable: true });
      return value;
    },
  }));
  return values;
}

/** How many digits a number of this quantum has behind the point. */
const decimals = (quantum) => Math.min(15, Math.max(0, Math.ceil(-Math.log10(quantum || 1))));

/** A time as it is shown: a digit finer than the rows are apart. */
const clock = (t, every) => t.toFixed(Math.min(12, Math.max(2, decimals(every / 10))));

/** A number as it is shown: no finer than it was kept. */
function shown(value, column) {
  if (value === null || value === undefined || Number.isNaN(value)) return column.log ? "0" : "–";
  if (column.log) return (10 ** value).toExponential(1);
  const size = Math.abs(value);
  if (size < 0.5 * column.quantum) return "0";
  if (size !== 0 && (size >= 1e6 || size < 1e-3)) return value.toExponential(4);
  return value.toFixed(Math.min(6, decimals(column.quantum)));
}

const labelled = (column) => (column.unit ? `${column.name} [${column.unit}]` : column.name);

// ---------------------------------------------------------------------------------------------- motion

/** The last row at or before a time. */
function rowAt(times, t) {
  let low = 0, high = times.length - 1;
  while (low < high) {
    const middle = (low + high + 1) >> 1;
    if (times[middle] <= t) low = middle;
    else high = middle - 1;
  }
  return low;
}

/** The row nearest to a time. */
function nearestRow(times, t) {
  const row = rowAt(times, t);
  return row + 1 < times.length && times[row + 1] - t < t - times[row] ? row + 1 : row;
}

/** Where the bodies are: angle and centre of each, three numbers a body. */
class Motion {
  constructor(run) {
    this.t = run.t;
    this.sources = run.poses.flat().map((k) => run.values[k]);
    [this.begin, this.end] = run.exact;
    this.pose = new Float64Array(this.sources.length);
    this.isCoarse = this.furthestTurn() > 2;
  }

  /** Furthest any body turns from a row to the next. */
  furthestTurn() {
    let furthest = 0;
    for (let k = 0; k < this.sources.length; k += 3) {
      const phi = this.sources[k];
      for (let row = this.begin + 1; row < this.end; row++) {
        const turn = Math.abs(phi[row] - phi[row - 1]);
        if (turn > furthest) furthest = turn;
      }
    }
    return furthest;
  }

  atRow(row, pose = this.pose) {
    for (let k = 0; k < pose.length; k++) pose[k] = this.sources[k][row];
    return pose;
  }

  /** At any time: cubic between rows where all are there, the nearest row where they are not. */
  at(t, pose = this.pose) {
    const times = this.t;
    const row = rowAt(times, t);
    if (this.isCoarse || row < this.begin || row + 1 >= this.end || t <= times[row]) {
      return this.atRow(nearestRow(times, t), pose);
    }
    const span = times[row + 1] - times[row];
    const s = (t - times[row]) / span, r = 1 - s;
    const before = Math.max(row - 1, this.begin), after = Math.min(row + 2, this.end - 1);
    const rise = [span / (times[row + 1] - times[before]), span / (times[after] - times[row])];
    for (let k = 0; k < pose.length; k++) {
      const p = this.sources[k];
      const slopes = [(p[row + 1] - p[before]) * rise[0], (p[after] - p[row]) * rise[1]];
      pose[k] = r * r * (1 + 2 * s) * p[row] + s * s * (3 - 2 * s) * p[row + 1]
        + r * r * s * slopes[0] - r * s * s * slopes[1];
    }
    return pose;
  }
}

/** A place `[body, x, y]` in a pose. */
function located([body, x, y], pose) {
  if (body < 0) return [x, y];
  const c = Math.cos(pose[3 * body]), s = Math.sin(pose[3 * body]);
  return [pose[3 * body + 1] + c * x - s * y, pose[3 * body + 2] + s * x + c * y];
}

/** A direction `[body, x, y]` in a pose. */
function turned([body, x, y], pose) {
  if (body < 0) return [x, y];
  const c = Math.cos(pose[3 * body]), s = Math.sin(pose[3 * body]);
  return [c * x - s * y, s * x + c * y];
}

/** Both ends of a body's bar, or of an arm of it. */
const barEnds = (body, ends, pose) => ends.map(([x, y]) => located([body, x, y], pose));

/** Every point that is drawn in a pose. */
function* drawnPoints(geometry, pose) {
  for (let k = 0; k < geometry.bodies.length; k++) yield* barEnds(k, geometry.bodies[k].ends, pose);
  for (const [body, ends] of geometry.arms) yield* barEnds(body, ends, pose);
  for (const hinge of geometry.hinges) yield located(hinge.at, pose);
  for (const spring of geometry.springs) for (const end of spring) yield located(end, pose);
  for (const slider of geometry.sliders) yield located(slider.at, pose);
  for (const point of geometry.traced) yield located(point.at, pose);
}

// ---------------------------------------------------------------------------------------------- drawing

// Okabe and Ito's colours and a neutral one, in the order in which they are easiest to tell apart; on dark
// paper the darkest are lighter.
const SERIES = {
  light: ["#0072b2", "#d55e00", "#009e73", "#e69f00", "#cc79a7", "#56b4e9", "#7f8790"],
  dark: ["#56b4e9", "#ee7733", "#19c295", "#e6b800", "#e39bc4", "#3f8fd0", "#9aa3ad"],
};
const DASHES = [[], [7, 4], [2, 3], [9, 3, 2, 3]];
const isDark = () => document.documentElement.classList.contains("dark");
const seriesColour = (k) => SERIES[isDark() ? "dark" : "light"][k % 7];
/** The path of a point: not the colour of the first bar. */
const trailColour = (k) => seriesColour([1, 0, 4, 2][k % 4]);

/** Colours of the page, light or dark. */
function palette() {
  const style = getComputedStyle(document.documentElement);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  return { ink: colour("ink"), grey: colour("grey"), grid: colour("grid"), paper: colour("paper"), pale: colour("pale"), panel: colour("panel") };
}

/** The side of a support from the sum of the directions of the bars attached to it, and their number: as in charts. */
function sideOfSupport([x, y, count]) {
  if (!(Math.hypot(x, y) > 0.2 * count)) return [0, -1];
  return Math.abs(x) > 1.001 * Math.abs(y) ? [-Math.sign(x), 0] : [0, -Math.sign(y)];
}

/** Draws mechanisms on a canvas: gravity points down, a metre is as long to the right as it is upwards. */
class Stage {
  constructor(canvas, runs) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.runs = runs;
    const [gx, gy] = runs[0].geometry.gravity;
    const g = Math.hypot(gx, gy);
    this.falls = g > 0;
    this.down = this.falls ? [gx / g, gy / g] : [0, -1];
    this.right = [-this.down[1], this.down[0]];
    this.fit();
    this.resize();
  }

  /** The part of the world that holds all that is ever drawn. */
  fit() {
    const box = [Infinity, -Infinity, Infinity, -Infinity];
    for (const run of this.runs) {
      const stride = Math.max(1, Math.floor(run.t.length / 400));
      const sides = run.geometry.hinges.map(() => [0, 0, 0]);
      for (let row = 0; row < run.t.length; row += stride) {
        const pose = run.motion.atRow(row);
        run.geometry.hinges.forEach((hinge, k) => hinge.ground && this.addAttached(sides[k], run.geometry, located(hinge.at, pose), pose));
        for (const point of drawnPoints(run.geometry, pose)) {
          const [u, h] = this.rotated(point);
          box[0] = Math.min(box[0], u);
          box[1] = Math.max(box[1], u);
          box[2] = Math.min(box[2], h);
          box[3] = Math.max(box[3], h);
        }
      }
      run.sides = sides.map(sideOfSupport);
    }
    const size = Math.max(box[1] - box[0], box[3] - box[2]);
    const air = size > 0 && Number.isFinite(size) ? 0.08 * size : 1;
    this.box = Number.isFinite(size) ? [box[0] - air, box[1] + air, box[2] - air, box[3] + air] : [-1, 1, -1, 1];
  }

  /** Adds the directions on the canvas from a hinge to the middles of the bars that go through it, and their number. */
  addAttached(sum, geometry, hinge, pose) {
    const bars = [...geometry.bodies.map(({ ends }, k) => [k, ends]), ...geometry.arms];
    for (const [body, ends] of bars) {
      const [from, to] = barEnds(body, ends, pose);
      const along = [to[0] - from[0], to[1] - from[1]], there = [hinge[0] - from[0], hinge[1] - from[1]];
      const length = Math.hypot(...along);
      const share = Math.min(1, Math.max(0, (there[0] * along[0] + there[1] * along[1]) / length ** 2));
      const apart = Math.hypot(there[0] - share * along[0], there[1] - share * along[1]);
      const middle = [0.5 * along[0] - there[0], 0.5 * along[1] - there[1]];
      if (!(apart < 1e-3 * length && Math.hypot(...middle) > 1e-3 * length)) continue;
      const [x, y] = this.direction(middle);
      sum[0] += x;
      sum[1] += y;
      sum[2] += 1;
    }
  }

  rotated([x, y]) {
    return [x * this.right[0] + y * this.right[1], -(x * this.down[0] + y * this.down[1])];
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.canvas.clientWidth;
    this.height = this.canvas.clientHeight;
    this.canvas.width = Math.round(ratio * this.width);
    this.canvas.height = Math.round(ratio * this.height);
    this.ratio = ratio;
    const [a, b, c, d] = this.box;
    this.scale = Math.min(this.width / (b - a), this.height / (d - c));
    this.middle = [0.5 * (a + b), 0.5 * (c + d)];
    const lengths = this.runs[0].geometry.bodies
      .map(({ ends: [p, q] }) => Math.hypot(q[0] - p[0], q[1] - p[1]) * this.scale)
      .sort((p, q) => p - q);
    this.size = Math.min(1.4, Math.max(0.45, (lengths[lengths.length >> 1] || 30) / 34));
    this.colours = palette();
  }

  /** A point of the world on the canvas. */
  at(point) {
    const [u, h] = this.rotated(point);
    return [0.5 * this.width + (u - this.middle[0]) * this.scale, 0.5 * this.height - (h - this.middle[1]) * this.scale];
  }

  /** A direction of the world on the canvas, of length one. */
  direction(vector) {
    const [u, h] = this.rotated(vector);
    const length = Math.hypot(u, h) || 1;
    return [u / length, -h / length];
  }

  /** The angle in the world of a direction on the canvas [rad]. */
  angle([x, y]) {
    return Math.atan2(x * this.right[1] + y * this.down[1], x * this.right[0] + y * this.down[0]);
  }

  line(points, colour, width, dash = []) {
    const { context } = this;
    context.beginPath();
    points.forEach(([x, y], k) => (k ? context.lineTo(x, y) : context.moveTo(x, y)));
    context.strokeStyle = colour;
    context.lineWidth = width;
    context.setLineDash(dash);
    context.stroke();
  }

  disc([x, y], radius, fill, stroke) {
    const { context } = this;
    context.beginPath();
    context.arc(x, y, radius, 0, 2 * Math.PI);
    context.fillStyle = fill;
    context.fill();
    if (stroke) {
      context.setLineDash([]);
      context.strokeStyle = stroke;
      context.lineWidth = 1.3;
      context.stroke();
    }
  }

  /** A line with hatching on the side `towards`. */
  hatched(from, to, towards, every, length) {
    const along = [to[0] - from[0], to[1] - from[1]];
    const whole = Math.hypot(...along);
    const count = Math.min(1000, Math.floor(whole / every));
    const { context } = this;
    context.beginPath();
    for (let k = 0; k <= count; k++) {
      const share = count ? k / count : 0.5;
      const x = from[0] + share * along[0], y = from[1] + share * along[1];
      context.moveTo(x, y);
      context.lineTo(x + length * (towards[0] - 0.8 * towards[1]), y + length * (towards[1] + 0.8 * towards[0]));
    }
    context.strokeStyle = this.colours.grey;
    context.lineWidth = 1;
    context.setLineDash([]);
    context.stroke();
    this.line([from, to], this.colours.ink, 1.3);
  }

  /** All runs at a time. */
  draw(t, withTrails) {
    const { context, colours } = this;
    context.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    context.lineJoin = context.lineCap = "round";
    context.fillStyle = colours.paper;
    context.fillRect(0, 0, this.width, this.height);
    this.walls(this.runs[0].geometry.walls);
    this.compass();
    for (let k = this.runs.length - 1; k >= 0; k--) {
      const run = this.runs[k];
      const tint = this.runs.length > 1 ? seriesColour(k) : null;
      if (withTrails) this.trails(run, t, tint);
      this.mechanism(run, run.motion.at(t), tint, k > 0);
    }
    const { horizon } = this.runs[0];
    if (horizon !== null && t > horizon) {
      context.fillStyle = colours.pale;
      context.fillRect(0, 0, this.width, this.height);
    }
  }

  trails(run, t, tint) {
    const { motion, geometry } = run;
    const row = rowAt(run.t, t);
    const first = Math.max(row - run.trailRows, row >= motion.begin ? motion.begin : row);
    if (motion.isCoarse || row >= motion.end || first > row) return;
    const begin = run.t[first], count = 200, pieces = 8;
    const base = this.context.globalAlpha;
    const paths = geometry.traced.map(() => []);
    for (let j = 0; j <= count; j++) {
      const pose = motion.at(begin + ((t - begin) * j) / count);
      geometry.traced.forEach((point, k) => paths[k].push(this.at(located(point.at, pose))));
    }
    paths.forEach((path, k) => {
      for (let piece = 0; piece < pieces; piece++) {
        const [from, to] = [piece, piece + 1].map((n) => Math.floor((n * (path.length - 1)) / pieces));
        if (to <= from) continue;
        this.context.globalAlpha = (base * (piece + 1)) / pieces;
        this.line(path.slice(from, to + 1), tint || trailColour(k), 1 + piece / pieces);
      }
    });
    this.context.globalAlpha = base;
  }

  walls(walls) {
    for (const { through, normal } of walls) {
      const [px, py] = this.at(through);
      const [nx, ny] = this.direction(normal);
      // As far as the canvas reaches from the foot of its middle.
      const apart = (0.5 * this.width - px) * -ny + (0.5 * this.height - py) * nx;
      const foot = [px - ny * apart, py + nx * apart];
      const reach = 0.5 * Math.hypot(this.width, this.height);
      this.hatched([foot[0] + ny * reach, foot[1] - nx * reach], [foot[0] - ny * reach, foot[1] + nx * reach], [-nx, -ny], 9, 6);
    }
  }

  /** The direction of gravity, and a length to compare with. */
  compass() {
    const { context, colours } = this;
    context.fillStyle = colours.grey;
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "left";
    if (this.falls) {
      this.line([[16, 14], [16, 38]], colours.grey, 1.4);
      this.line([[12, 33], [16, 39], [20, 33]], colours.grey, 1.4);
      context.fillText("g", 24, 30);
    }
    const rough = 0.22 * this.width / this.scale;
    const power = 10 ** Math.floor(Math.log10(rough));
    const length = [5, 2, 1].map((n) => n * power).find((n) => n <= rough) || power;
    const pixels = length * this.scale;
    const y = this.height - 12;
    this.line([[14, y - 4], [14, y], [14 + pixels, y], [14 + pixels, y - 4]], colours.grey, 1.4);
    context.fillText(`${Number(length.toPrecision(1))} m`, 20 + pixels, y + 2);
  }

  /** In full, or as a ghost: bars alone, in one colour. */
  mechanism({ geometry, sides }, pose, tint, isGhost) {
    const { size, colours } = this;
    if (isGhost) {
      geometry.bodies.forEach((body, k) => this.line(barEnds(k, body.ends, pose).map((end) => this.at(end)), tint, 2.2 * size));
      return;
    }
    const place = (where) => this.at(located(where, pose));
    geometry.hinges.forEach((hinge, k) => hinge.ground && this.support(place(hinge.at), sides[k]));
    for (const slider of geometry.sliders) this.slider(slider, pose);
    const bar = (body, ends) => {
      const [from, to] = barEnds(body, ends, pose).map((end) => this.at(end));
      // Near the colours of the first two lines in charts.
      const colour = tint || (body % 2 ? "#e69f00" : "#56b4e9");
      this.line([from, to], colours.ink, 7.5 * size);
      this.line([from, to], colour, 5.5 * size);
    };
    for (const [body, ends] of geometry.arms) bar(body, ends);
    geometry.bodies.forEach((body, k) => bar(k, body.ends));
    for (const spring of geometry.springs) this.spring(spring, spring.map(place));
    for (const motor of geometry.motors) this.motor(place(motor.at), this.direction(turned([motor.body, 1, 0], pose)));
    for (const hinge of geometry.hinges) this.disc(place(hinge.at), 3.6 * size, colours.paper, colours.ink);
    if (geometry.marked) {
      geometry.traced.forEach((point, k) => this.disc(place(point.at), 4 * size, tint || trailColour(k)));
    }
  }

  support(hinge, side) {
    const half = 8 * this.size, height = 12 * this.size;
    const on = (along, away) => [hinge[0] - along * side[1] + away * side[0], hinge[1] + along * side[0] + away * side[1]];
    this.line([hinge, on(-half, height), on(half, height), hinge], this.colours.ink, 1.2);
    this.hatched(on(-1.7 * half, height), on(1.7 * half, height), side, 5 * this.size, 6 * this.size);
  }

  slider(slider, pose) {
    const [x, y] = this.at(located(slider.at, pose));
    const [dx, dy] = this.direction(turned(slider.rail, pose));
    const reach = slider.rail[0] < 0 ? Math.hypot(this.width, this.height) : 60 * this.size;
    this.line([[x - reach * dx, y - reach * dy], [x + reach * dx, y + reach * dy]], this.colours.grey, 1, [6, 4]);
    const corner = (along, across) => [x + along * dx - across * dy, y + along * dy + across * dx];
    const half = 10 * this.size, wide = 6 * this.size;
    const block = [corner(-half, -wide), corner(half, -wide), corner(half, wide), corner(-half, wide), corner(-half, -wide)];
    this.context.beginPath();
    block.forEach(([a, b], k) => (k ? this.context.lineTo(a, b) : this.context.moveTo(a, b)));
    this.context.fillStyle = this.colours.panel;
    this.context.fill();
    this.line(block, this.colours.ink, 1.2);
  }

  spring(ends, [from, to]) {
    const along = [to[0] - from[0], to[1] - from[1]];
    const length = Math.hypot(...along);
    const [dx, dy] = length ? [along[0] / length, along[1] / length] : [0, 0];
    [from, to].forEach((at, k) => {
      if (ends[k][0] >= 0) return;
      // The hatching lies on the side the spring does not leave to.
      const up = (k ? -dy : dy) >= 0 ? -1 : 1;
      const half = 9 * this.size;
      this.hatched([at[0] - half, at[1]], [at[0] + half, at[1]], [0, up], 5 * this.size, 6 * this.size);
    });
    const lead = Math.min(0.15 * length, 10 * this.size);
    const waves = 11;
    const line = [from];
    for (let k = 0; k <= waves; k++) {
      const s = lead + ((length - 2 * lead) * k) / waves;
      const swing = k === 0 || k === waves ? 0 : 6 * this.size * (1 - 2 * (k % 2));
      line.push([from[0] + s * dx - swing * dy, from[1] + s * dy + swing * dx]);
    }
    line.push(to);
    this.line(line, "#009e73", 1.9 * this.size);
  }

  /** An arc ahead of the driven bar. */
  motor([x, y], [dx, dy]) {
    const radius = 24 * this.size;
    const start = Math.atan2(dy, dx);
    this.context.beginPath();
    this.context.arc(x, y, radius, start - 0.35, start - 2.4, true);
    this.context.strokeStyle = "#cc79a7";
    this.context.lineWidth = 2.2 * this.size;
    this.context.setLineDash([]);
    this.context.stroke();
  }
}

// ---------------------------------------------------------------------------------------------- charts

const SUPERSCRIPT = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
const tenTo = (power) => (Number.isInteger(power) ? `10${[...String(power)].map((sign) => SUPERSCRIPT[sign]).join("")}` : "");

/** Numbers as uPlot takes them: missing ones are null. */
function gapped(numbers) {
  return numbers.some(Number.isNaN) ? Array.from(numbers, (number) => (Number.isNaN(number) ? null : number)) : numbers;
}

/** One chart; `lines()` are `{label, column, values, times, colour, width, dash}`. It is empty until it is drawn. */
class Chart {
  constructor(page, home, title, lines) {
    this.page = page;
    this.title = title;
    this.element = make("div", { class: "chart" });
    this.heading = make("h3", { text: title });
    this.body = make("div");
    this.element.append(this.heading, this.body);
    this.body.style.minHeight = `${this.height()}px`;
    home.append(this.element);
    this.lines = lines;
    this.plot = null;
  }

  /** Whether any of it can be seen without scrolling. */
  isInView() {
    const { top, bottom } = this.element.getBoundingClientRect();
    return top < window.innerHeight && bottom > 0;
  }

  /** Draws it, over the part of the time that all charts show. */
  draw() {
    this.clear();
    const lines = this.lines();
    const same = lines.every((line) => line.times === lines[0].times);
    this.data = same
      ? [lines[0].times, ...lines.map((line) => gapped(line.values))]
      : uPlot.join(lines.map((line) => [line.times, gapped(line.values)]));
    this.plot = new uPlot(this.options(lines), this.data, this.body);
    this.now = make("div", { class: "now" });
    this.plot.over.append(this.now);
    this.listen();
  }

  clear() {
    if (this.plot) this.plot.destroy();
    this.plot = null;
  }

  /** Shows this part of the time. */
  zoom(range) {
    if (this.plot) this.plot.setScale("x", range);
  }

  height() {
    return window.innerWidth < 900 ? 170 : 200;
  }

  options(lines) {
    const colours = palette();
    const { page } = this;
    const isLog = lines.length > 0 && lines[0].column.log;
    const axis = { stroke: colours.grey, grid: { stroke: colours.grid, width: 1 }, ticks: { stroke: colours.grid, width: 1 }, font: "11px system-ui, sans-serif" };
    return {
      width: this.width(),
      height: this.height(),
      cursor: { sync: { key: "time" }, drag: { x: true, y: false }, points: { size: 6 } },
      legend: { live: true },
      scales: { x: { time: false, ...page.range }, y: { range: (_, low, high) => padded(low, high, isLog) } },
      axes: [
        { ...axis, size: 32, ...along, values: (_, splits) => tickWords(splits).map((t) => `${t} s`) },
        { ...axis, size: (_, words) => page.upright(room(NARROW, words)), ...(isLog ? { incrs: [1, 2, 3, 5, 10, 20, 50, 100], values: (_, splits) => splits.map(tenTo) } : { ...upright, values: (_, splits) => tickWords(splits) }) },
      ],
      series: [
        { label: "t [s]", value: (_, t) => (t === null || t === undefined ? "–" : clock(t, page.main.every)) },
        ...lines.map((line) => ({
          label: line.label,
          stroke: line.colour(),
          dash: line.dash,
          width: line.width,
          points: { show: false },
          value: (_, value) => shown(value, line.column),
        })),
      ],
      hooks: {
        draw: [(plot) => this.annotate(plot)],
        setScale: [(plot, key) => key === "x" && page.zoomed(this, plot)],
      },
    };
  }

  width() {
    return Math.max(220, this.element.clientWidth);
  }

  /** What lies beyond the trust horizon is pale; events and impacts are marked. */
  annotate(plot) {
    const { ctx, bbox } = plot;
    const { horizon, marks } = this.page.main;
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    if (horizon !== null) {
      const x = plot.valToPos(horizon, "x", true);
      ctx.fillStyle = palette().pale;
      ctx.fillRect(Math.max(x, bbox.left), bbox.top, bbox.width, bbox.height);
    }
    ctx.lineWidth = 1;
    for (const mark of marks) {
      const x = Math.round(plot.valToPos(mark.t, "x", true)) + 0.5;
      if (x < bbox.left || x > bbox.left + bbox.width) continue;
      ctx.strokeStyle = mark.kind === "impacts" ? "#d55e00" : "#009e73";
      ctx.beginPath();
      ctx.moveTo(x, bbox.top);
      ctx.lineTo(x, bbox.top + 0.06 * bbox.height);
      ctx.stroke();
    }
    ctx.restore();
  }

  /** A click goes to its time; a drag zooms. */
  listen() {
    let pressed = 0;
    const { over } = this.plot;
    over.addEventListener("mousedown", (event) => (pressed = event.clientX));
    over.addEventListener("click", (event) => {
      if (Math.abs(event.clientX - pressed) < 4) this.page.go(this.plot.posToVal(event.clientX - over.getBoundingClientRect().left, "x"));
    });
    over.addEventListener("mouseenter", () => (this.page.isHovering = true));
    over.addEventListener("mouseleave", () => {
      this.page.isHovering = false;
      this.page.schedule();
    });
  }

  /** Puts the mark of the time where it belongs, and with `values` what the lines are there. */
  tell(t, values) {
    const { plot, now } = this;
    if (!plot) return;
    const x = plot.valToPos(t, "x");
    const isSeen = x >= 0 && x <= plot.over.clientWidth;
    now.style.display = isSeen ? "" : "none";
    now.style.transform = `translateX(${x}px)`;
    if (values) plot.setLegend({ idx: nearestRow(this.data[0], t) });
  }
}

/** The range of an axis: some air, and never none at all. */
function padded(low, high, isLog) {
  if (low === null || high === null) return [0, 1];
  if (isLog) return [Math.floor(low - 0.2), Math.ceil(high + 0.2)];
  const air = high > low ? 0.06 * (high - low) : Math.max(1e-9, 0.1 * Math.abs(high));
  return [low - air, high + air];
}

/** Places of ticks between two ends: multiples of 1, 2 or 5 times a power of ten, about so many. */
function roundPlaces(low, high, most) {
  const rough = (high - low) / Math.max(2, Math.floor(most));
  const size = Number(`1e${Math.floor(Math.log10(rough))}`);
  const step = [1, 2, 5, 10].map((factor) => factor * size).find((step) => step >= rough * (1 - 1e-9));
  if (!(step > 0)) return [];
  const [first, last] = [Math.ceil(low / step - 1e-6), Math.floor(high / step + 1e-6)];
  const places = Array.from({ length: Math.min(1000, Math.max(0, last - first + 1)) }, (_, k) => (first + k) * step);
  return places.filter((place, k) => k === 0 || place !== places[k - 1]);
}

/** Ticks of an upright axis, or one along the page. */
const upright = { splits: (plot, axis, low, high) => roundPlaces(low, high, plot.bbox.height / uPlot.pxRatio / 32) };
const along = { splits: (plot, axis, low, high) => roundPlaces(low, high, plot.bbox.width / uPlot.pxRatio / 80) };

/** Least width of the upright axes of charts over time. */
const NARROW = 62;

/** Room for the words at the ticks of an upright axis: at least so much. */
const room = (least, words) => Math.max(least, 20 + 6.6 * Math.max(0, ...(words || []).map((text) => text.length)));

/** Numbers at the ticks of an axis, each with the digits that tell it from the next; from the first one on where these are many. */
function tickWords(places) {
  const step = places.length > 1 ? Math.abs(places[1] - places[0]) : Math.abs(places[0]);
  const largest = Math.max(...places.map(Math.abs));
  if (!(largest > 0)) return places.map(() => "0");
  const digits = Math.max(0, Math.ceil(Math.log10(largest / step) - 1e-6));
  if (digits > 5) return places.map((place, k) => (k ? `+${Number((place - places[0]).toPrecision(2))}` : String(Number(place.toPrecision(7)))));
  const isPlain = largest < 1e5 && largest >= 1e-3;
  if (!isPlain) return places.map((place) => (place === 0 ? "0" : Number(place.toExponential(digits)).toExponential()));
  const behind = Math.max(0, -Math.floor(Math.log10(step) + 1e-6));
  return places.map((place) => (Math.abs(place) < 0.5 * step ? "0" : place.toFixed(Math.min(20, behind))));
}

// ---------------------------------------------------------------------------------------------- page

/** How far the fastest body turns along a path shown [rad]. */
const PATH = 4 * Math.PI;

/** Mean rate of the fastest body that the eye can follow [rad/s]. */
const CALM = 15;

/** A run, its columns unpacked. */
function opened(run, table, bytes) {
  const values = unpackedLater(table, bytes);
  const whole = { ...run, columns: table.columns, values, t: values[0] };
  whole.motion = new Motion(whole);
  const [begin, end] = whole.exact;
  const turned = furthestTurned(whole);
  // Rows in which the fastest body turns about twice.
  whole.trailRows = Math.min(4000, turned > 0 ? Math.ceil((PATH * (end - begin)) / turned) : end - begin);
  whole.meanRate = turned / Math.max(1e-300, whole.t[end - 1] - whole.t[begin]);
  return whole;
}

/** How far the body that turns furthest turns, there and back, where all rows are kept. */
function furthestTurned(run) {
  const [begin, end] = run.exact;
  let furthest = 0;
  for (const [phi] of run.poses) {
    let turned = 0;
    for (let row = begin + 1; row < end; row++) turned += Math.abs(run.values[phi][row] - run.values[phi][row - 1]);
    furthest = Math.max(furthest, turned);
  }
  return furthest;
}

class Page {
  constructor() {
    this.time = 0;
    this.speed = 1;
    this.isPlaying = false;
    this.isHovering = false;
    this.frames = 0;
    this.told = 0;
    this.charts = [];
    this.axes = NARROW;
    /** What a link says beside the time. */
    this.place = "";
  }

  /** Shows runs, the first in full; they may take the place of others. */
  present(runs) {
    this.runs = runs;
    this.main = runs[0];
    const { main } = this;
    this.end = main.t[main.t.length - 1];
    this.time = Math.min(this.time, this.end);
    byId("main").hidden = false;
    this.stage = new Stage(byId("mechanism"), runs);
    this.legend();
    this.charts.forEach((chart) => chart.clear());
    this.charts = [];
    this.range = { min: main.t[0], max: Math.max(...runs.map((run) => run.t[run.t.length - 1])) };
    byId("charts").replaceChildren();
    this.makeCharts();
    this.isComplete = this.drawCharts();
    this.words();
    byId("scrub").max = String(main.t.length - 1);
    // Slow enough to be seen, also where a run is over in a moment.
    this.slowest = Math.min(0.05, this.end / 10);
    byId("speed").min = String(Math.log10(this.slowest));
  }

  /** The page of these runs. */
  open(runs) {
    this.present(runs);
    const { main } = this;
    entitled(main, runs.length > 1
      ? `${runs.length} runs: ${runs.map((run) => run.label).join(", ")}`
      : `${main.setting} · ${main.rows} rows to ${Number(this.end.toPrecision(6))} s`);
    this.begin();
  }

  /** Listens, and goes where the address points. */
  begin() {
    this.setSpeed(Math.min(1, this.end / 6, CALM / this.main.meanRate));
    this.controls();
    this.follow(location.hash);
    this.frame(true);
  }

  legend() {
    const entry = (colour, text) => {
      const swatch = make("i");
      swatch.style.background = colour;
      return make("li", {}, swatch, text);
    };
    const entries = this.runs.length > 1
      ? this.runs.map((run, k) => entry(seriesColour(k), `(${k + 1}) ${run.label}`))
      : this.main.geometry.traced.map((point, k) => entry(trailColour(k), `path of ${point.name}`));
    byId("legend").replaceChildren(...entries);
  }

  /** The lines of a chart: these columns, of every run that has them; of several runs the first is widest. */
  lines(columns) {
    const several = this.runs.length > 1;
    // A body has its colour in every chart.
    const body = ({ name }) => this.main.geometry.bodies.findIndex((body) => name === `${body.name}.phi` || name === `${body.name}.omega`);
    const place = columns.map((wanted, n) => (body(wanted) < 0 ? n : body(wanted)));
    return columns.flatMap((wanted, n) => this.runs.flatMap((run, k) => {
      const own = run.columns.findIndex((column) => column.name === wanted.name && column.unit === wanted.unit);
      if (own < 0) return [];
      return [{
        label: several ? `${wanted.name} (${k + 1})` : wanted.name,
        column: run.columns[own],
        values: run.values[own],
        times: run.t,
        colour: () => seriesColour(several ? k : place[n]),
        width: 1.3 + 0.9 * Math.min(3, this.runs.length - 1 - k),
        dash: DASHES[(several ? n : Math.floor(place[n] / SERIES.light.length)) % DASHES.length],
      }];
    }));
  }

  /** The charts of all runs, those of one kind in one. */
  makeCharts() {
    const home = byId("charts");
    const charts = new Map();
    for (const run of this.runs) {
      for (const { title, unit, columns } of run.charts) {
        const name = unit ? `${title} [${unit}]` : title;
        const known = charts.get(name) || [];
        for (const column of columns.map((index) => run.columns[index])) {
          if (!known.some((other) => other.name === column.name)) known.push(column);
        }
        charts.set(name, known);
      }
    }
    for (const [title, columns] of charts) this.charts.push(new Chart(this, home, title, () => this.lines(columns)));
    this.distance(home);
    this.chooser(home);
  }

  /** Draws the charts in view at once, the others when there is time. */
  async drawCharts() {
    const { charts } = this;
    const inView = charts.map((chart) => chart.isInView());
    for (const [k, chart] of charts.entries()) if (inView[k]) chart.draw();
    for (const [k, chart] of charts.entries()) {
      if (inView[k]) continue;
      await new Promise((resume) => setTimeout(resume));
      // Another run may have taken the place of this one, or the theme changed.
      if (this.charts !== charts) return;
      if (!chart.plot) chart.draw();
    }
    this.schedule();
  }

  /** How far the other runs are from the first. */
  distance(home) {
    const { main } = this;
    const others = main.distances.map((index, k) => [index, k]).filter(([index]) => index !== null);
    const lines = () => others.map(([index, k]) => ({
      label: `(${k + 2})`,
      column: main.columns[index],
      values: main.values[index],
      times: main.t,
      colour: () => seriesColour(k + 1),
      width: 1.3 + 0.9 * Math.min(3, this.runs.length - 2 - k),
      dash: [],
    }));
    if (others.length) this.charts.push(new Chart(this, home, "Distance from the first run [m]", lines));
  }

  /** A chart of any column. */
  chooser(home) {
    const { main } = this;
    const options = main.columns.map((column, k) => [labelled(column), k]).filter(([, k]) => k > 0 && k < main.shown);
    const select = make("select", { "aria-label": "Column" }, ...options.map(([text, k]) => make("option", { value: String(k), text })));
    select.value = String(main.poses.length ? main.poses[0][1] : 1);
    const chart = new Chart(this, home, "Column ", () => this.lines([main.columns[Number(select.value)]]));
    chart.heading.append(select);
    select.addEventListener("change", () => {
      chart.draw();
      this.schedule();
    });
    this.charts.push(chart);
  }

  /** The width of the upright axes of all charts, whose times lie above one another: the most that one of them takes. */
  upright(width) {
    if (width > this.axes) {
      this.axes = width;
      requestAnimationFrame(() => {
        this.charts.forEach((chart) => chart.plot?.redraw(false, true));
        this.schedule();
      });
    }
    return this.axes;
  }

  /** Zooms all charts with one. */
  zoomed(chart, plot) {
    if (this.isZooming) return;
    this.isZooming = true;
    const { min, max } = plot.scales.x;
    this.range = { min, max };
    for (const other of this.charts) if (other !== chart) other.zoom(this.range);
    this.isZooming = false;
    this.schedule();
  }

  words() {
    const home = byId("words");
    home.hidden = false;
    home.replaceChildren();
    for (const run of this.runs) {
      home.append(make("h2", { text: this.runs.length > 1 ? run.label : "Summary" }));
      const list = make("dl");
      for (const [label, text] of run.summary) list.append(make("dt", { text: label }), make("dd", { text }));
      for (const note of run.notes || []) list.append(make("dt", { text: "note" }), make("dd", { text: note }));
      home.append(list, ...(run.command ? [copied(run.command)] : []));
      if (!run.record) continue;
      const text = make("pre");
      const record = make("details", {}, make("summary", { text: "run.json" }), text);
      record.addEventListener("toggle", () => (text.textContent = JSON.stringify(run.record, null, 2)), { once: true });
      home.append(record);
    }
  }

  controls() {
    const scrub = byId("scrub"), speed = byId("speed");
    scrub.addEventListener("input", () => {
      this.play(false);
      this.go(this.main.t[Number(scrub.value)]);
    });
    byId("play").addEventListener("click", () => this.play(!this.isPlaying));
    speed.addEventListener("input", () => this.setSpeed(10 ** Number(speed.value)));
    byId("trails").addEventListener("change", () => this.schedule());
    document.addEventListener("keydown", (event) => this.key(event));
    window.addEventListener("hashchange", () => this.follow(location.hash));
    window.addEventListener("resize", () => this.resize());
    byId("theme").addEventListener("click", () => this.theme(!isDark()));
  }

  theme(dark) {
    document.documentElement.classList.toggle("dark", dark);
    for (const chart of this.charts) chart.draw();
    this.legend();
    this.resize();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey || event.target.tagName === "SELECT") return;
    const step = event.shiftKey ? 10 : 1;
    const actions = {
      " ": () => this.play(!this.isPlaying),
      ArrowRight: () => this.step(step),
      ArrowLeft: () => this.step(-step),
      ArrowUp: () => this.setSpeed(this.speed * 1.25),
      ArrowDown: () => this.setSpeed(this.speed / 1.25),
      Home: () => this.go(0),
      End: () => this.go(this.end),
    };
    if (!(event.key in actions)) return;
    event.preventDefault();
    actions[event.key]();
  }

  /** So many rows on. */
  step(rows) {
    this.play(false);
    const { t } = this.main;
    const row = Math.min(t.length - 1, Math.max(0, nearestRow(t, this.time) + rows));
    this.go(t[row]);
  }

  setSpeed(speed) {
    this.speed = Math.min(20, Math.max(this.slowest, speed));
    byId("speed").value = String(Math.log10(this.speed));
    byId("factor").textContent = `${Number(this.speed.toPrecision(2))} ×`;
  }

  /** Where a link points: `#t=60&speed=0.5&play`. */
  follow(hash) {
    const wanted = new URLSearchParams(hash.slice(1));
    const number = (name) => (wanted.has(name) ? Number(wanted.get(name)) : NaN);
    if (number("speed") > 0) this.setSpeed(number("speed"));
    if (number("t") >= 0) this.go(number("t"));
    if (wanted.has("play")) this.play(true);
  }

  play(wanted) {
    if (wanted && this.time >= this.end) this.time = 0;
    this.isPlaying = wanted;
    byId("play").textContent = wanted ? "❚❚" : "▶";
    this.before = null;
    this.schedule();
  }

  /** Shows a time. */
  go(t) {
    const clamped = Math.min(this.end, Math.max(0, t));
    const row = nearestRow(this.main.t, clamped);
    // A row is meant where it is as near as digits tell.
    this.time = Math.abs(this.main.t[row] - clamped) <= 1e-3 * this.main.every ? this.main.t[row] : clamped;
    this.schedule();
    clearTimeout(this.linking);
    if (!this.isPlaying) this.linking = setTimeout(() => this.link(), 250);
  }

  link() {
    const t = Number(this.time.toPrecision(9));
    try {
      history.replaceState(null, "", `#${this.place}t=${t}`);
    } catch {
      // Some browsers keep pages from files from changing their address.
    }
  }

  resize() {
    for (const chart of this.charts) if (chart.plot) chart.plot.setSize({ width: chart.width(), height: chart.plot.height });
    this.stage.resize();
    this.schedule();
  }

  /** Draws at the next frame, once. */
  schedule() {
    if (this.isScheduled) return;
    this.isScheduled = true;
    requestAnimationFrame((at) => {
      this.isScheduled = false;
      if (this.isPlaying) {
        if (this.before !== null) this.time += ((at - this.before) / 1000) * this.speed;
        this.before = at;
        if (this.time >= this.end) {
          this.time = this.end;
          this.play(false);
        }
      }
      this.frame(!this.isPlaying || at - this.told > 80, at);
      if (this.isPlaying) this.schedule();
    });
  }

  /** One frame; `all` writes the numbers too. */
  frame(all, at = 0) {
    this.frames += 1;
    this.stage.draw(this.time, byId("trails").checked);
    const values = all && !this.isHovering;
    for (const chart of this.charts) chart.tell(this.time, values);
    byId("scrub").value = String(nearestRow(this.main.t, this.time));
    byId("clock").textContent = `${clock(this.time, this.main.every)} s`;
    byId("remark").textContent = this.remark();
    if (all) this.told = at;
  }

  /** What has to be known of what is seen. */
  remark() {
    const { main, time } = this;
    const remarks = [];
    const [begin, end] = main.exact;
    if (main.horizon !== null && time > main.horizon) remarks.push(`beyond the trust horizon, ${Number(main.horizon.toPrecision(3))} s`);
    if (main.motion.isCoarse) remarks.push("rows too far apart for what is between them");
    else if (end - begin < main.t.length && (time < main.t[begin] || time > main.t[end - 1])) {
      remarks.push(`single rows; all of them from ${Number(main.t[begin].toPrecision(4))} s to ${Number(main.t[end - 1].toPrecision(4))} s`);
    }
    const passed = this.passed();
    if (passed) remarks.push(`${passed.kind === "impacts" ? "impact" : "event"}: ${passed.name}`);
    return remarks.join("; ");
  }

  /** The impact or event of the moment; while playing it stays for a third of a second. */
  passed() {
    const { main, time } = this;
    const stay = Math.max(main.every, this.isPlaying ? 0.33 * this.speed : 0);
    return main.marks.findLast((mark) => mark.t <= time + 0.5 * main.every && time - mark.t < stay);
  }
}

/** A command with a button that copies it. */
function copied(command) {
  const code = make("code", { text: command });
  const button = make("button", { type: "button", text: "copy", onclick: async () => {
    try {
      await navigator.clipboard.writeText(command);
      button.textContent = "copied";
    } catch {
      getSelection().selectAllChildren(code);
    }
  } });
  return make("div", { class: "command" }, code, button);
}

/** Title and second line of the page. */
function entitled({ scene, description }, caption) {
  byId("title").textContent = description ? `${scene}: ${description}` : scene;
  byId("caption").textContent = caption;
}

// ---------------------------------------------------------------------------------------------- points

/** Numbers at ticks of a linear axis of decimal logarithms: powers of ten, and what lies between two with the digits that tell it from the next. */
function powerWords(logs) {
  const plain = (number, digits) => (number >= 1e-3 && number < 1e5 ? String(Number(number.toPrecision(digits))) : Number(number.toPrecision(digits)).toExponential());
  const isNarrow = 2 * logs.filter(Number.isInteger).length < logs.length && logs.every((log) => log >= -3 && log < 5);
  const words = (digits) => logs.map((log) => (isNarrow ? "" : tenTo(log)) || plain(10 ** log, digits));
  const digits = [2, 3, 4, 5, 6, 7, 8, 9].find((digits) => new Set(words(digits)).size === logs.length) || 9;
  return words(digits);
}

/** Places of ticks on such an axis: powers of ten, twice and five times them where they are few, else round numbers. */
function decadeTicks(low, high) {
  const span = high - low;
  if (span > 3) {
    const step = Math.ceil(span / 8);
    return Array.from({ length: Math.floor(high / step) - Math.ceil(low / step) + 1 }, (_, k) => (Math.ceil(low / step) + k) * step);
  }
  if (span > 0.9) {
    const decades = Array.from({ length: Math.ceil(span) + 2 }, (_, k) => Math.floor(low) + k);
    return decades.flatMap((decade) => [0, Math.log10(2), Math.log10(5)].map((part) => decade + part)).filter((at) => at >= low && at <= high);
  }
  const [from, to] = [10 ** low, 10 ** high];
  const size = 10 ** Math.floor(Math.log10((to - from) / 4));
  const step = [1, 2, 5, 10].map((factor) => factor * size).find((step) => step >= (to - from) / 6);
  return Array.from({ length: Math.max(0, Math.floor(to / step) - Math.ceil(from / step) + 1) }, (_, k) => Math.log10((Math.ceil(from / step) + k) * step));
}
const SHAPES = [
  (ctx, x, y, r) => ctx.arc(x, y, r, 0, 2 * Math.PI),
  (ctx, x, y, r) => ctx.rect(x - 0.9 * r, y - 0.9 * r, 1.8 * r, 1.8 * r),
  (ctx, x, y, r) => [[0, -1.2], [1.1, 0.8], [-1.1, 0.8], [0, -1.2]].forEach(([u, v], k) => (k ? ctx.lineTo(x + r * u, y + r * v) : ctx.moveTo(x + r * u, y + r * v))),
];

/** The same as letters. */
const SIGNS = ["●", "■", "▲"];

/** A box that says what is under the mouse. */
function showTip(tip, home, [x, y], text) {
  tip.hidden = false;
  tip.textContent = text;
  tip.style.left = `${Math.max(0, Math.min(x + 14, home.clientWidth - tip.offsetWidth - 4))}px`;
  tip.style.top = `${y + 16}px`;
}

/**
 * Points joined by lines, a line for each series, on axes that are linear or hold decimal logarithms; the point
 * near the mouse tells what it is, and a click chooses it.  `points` are `{series, x, y, text, choose}`.
 */
class Scatter {
  constructor(home, names, points) {
    this.names = names;
    this.points = points.filter((point) => Number.isFinite(point.x) && Number.isFinite(point.y));
    this.series = [...new Set(this.points.map((point) => point.series))];
    this.chosen = null;
    this.element = make("div", { class: "chart" });
    this.body = make("div");
    this.tip = make("div", { class: "tip", role: "status" });
    this.tip.hidden = true;
    this.element.append(make("h3", { text: names.title }), ...(names.caption ? [make("p", { class: "hint", text: names.caption })] : []), this.body, this.tip);
    home.append(this.element);
    this.show();
  }

  /** Draws anew, in the colours of the page. */
  show() {
    if (this.plot) this.plot.destroy();
    const colours = palette();
    const axis = { stroke: colours.grey, grid: { stroke: colours.grid, width: 1 }, ticks: { stroke: colours.grid, width: 1 }, font: "11px system-ui, sans-serif", labelFont: "12px system-ui, sans-serif", labelSize: 20 };
    const scale = (isLog, linear) => ({
      ...(isLog ? { splits: (_, axis, low, high) => decadeTicks(low, high) } : linear),
      values: (_, splits) => (isLog ? powerWords(splits) : tickWords(splits)),
    });
    // Where no point has a number there is nothing to read off.
    const blank = { splits: () => [], values: () => [] };
    const sorted = [...this.points].sort((a, b) => a.x - b.x);
    const [isLogX, isLogY] = this.names.logs;
    const around = (low, high) => {
      if (low === null) return [0, 1];
      const air = 0.05 * (high - low || Math.abs(low) || 1);
      return [low - air, high + air];
    };
    this.plot = new uPlot({
      width: Math.max(220, this.element.clientWidth),
      height: this.names.height || Math.round(Math.min(460, Math.max(260, 0.62 * this.element.clientWidth))),
      legend: { show: false },
      cursor: { drag: { x: true, y: true }, points: { show: false } },
      scales: { x: { time: false, range: (_, low, high) => around(low, high) }, y: { range: (_, low, high) => around(low, high) } },
      axes: [
        { ...axis, size: 32, label: this.names.x, ...scale(isLogX, along) },
        { ...axis, size: 56, label: this.names.y, ...(this.names.isBlank ? blank : { ...scale(isLogY, upright), size: (_, words) => room(56, words) }) },
      ],
      series: [{}, { paths: () => null, points: { show: false } }],
      hooks: { draw: [(plot) => this.draw(plot)] },
    }, [sorted.map((point) => point.x), sorted.map((point) => point.y)], this.body);
    this.plot.over.classList.add("over");
    this.listen();
  }

  draw(plot) {
    const { ctx, bbox } = plot;
    const ratio = uPlot.pxRatio;
    const at = (point) => [plot.valToPos(point.x, "x", true), plot.valToPos(point.y, "y", true)];
    ctx.save();
    ctx.beginPath();
    ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    ctx.clip();
    for (const [level, words] of this.names.levels || []) {
      const y = plot.valToPos(level, "y", true);
      ctx.strokeStyle = ctx.fillStyle = palette().grey;
      ctx.setLineDash([4 * ratio, 4 * ratio]);
      ctx.beginPath();
      ctx.moveTo(bbox.left, y);
      ctx.lineTo(bbox.left + bbox.width, y);
      ctx.stroke();
      ctx.font = `${11 * ratio}px system-ui, sans-serif`;
      [ctx.textAlign, ctx.textBaseline] = ["right", "bottom"];
      ctx.fillText(words, bbox.left + bbox.width - 6 * ratio, y - 2 * ratio);
    }
    ctx.setLineDash([]);
    this.series.forEach((name, k) => {
      const own = this.points.filter((point) => point.series === name);
      const colour = this.names.colours?.[name]?.() ?? seriesColour(k);
      ctx.strokeStyle = ctx.fillStyle = colour;
      ctx.lineWidth = 1.2 * ratio;
      ctx.beginPath();
      if (this.names.joined) own.map(at).forEach(([x, y], n) => (n ? ctx.lineTo(x, y) : ctx.moveTo(x, y)));
      ctx.stroke();
      for (const point of own) {
        const [x, y] = at(point);
        ctx.beginPath();
        SHAPES[Math.floor(k / SERIES.light.length) % SHAPES.length](ctx, x, y, 3.2 * ratio);
        ctx.fill();
        if (point !== this.chosen && !point.isMarked) continue;
        ctx.beginPath();
        ctx.strokeStyle = point === this.chosen ? palette().ink : palette().grey;
        ctx.arc(x, y, (point === this.chosen ? 8 : 6) * ratio, 0, 2 * Math.PI);
        ctx.stroke();
        ctx.strokeStyle = colour;
      }
    });
    ctx.restore();
  }

  /** The point nearest to a place of the plot, within so many pixels. */
  nearest(x, y, within) {
    let best = null, least = within;
    for (const point of this.points) {
      const apart = Math.hypot(this.plot.valToPos(point.x, "x") - x, this.plot.valToPos(point.y, "y") - y);
      if (apart < least) [best, least] = [point, apart];
    }
    return best;
  }

  listen() {
    const { over } = this.plot;
    let pressed = [0, 0];
    const under = (event, within) => {
      const box = over.getBoundingClientRect();
      return this.nearest(event.clientX - box.left, event.clientY - box.top, within);
    };
    over.addEventListener("mousemove", (event) => {
      const point = under(event, 24);
      const home = this.element.getBoundingClientRect();
      if (point) showTip(this.tip, this.element, [event.clientX - home.left, event.clientY - home.top], point.text);
      else this.tip.hidden = true;
    });
    over.addEventListener("mouseleave", () => (this.tip.hidden = true));
    over.addEventListener("mousedown", (event) => (pressed = [event.clientX, event.clientY]));
    over.addEventListener("click", (event) => {
      if (Math.hypot(event.clientX - pressed[0], event.clientY - pressed[1]) > 4) return;
      const point = under(event, 40);
      if (point) point.choose(point);
    });
  }

  choose(point) {
    this.chosen = point;
    this.plot.redraw(false);
  }

  resize() {
    this.plot.setSize({ width: Math.max(220, this.element.clientWidth), height: this.plot.height });
  }
}

/** The page of a comparison: charts of points, a table of settings, and the two linked. */
class ComparePage {
  constructor(told) {
    this.told = told;
    this.rows = [];
    byId("main").hidden = false;
    byId("main").classList.add("wide");
    entitled(told, told.caption);
    this.charts = told.charts.map((chart) => this.chart(chart));
    this.legend();
    this.table();
    this.words();
    window.addEventListener("resize", () => this.charts.forEach((chart) => chart.resize()));
    byId("theme").addEventListener("click", () => this.theme(!isDark()));
    const row = Number(new URLSearchParams(location.hash.slice(1)).get("row"));
    if (row > 0 && row <= told.rows.length) this.choose(row - 1);
  }

  chart({ title, caption, x, y, x_name, y_name, floor, lost }) {
    const points = this.told.rows.flatMap((row, number) => (row[x] > 0 && row[y] > 0 && row.status === "done" ? [{
      series: row.series,
      x: Math.log10(row[x]),
      y: Math.log10(row[y]),
      isMarked: row.pareto && y === "error" && x === "wall_s",
      number,
      text: `${described(row)}\n${row.command || ""}`,
      choose: () => this.choose(number, true),
    }] : []));
    const levels = [];
    if (floor) levels.push([Math.log10(floor[0]), floor[1]]);
    if (lost) levels.push([Math.log10(lost), "lost"]);
    return new Scatter(byId("charts"), { title, caption, x: x_name, y: y_name, logs: [true, true], joined: true, levels }, points);
  }

  legend() {
    const list = make("ul", { id: "series" });
    this.charts[0]?.series.forEach((name, k) => {
      const sign = make("b", { text: SIGNS[Math.floor(k / SERIES.light.length) % SIGNS.length] });
      sign.style.color = seriesColour(k);
      list.append(make("li", {}, sign, ` ${name}`));
    });
    byId("series")?.remove();
    byId("map").hidden = false;
    byId("map").append(list);
  }

  table() {
    const heads = ["setting", "status", "error [rad]", "energy drift", "constraint drift", "run time [s]", "evaluations", "steps"];
    const figure = (value) => (typeof value === "number" ? Number(value.toPrecision(3)).toExponential() : "–");
    const count = (value) => (typeof value === "number" ? String(value) : "–");
    const body = make("tbody");
    this.told.rows.forEach((row, number) => {
      const cells = [row.error, row.energy_drift, row.constraint_drift, row.wall_s].map(figure).concat([row.evaluations, row.steps].map(count));
      const line = make("tr", { id: `row-${number + 1}`, onclick: () => this.choose(number) },
        make("td", { text: `${row.pareto ? "* " : ""}${row.label}` }),
        make("td", { text: row.status.replace("_", " "), title: row.why || "" }),
        ...cells.map((text) => make("td", { class: "figure", text })));
      this.rows.push(line);
      body.append(line);
    });
    this.command = make("div");
    byId("table").hidden = false;
    byId("table").append(make("h2", { text: "Settings" }), this.command, make("table", {}, make("thead", {}, make("tr", {}, ...heads.map((text) => make("th", { text })))), body),
      make("p", { class: "hint", text: "* no other is faster and more accurate" }));
  }

  words() {
    const home = byId("words");
    home.hidden = false;
    const list = make("ul", {}, ...(this.told.advice || []).map((text) => make("li", { text })));
    home.append(make("h2", { text: "To choose" }), list, make("details", {}, make("summary", { text: "report" }), make("pre", { text: this.told.text })));
  }

  /** Marks a setting in the charts and in the table, which scrolls to it where it was chosen in a chart. */
  choose(number, scrolls = false) {
    this.rows.forEach((line, k) => line.classList.toggle("chosen", k === number));
    for (const chart of this.charts) chart.choose(chart.points.find((point) => point.number === number) || null);
    const row = this.told.rows[number];
    this.command.replaceChildren(make("p", { class: "told", text: described(row) }), ...(row.command ? [copied(row.command)] : []));
    if (scrolls) this.rows[number].scrollIntoView({ block: "nearest" });
    linked(`row=${number + 1}`);
  }

  theme(dark) {
    document.documentElement.classList.toggle("dark", dark);
    this.charts.forEach((chart) => chart.show());
    this.legend();
  }
}

/** A setting in words. */
function described(row) {
  const size = (value) => (typeof value === "number" ? Number(value.toPrecision(3)).toExponential() : null);
  const parts = [row.label];
  if (row.status !== "done") parts.push(row.status.replace("_", " ") + (row.why ? `: ${row.why}` : ""));
  if (size(row.error)) parts.push(`error ${size(row.error)} rad`);
  if (size(row.energy_drift)) parts.push(`energy drift ${size(row.energy_drift)}`);
  if (row.wall_s) parts.push(`${size(row.wall_s)} s`);
  if (row.evaluations) parts.push(`${row.evaluations} evaluations`);
  return parts.join(" · ");
}

/** The address says what is shown. */
function linked(hash) {
  try {
    history.replaceState(null, "", `#${hash}`);
  } catch {
    // Some browsers keep pages from files from changing their address.
  }
}

// ---------------------------------------------------------------------------------------------- sweeps

// Dark to light, each step as far from the next to all eyes.
const SCALE = [[68, 1, 84], [65, 68, 135], [42, 120, 142], [34, 168, 132], [122, 209, 81], [253, 231, 37]];

/** A colour of the scale, 0 the darkest. */
function scaled(share) {
  const place = Math.min(1, Math.max(0, share)) * (SCALE.length - 1);
  const k = Math.min(SCALE.length - 2, Math.floor(place));
  return SCALE[k].map((low, n) => Math.round(low + (place - k) * (SCALE[k + 1][n] - low)));
}

/** Value number `k` of an axis, to the bit as the sweep has it. */
function axisValue({ from, to, count }, k) {
  const last = count - 1;
  if (k <= 0) return from;
  if (k >= last) return to;
  if (from === -to) return (to * (k - (last - k))) / last;
  return from * ((last - k) / last) + to * (k / last);
}

/** A sweep over two values: a colour for each point, rings where the motion is kept. */
class FieldMap {
  constructor(page, home) {
    this.page = page;
    this.element = make("div", { class: "chart" });
    this.canvas = make("canvas", { tabindex: "0", "aria-label": "Map; arrows go from point to point" });
    this.tip = make("div", { class: "tip", role: "status" });
    this.tip.hidden = true;
    this.element.append(make("h3", { text: page.told.title }), this.canvas, this.tip);
    home.append(this.element);
    this.margin = [62, 10, 74, 44];
    this.font = "11px system-ui, sans-serif";
    this.measure();
    this.listen();
    this.show();
  }

  /** Room for the labels of the upright axis and of the colours, and for the names beside them. */
  measure() {
    const context = this.canvas.getContext("2d");
    context.font = this.font;
    const widest = (ticks) => ticks.reduce((width, [, text]) => Math.max(width, context.measureText(text).width), 0);
    const { axes, colours } = this.page.told;
    this.margin[0] = Math.ceil(widest(axes[1].ticks)) + 30;
    this.room = Math.ceil(widest(colours?.ticks ?? []));
    this.margin[2] = colours ? 14 + 12 + 8 + this.room + 24 : 14;
  }

  /** The points as a picture, a pixel each. */
  picture() {
    const [x, y] = this.page.told.axes;
    const picture = make("canvas", { width: x.count, height: y.count });
    const context = picture.getContext("2d");
    const pixels = context.createImageData(x.count, y.count);
    for (let i = 0; i < x.count; i++) {
      for (let j = 0; j < y.count; j++) {
        pixels.data.set([...this.page.colour(i * y.count + j), 255], 4 * ((y.count - 1 - j) * x.count + i));
      }
    }
    context.putImageData(pixels, 0, 0);
    return picture;
  }

  show() {
    this.cells = this.picture();
    this.resize();
  }

  resize() {
    const ratio = window.devicePixelRatio || 1;
    this.width = this.element.clientWidth;
    this.height = Math.round(Math.min(520, 0.8 * this.width));
    this.canvas.style.height = `${this.height}px`;
    [this.canvas.width, this.canvas.height] = [Math.round(ratio * this.width), Math.round(ratio * this.height)];
    this.draw(ratio);
  }

  /** Left, upper edge, width and height of the field. */
  field() {
    const [left, top, right, bottom] = this.margin;
    return [left, top, Math.max(10, this.width - left - right), Math.max(10, this.height - top - bottom)];
  }

  draw(ratio = window.devicePixelRatio || 1) {
    const context = this.canvas.getContext("2d");
    const colours = palette();
    const [left, top, width, height] = this.field();
    const { told } = this.page;
    const [x, y] = told.axes;
    context.setTransform(ratio, 0, 0, ratio, 0, 0);
    context.fillStyle = colours.paper;
    context.fillRect(0, 0, this.width, this.height);
    context.imageSmoothingEnabled = false;
    context.drawImage(this.cells, left, top, width, height);
    context.strokeStyle = colours.grey;
    context.strokeRect(left - 0.5, top - 0.5, width + 1, height + 1);
    context.fillStyle = colours.grey;
    context.font = this.font;
    context.textAlign = "center";
    for (const [share, text] of x.ticks) {
      context.fillRect(Math.round(left + share * width) - 0.5, top + height, 1, 4);
      context.fillText(text, left + share * width, top + height + 17);
    }
    context.textAlign = "right";
    for (const [share, text] of y.ticks) {
      const at = top + (1 - share) * height;
      context.fillRect(left - 4, Math.round(at) - 0.5, 4, 1);
      context.fillText(text, left - 8, at + 4);
    }
    context.font = "12px system-ui, sans-serif";
    context.textAlign = "center";
    context.fillText(labelled(x), left + 0.5 * width, top + height + 36);
    this.upright(context, labelled(y), [12, top + 0.5 * height]);
    if (told.colours) this.scale(context, [left + width + 14, top, height], colours);
    for (const index of told.cells) this.ring(context, index, colours.paper, 2.6);
    this.ring(context, this.page.asked, "#ffffff", 7.5);
    this.ring(context, this.page.asked, "#d55e00", 6);
  }

  /** Words that run upwards. */
  upright(context, text, [x, y]) {
    context.save();
    context.translate(x, y);
    context.rotate(-0.5 * Math.PI);
    context.textAlign = "center";
    context.fillText(text, 0, 0);
    context.restore();
  }

  scale(context, [left, top, height], colours) {
    const { name, ticks } = this.page.told.colours;
    for (let k = 0; k < height; k++) {
      context.fillStyle = `rgb(${this.page.shade(1 - k / height).join(",")})`;
      context.fillRect(left, top + k, 12, 1.5);
    }
    context.fillStyle = colours.grey;
    context.textAlign = "left";
    context.font = this.font;
    for (const [share, text] of ticks) {
      const at = top + (1 - share) * height;
      context.fillRect(left + 12, Math.round(at) - 0.5, 4, 1);
      context.fillText(text, left + 20, at + 4);
    }
    context.font = "12px system-ui, sans-serif";
    this.upright(context, name, [left + 20 + this.room + 16, top + 0.5 * height]);
  }

  ring(context, index, colour, radius) {
    const [left, top, width, height] = this.field();
    const [x, y] = this.page.told.axes;
    const [i, j] = [Math.floor(index / y.count), index % y.count];
    context.beginPath();
    context.arc(left + ((i + 0.5) / x.count) * width, top + height - ((j + 0.5) / y.count) * height, radius, 0, 2 * Math.PI);
    context.strokeStyle = colour;
    context.lineWidth = 1.6;
    context.stroke();
  }

  /** The point at a place of the canvas; null beside the field. */
  under(event) {
    const box = this.canvas.getBoundingClientRect();
    const [left, top, width, height] = this.field();
    const [x, y] = this.page.told.axes;
    const i = Math.floor(((event.clientX - box.left - left) / width) * x.count);
    const j = Math.floor((1 - (event.clientY - box.top - top) / height) * y.count);
    return i >= 0 && i < x.count && j >= 0 && j < y.count ? i * y.count + j : null;
  }

  listen() {
    this.canvas.addEventListener("mousemove", (event) => {
      const index = this.under(event);
      const home = this.element.getBoundingClientRect();
      if (index === null) this.tip.hidden = true;
      else showTip(this.tip, this.element, [event.clientX - home.left, event.clientY - home.top], this.page.described(index));
    });
    this.canvas.addEventListener("mouseleave", () => (this.tip.hidden = true));
    this.canvas.addEventListener("click", (event) => {
      const index = this.under(event);
      if (index !== null) this.page.choose(index);
    });
    this.canvas.addEventListener("keydown", (event) => {
      const [x, y] = this.page.told.axes;
      const [i, j] = [Math.floor(this.page.asked / y.count), this.page.asked % y.count];
      const [right, up] = { ArrowRight: [1, 0], ArrowLeft: [-1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] }[event.key] || [];
      if (right === undefined) return;
      event.preventDefault();
      event.stopPropagation();
      this.page.choose(Math.min(x.count - 1, Math.max(0, i + right)) * y.count + Math.min(y.count - 1, Math.max(0, j + up)));
    });
  }
}

/** The page of a sweep: its map or profile, and the motion of the point chosen. */
class SweepPage {
  constructor(told, bytes) {
    this.told = told;
    this.bytes = bytes;
    const table = told.tables[told.tables.length - 1];
    let zeros;
    [this.values, this.failed, zeros] = table.columns.map((column) => unpacked(column, table.rows, bytes));
    // The logarithm of a zero is below all others.
    zeros.forEach((isZero, k) => isZero && (this.values[k] = -Infinity));
    const known = this.values.filter((value) => Number.isFinite(value));
    this.low = known.reduce((a, b) => Math.min(a, b), Infinity);
    this.high = known.reduce((a, b) => Math.max(a, b), -Infinity);
    if (told.colours) [this.low, this.high] = [told.colours.from, told.colours.to];
    if (!(this.high > this.low)) [this.low, this.high] = known.length ? [this.low, this.low + (0.1 * Math.abs(this.low) || 1)] : [0, 1];
    this.isBlank = known.length === 0;
    this.page = new Page();
    byId("main").hidden = false;
    const home = byId("map");
    home.hidden = false;
    this.asked = told.cells[told.cells.length >> 1] ?? 0;
    this.chart = told.axes.length === 2 ? new FieldMap(this, home) : this.profile(home);
    this.line = make("p", { class: "told", role: "status" });
    this.command = make("div");
    home.append(this.keys(), this.line, this.command);
    byId("table").hidden = false;
    byId("table").append(make("details", {}, make("summary", { text: "report" }), make("pre", { text: told.text })));
    entitled(told, told.caption);
    const cell = new URLSearchParams(location.hash.slice(1)).get("cell");
    const wanted = cell === null ? NaN : Number(cell) - 1;
    if (told.cells.length) {
      this.choose(wanted >= 0 && wanted < table.rows ? Math.floor(wanted) : this.asked, false);
      this.page.begin();
    } else {
      byId("main").classList.add("wide");
    }
    const resize = () => this.chart.resize();
    window.addEventListener("resize", resize);
    byId("theme").addEventListener("click", () => this.chart.show());
  }

  /** A colour of the scale, for a share of the range. */
  shade(share) {
    return scaled(this.told.high_is_dark ? 1 - share : share);
  }

  colour(index) {
    const value = this.values[index];
    if (!Number.isNaN(value)) return this.shade((value - this.low) / (this.high - this.low));
    if (this.failed[index]) return [213, 94, 0];
    return isDark() ? [70, 78, 88] : [214, 218, 222];
  }

  keys() {
    const entry = (colour, text) => {
      const swatch = make("i");
      swatch.style.background = colour;
      return make("li", {}, swatch, text);
    };
    const list = make("ul", { class: "keys" });
    if (this.values.some((value, k) => Number.isNaN(value) && !this.failed[k])) list.append(entry("#9aa3ad", this.told.never));
    if (this.failed.some((failed) => failed)) list.append(entry("#d55e00", "stopped or refused"));
    const { cells } = this.told;
    const all = cells.length === this.values.length;
    list.append(make("li", { text: all ? "click a point to see it move" : `click a point to see it move: motions of ${cells.length} points are kept, ringed` }));
    return list;
  }

  profile(home) {
    const [axis] = this.told.axes;
    const kept = new Set(this.told.cells);
    // Points without a number stand on the upper edge, zeros among logarithms on the lower one.
    const air = 0.06 * (this.high - this.low);
    const points = Array.from(this.values, (value, index) => ({
      series: !Number.isNaN(value) ? this.told.value : this.failed[index] ? "failed" : "none",
      x: axisValue(axis, index),
      y: Number.isNaN(value) ? this.high + air : Math.max(value, this.low - air),
      isMarked: kept.has(index) && kept.size < this.values.length,
      index,
      text: this.described(index),
      choose: () => this.choose(index),
    }));
    return new Scatter(home, { title: this.told.title, x: labelled(axis), y: this.told.value, logs: [false, this.told.log], joined: false, isBlank: this.isBlank, height: 300, colours: { none: () => palette().grey, failed: () => "#d55e00" } }, points);
  }

  /** The values of a point, and what came of it. */
  described(index) {
    const { axes, value, log, never } = this.told;
    const counts = axes.length === 2 ? [Math.floor(index / axes[1].count), index % axes[1].count] : [index];
    const places = axes.map((axis, k) => `${axis.name} = ${Number(axisValue(axis, counts[k]).toPrecision(6))}${axis.unit ? ` ${axis.unit}` : ""}`);
    const number = this.values[index];
    const [name, unit] = value.replace("]", "").split(" [");
    const known = `${name} ${Number((log ? 10 ** number : number).toPrecision(4))}${unit && unit !== "1" ? ` ${unit}` : ""}`;
    const told = !Number.isNaN(number) ? known : this.failed[index] ? "stopped or refused" : never;
    return `${places.join(", ")}: ${told}`;
  }

  /** The command line that makes the run of a point. */
  commandOf(index) {
    const { axes, command } = this.told;
    const counts = axes.length === 2 ? [Math.floor(index / axes[1].count), index % axes[1].count] : [index];
    return [command, ...axes.map((axis, k) => `--set ${axis.name}=${axisValue(axis, counts[k])}`)].join(" ");
  }

  /** Of the points whose motion is kept the nearest. */
  nearest(index) {
    const { axes, cells } = this.told;
    const across = axes.length === 2 ? axes[1].count : 1;
    const long = (a, b) => Math.hypot((Math.floor(a / across) - Math.floor(b / across)) / axes[0].count, axes.length === 2 ? (a % across - b % across) / across : 0);
    return cells.reduce((best, cell) => (long(cell, index) < long(best, index) ? cell : best), cells[0]);
  }

  /** Shows the motion of a point, or of the nearest whose motion is kept, and plays it. */
  choose(index, plays = true) {
    this.asked = index;
    const { told, page } = this;
    if (this.chart instanceof Scatter) this.chart.choose(this.chart.points.find((point) => point.index === index) || null);
    else this.chart.draw();
    const cell = this.nearest(index);
    this.line.textContent = this.described(index)
      + (cell === undefined ? "" : cell === index ? "" : `; shown is the nearest point whose motion is kept, ${this.described(cell)}`);
    this.command.replaceChildren(copied(this.commandOf(index)));
    if (cell === undefined) return;
    const k = told.cells.indexOf(cell);
    page.time = 0;
    page.place = `cell=${index + 1}&`;
    // The command of the point itself stands beside the map.
    const command = cell === index ? "" : this.commandOf(cell);
    page.present([opened({ ...told.runs[k], command }, told.tables[k], this.bytes)]);
    if (!plays) return;
    page.play(true);
    linked(`cell=${index + 1}`);
  }
}

// ---------------------------------------------------------------------------------------------- start

async function start() {
  const data = JSON.parse(byId("data").textContent);
  const bytes = await inflated(byId("numbers").textContent);
  document.documentElement.classList.toggle("dark", matchMedia("(prefers-color-scheme: dark)").matches);
  const pages = {
    // Another script's, where the page has it.
    playground: async () => {
      const page = new Playground(data, bytes);
      await page.ready;
      return page;
    },
    compare: () => new ComparePage(data),
    sweep: () => new SweepPage(data, bytes),
    runs: () => {
      const page = new Page();
      page.open(data.runs.map((run, k) => opened(run, data.tables[k], bytes)));
      return page;
    },
  };
  window.driftless = await pages[data.kind]();
  const told = (word) => (document.documentElement.dataset[word] = String(Math.round(performance.now())));
  // What is in view is there; the rest follows.
  told("ready");
  await window.driftless.isComplete;
  told("complete");
}

start().catch((error) => {
  byId("trouble").hidden = false;
  byId("trouble").textContent = `This page could not be shown: ${error.message}`;
  console.error(error);
});

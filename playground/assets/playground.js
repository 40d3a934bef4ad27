"use strict";
// The playground: a scene that can be edited, integrated by the core while it is looked at.  What draws is the
// script of the pages of runs, which comes after this one and starts both.

/** The core: text and numbers go through its memory. */
class Core {
  static async open(bytes) {
    const { instance } = await WebAssembly.instantiate(bytes, {});
    return new Core(instance.exports);
  }

  constructor(exports) {
    this.exports = exports;
  }

  text() {
    const { memory, text, text_length } = this.exports;
    return new TextDecoder().decode(new Uint8Array(memory.buffer, text(), text_length()));
  }

  /** Time, drift, residual, then angle and centre of each body. */
  numbers() {
    const { memory, numbers, numbers_length } = this.exports;
    return Float64Array.from(new Float64Array(memory.buffer, numbers(), numbers_length()));
  }

  /** Reads a scene; throws its message. */
  read(scene) {
    const bytes = new TextEncoder().encode(scene);
    const place = this.exports.room(bytes.length);
    new Uint8Array(this.exports.memory.buffer, place, bytes.length).set(bytes);
    if (this.exports.open() === 0) throw new Error(this.text());
    return JSON.parse(this.text());
  }

  /** Integrates on for so many rows; false at the end. */
  advance(rows) {
    const told = this.exports.advance(rows);
    if (told === 0) throw new Error(this.text());
    return told === 1;
  }

  schema() {
    this.exports.schema();
    return JSON.parse(this.text());
  }
}

/** Rows a second, and those remembered for charts and paths. */
const RATE = 64, REMEMBERED = 1920;
/** Longest the core may work for one frame [ms]. */
const WORK = 12;

/** Rows as they come, drawn like those of a run. */
class LiveRun {
  constructor(told, numbers) {
    this.geometry = told.geometry;
    this.horizon = null;
    this.rows = [numbers];
    this.t = [numbers[0]];
    this.trailRows = 96;
    // What draws a run asks this of it.
    this.motion = { begin: 0, end: 1, isCoarse: false, atRow: (row) => this.rows[row].subarray(3), at: (t) => this.pose(t) };
  }

  add(numbers) {
    this.rows.push(numbers);
    this.t.push(numbers[0]);
    if (this.rows.length > REMEMBERED) {
      this.rows.shift();
      this.t.shift();
    }
    this.motion.end = this.rows.length;
  }

  pose(t) {
    const row = rowAt(this.t, t);
    const next = Math.min(row + 1, this.rows.length - 1);
    const share = next > row ? Math.min(1, Math.max(0, (t - this.t[row]) / (this.t[next] - this.t[row]))) : 0;
    return this.rows[row].subarray(3).map((value, k) => value + share * (this.rows[next][3 + k] - value));
  }
}

class Playground {
  constructor(told, bytes) {
    this.told = told;
    this.speed = 1;
    this.isPlaying = false;
    this.ready = Core.open(bytes).then((core) => this.begin(core));
  }

  begin(core) {
    this.core = core;
    this.schema = core.schema();
    byId("main").hidden = false;
    const list = byId("scenes");
    this.told.scenes.forEach((text, k) => list.append(make("option", { value: String(k), text: JSON.parse(text).name })));
    list.addEventListener("change", () => this.load(this.told.scenes[Number(list.value)]));
    const editor = byId("scene");
    editor.addEventListener("input", () => {
      clearTimeout(this.typing);
      this.typing = setTimeout(() => this.read(), 300);
    });
    for (const kind of ["keyup", "click", "input"]) editor.addEventListener(kind, () => this.help());
    byId("play").addEventListener("click", () => this.play(!this.isPlaying));
    byId("reset").addEventListener("click", () => this.read());
    byId("speed").addEventListener("input", (event) => this.setSpeed(10 ** Number(event.target.value)));
    byId("theme").addEventListener("click", () => {
      document.documentElement.classList.toggle("dark", !isDark());
      this.chart();
      this.resize();
    });
    document.addEventListener("keydown", (event) => {
      if (event.key !== " " || ["TEXTAREA", "SELECT", "BUTTON"].includes(event.target.tagName)) return;
      event.preventDefault();
      this.play(!this.isPlaying);
    });
    window.addEventListener("resize", () => this.resize());
    this.drags();
    this.load(this.told.scenes[0]);
    this.setSpeed(1);
  }

  load(text) {
    byId("scene").value = text;
    this.read();
    this.help();
  }

  /** Reads the editor's scene and puts it at its start; a message where it is none. */
  read() {
    this.play(false);
    try {
      const told = this.core.read(byId("scene").value);
      this.say(null);
      this.run = new LiveRun(told, this.core.numbers());
      this.time = this.run.t[0];
      this.stage = new Stage(byId("mechanism"), [this.run]);
      this.widen();
      byId("title").textContent = told.description ? `${told.scene}: ${told.description}` : told.scene;
      byId("remark").textContent = [told.method, ...told.notes].join("; ");
      this.chart();
      this.frame();
    } catch (error) {
      this.say(error.message);
    }
  }

  /** As much of the world as the mechanism can reach, about. */
  widen() {
    const { stage, run } = this;
    const reach = run.geometry.bodies.reduce((sum, { ends: [p, q] }) => sum + Math.hypot(q[0] - p[0], q[1] - p[1]), 0);
    const grounded = run.geometry.hinges.filter((hinge) => hinge.ground).map((hinge) => stage.rotated(located(hinge.at, run.pose(this.time))));
    for (const [u, h] of grounded) {
      stage.box = [Math.min(stage.box[0], u - reach), Math.max(stage.box[1], u + reach), Math.min(stage.box[2], h - reach), Math.max(stage.box[3], h + reach)];
    }
    stage.resize();
  }

  say(message) {
    byId("message").hidden = message === null;
    byId("message").textContent = message || "";
    byId("scene").classList.toggle("wrong", message !== null);
  }

  /** The description of the key at the caret, from the schema. */
  help() {
    const editor = byId("scene");
    const path = pathAt(editor.value, editor.selectionStart);
    let schema = this.schema, found = null;
    for (const key of path) {
      const choices = [schema, ...(schema.oneOf || []), ...(schema.anyOf || [])];
      const next = choices.map((one) => (typeof key === "number" ? one.items || one.prefixItems?.[key] : one.properties?.[key] ?? (typeof one.additionalProperties === "object" ? one.additionalProperties : undefined))).find((one) => one);
      if (!next) break;
      schema = next;
      if (schema.description) found = [key, schema];
    }
    const range = ({ minimum, exclusiveMinimum, maximum }) => [minimum !== undefined && `from ${minimum}`, exclusiveMinimum !== undefined && `above ${exclusiveMinimum}`, maximum !== undefined && `to ${maximum}`].filter(Boolean).join(" ");
    byId("help").textContent = found
      ? [`${path.filter((key) => typeof key === "string").join(".")}: ${found[1].description}`, range(found[1]), found[1].examples && `for example ${JSON.stringify(found[1].examples[0])}`].filter(Boolean).join("; ")
      : this.schema.description;
  }

  setSpeed(speed) {
    this.speed = speed;
    byId("speed").value = String(Math.log10(speed));
    byId("factor").textContent = `${Number(speed.toPrecision(2))} ×`;
  }

  chart() {
    byId("charts").replaceChildren();
    this.plot?.destroy();
    const axis = { stroke: palette().grey, grid: { stroke: palette().grid, width: 1 }, font: "11px system-ui, sans-serif" };
    const drift = (label, colour, dash) => ({ label, stroke: colour, dash, width: 1.6, points: { show: false }, value: (_, value) => (value === null || value === undefined ? "0" : (10 ** value).toExponential(1)) });
    byId("charts").append(make("h3", { text: "Energy drift and largest residual" }));
    this.plot = new uPlot({
      width: Math.max(220, byId("charts").clientWidth),
      height: 190,
      scales: { x: { time: false }, y: { range: (_, low, high) => (low === null ? [-17, -12] : [Math.floor(low - 0.2), Math.ceil(high + 0.2)]) } },
      axes: [{ ...axis, values: (_, splits) => splits.map((t) => `${t} s`) }, { ...axis, size: 56, incrs: [1, 2, 3, 5, 10], values: (_, splits) => splits.map(tenTo) }],
      series: [{ label: "t [s]", value: (_, t) => (t === null ? "–" : t.toFixed(2)) }, drift("energy", seriesColour(0)), drift("residual", seriesColour(1), [7, 4])],
    }, this.lines(), byId("charts"));
  }

  lines() {
    const log = (value) => (value === 0 ? null : Math.log10(Math.abs(value)));
    return [this.run.t, this.run.rows.map((row) => log(row[1])), this.run.rows.map((row) => log(row[2]))];
  }

  play(wanted) {
    this.isPlaying = wanted;
    byId("play").textContent = wanted ? "❚❚" : "▶";
    this.before = null;
    if (wanted) requestAnimationFrame((at) => this.tick(at));
  }

  /** A frame of the motion: integrates up to its time, as far as there is time for it. */
  tick(at) {
    if (!this.isPlaying) return;
    const { run, core } = this;
    if (this.before !== null) this.time += Math.min(0.1, (at - this.before) / 1000) * this.speed;
    this.before = at;
    const begin = performance.now(), from = run.t[run.t.length - 1];
    try {
      while (run.t[run.t.length - 1] < this.time && performance.now() - begin < WORK) {
        const goesOn = core.advance(1);
        const numbers = core.numbers();
        if (numbers[0] > run.t[run.t.length - 1]) run.add(numbers);
        if (!goesOn) this.play(false);
        if (!goesOn) break;
      }
    } catch (error) {
      this.say(error.message);
      this.play(false);
    }
    const last = run.t[run.t.length - 1];
    this.time = Math.min(this.time, last);
    const worked = performance.now() - begin;
    this.pace = worked > 0 && last > from ? 0.95 * (this.pace || (1000 * (last - from)) / worked) + (0.05 * 1000 * (last - from)) / worked : this.pace;
    this.frame(at);
    if (this.isPlaying) requestAnimationFrame((next) => this.tick(next));
  }

  frame(at = 0) {
    this.stage.draw(this.time, true);
    byId("clock").textContent = `${this.time.toFixed(2)} s`;
    if (at - (this.told_at || 0) < 250 && this.isPlaying) return;
    this.told_at = at;
    this.plot.setData(this.lines());
    if (this.pace) byId("pace").textContent = `integrated at ${Number(this.pace.toPrecision(2))} times real time`;
  }

  resize() {
    this.plot?.setSize({ width: Math.max(220, byId("charts").clientWidth), height: 190 });
    this.widen();
    this.frame();
  }

  /** Bars turn under the mouse; where they are let go is the new start. */
  drags() {
    const canvas = byId("mechanism");
    let held = null;
    const place = (event) => {
      const box = canvas.getBoundingClientRect();
      return [event.clientX - box.left, event.clientY - box.top];
    };
    canvas.addEventListener("pointerdown", (event) => {
      if (!this.run) return;
      const [x, y] = place(event);
      const pose = this.run.pose(this.time);
      let least = 24;
      this.run.geometry.bodies.forEach((body, k) => {
        const [a, b] = barEnds(k, body.ends, pose).map((end) => this.stage.at(end));
        const along = Math.min(1, Math.max(0, ((x - a[0]) * (b[0] - a[0]) + (y - a[1]) * (b[1] - a[1])) / (Math.hypot(b[0] - a[0], b[1] - a[1]) ** 2 || 1)));
        const apart = Math.hypot(a[0] + along * (b[0] - a[0]) - x, a[1] + along * (b[1] - a[1]) - y);
        if (apart < least) [held, least] = [{ body: k, origin: a }, apart];
      });
      if (held) canvas.setPointerCapture(event.pointerId);
      if (held) this.play(false);
    });
    canvas.addEventListener("pointermove", (event) => {
      if (!held) return;
      const [x, y] = place(event);
      this.turn(held.body, this.stage.angle([x - held.origin[0], y - held.origin[1]]));
    });
    const drop = () => (held = null);
    canvas.addEventListener("pointerup", drop);
    canvas.addEventListener("pointercancel", drop);
  }

  /** Gives a body another angle at the start: in the editor's text, which is read again. */
  turn(body, phi) {
    let scene;
    try {
      scene = JSON.parse(byId("scene").value);
    } catch {
      return;
    }
    const { name } = this.run.geometry.bodies[body];
    scene.start = { ...scene.start, [name]: { ...scene.start?.[name], phi: Number(phi.toFixed(3)) } };
    byId("scene").value = scenic(scene);
    this.read();
  }
}

/** A scene as text: a line for each entry of a list and each body. */
function scenic(scene) {
  const inner = (value) => JSON.stringify(value, null, 1).replace(/\n\s*/g, " ").replace(/\{ /g, "{").replace(/ \}/g, "}").replace(/\[ /g, "[").replace(/ \]/g, "]");
  const entries = Object.entries(scene).map(([key, value]) => {
    if (Array.isArray(value) && value.some((one) => typeof one === "object")) return `  ${JSON.stringify(key)}: [\n${value.map((one) => `    ${inner(one)}`).join(",\n")}\n  ]`;
    if (key === "start") return `  "start": {\n${Object.entries(value).map(([name, one]) => `    ${JSON.stringify(name)}: ${inner(one)}`).join(",\n")}\n  }`;
    return `  ${JSON.stringify(key)}: ${inner(value)}`;
  });
  return `{\n${entries.join(",\n")}\n}\n`;
}

/** The keys and indices that lead to a place of a JSON text, which may be unfinished. */
function pathAt(text, place) {
  const path = [];
  let key = null, k = 0;
  while (k < place) {
    const sign = text[k];
    if (sign === '"') {
      let end = k + 1;
      while (end < text.length && text[end] !== '"') end += text[end] === "\\" ? 2 : 1;
      const word = text.slice(k + 1, end);
      const isKey = /^\s*:/.test(text.slice(end + 1));
      if (isKey) key = word;
      k = end + 1;
      continue;
    }
    if (sign === "{" || sign === "[") {
      path.push(key, sign === "[" ? 0 : null);
      key = null;
    } else if (sign === "}" || sign === "]") {
      path.splice(-2);
      key = null;
    } else if (sign === ",") {
      if (typeof path[path.length - 1] === "number") path[path.length - 1] += 1;
      key = null;
    }
    k += 1;
  }
  return [...path, key].filter((one) => one !== null);
}

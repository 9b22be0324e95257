// -- the model in WebAssembly: one motion, its start, steps and values; needs no page -----------------------------------

/** Products of quaternions (w, x, y, z). */
const quaternionTimes = ([a, b, c, d], [e, f, g, h]) => [a * e - b * f - c * g - d * h, a * f + b * e + c * h - d * g, a * g - b * h + c * e + d * f, a * h + b * g - c * f + d * e];
const crossOf = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const rotatedBy = ([w, ...axis], a) => {
  const first = crossOf(axis, a).map((value, k) => value + w * a[k]);
  return crossOf(axis, first).map((value, k) => a[k] + 2 * value);
};

/** The quaternion of a rotation vector. */
function turnBy(vector) {
  const half = Math.hypot(...vector) / 2;
  const scale = half > 1e-8 ? Math.sin(half) / (2 * half) : 0.5;
  return [Math.cos(half), ...vector.map((value) => scale * value)];
}

/** The rotation vector of a quaternion, of at most half a turn. */
function turnOf([w, ...axis]) {
  const sign = w < 0 ? -1 : 1;
  const size = Math.hypot(...axis);
  const scale = size > 1e-12 ? (2 * Math.atan2(size, sign * w)) / size : 2;
  return axis.map((value) => sign * scale * value);
}

/** Pose after a pose: quaternion first, then position. */
const poseTimes = (a, b) => [...quaternionTimes(a.slice(0, 4), b.slice(0, 4)), ...rotatedBy(a.slice(0, 4), b.slice(4)).map((value, k) => a[4 + k] + value)];
const inversePose = (a) => {
  const back = [a[0], -a[1], -a[2], -a[3]];
  return [...back, ...rotatedBy(back, a.slice(4)).map((value) => -value)];
};

/** The pose of a screw, rotation first: exp on SE(3). */
function poseOf(screw) {
  const [turn, along] = [screw.slice(0, 3), screw.slice(3)];
  const angle = Math.hypot(...turn);
  const [b, c] = angle > 1e-4 ? [(1 - Math.cos(angle)) / angle ** 2, (angle - Math.sin(angle)) / angle ** 3] : [0.5 - angle ** 2 / 24, 1 / 6 - angle ** 2 / 120];
  const first = crossOf(turn, along);
  const second = crossOf(turn, first);
  return [...turnBy(turn), ...along.map((value, k) => value + b * first[k] + c * second[k])];
}

/** The screw of a pose: log on SE(3). */
function screwOf(pose) {
  const [turn, place] = [turnOf(pose.slice(0, 4)), pose.slice(4)];
  const angle = Math.hypot(...turn);
  const half = angle / 2;
  const c = angle > 1e-4 ? (1 - half / Math.tan(half)) / angle ** 2 : 1 / 12 + angle ** 2 / 720;
  const first = crossOf(turn, place);
  const second = crossOf(turn, first);
  return [...turn, ...place.map((value, k) => value - first[k] / 2 + c * second[k])];
}

/** A configuration moved by a step in body axes, factor by factor. */
function movedBy(factors, q, step) {
  const result = Float64Array.from(q);
  for (const { group, q_start, q_size, v_start, v_size } of factors) {
    const [here, by] = [Array.from(q.slice(q_start, q_start + q_size)), Array.from(step.slice(v_start, v_start + v_size))];
    if (group === "R") result.set(here.map((value, k) => value + by[k]), q_start);
    else if (by.some((value) => value !== 0)) {
      const moved = group === "SO3" ? quaternionTimes(here, turnBy(by)) : poseTimes(here, poseOf(by));
      const length = Math.hypot(...moved.slice(0, 4));
      result.set(moved.map((value, k) => (k < 4 ? value / length : value)), q_start);
    }
  }
  return result;
}

/** The solution of a symmetric system A x = b by elimination with pivots; directions without a pivot are left alone. */
function solved(matrix, right) {
  const [size, rows, x] = [right.length, matrix.map((row) => Float64Array.from(row)), Float64Array.from(right)];
  const scale = Math.max(...rows.map((row, k) => Math.abs(row[k])), Number.MIN_VALUE);
  const [left, order] = [new Set(rows.keys()), []];
  while (left.size) {
    const pivot = [...left].reduce((best, k) => (Math.abs(rows[k][k]) > Math.abs(rows[best][best]) ? k : best));
    left.delete(pivot);
    if (!(Math.abs(rows[pivot][pivot]) > 1e-11 * scale)) break;
    order.push(pivot);
    for (const k of left) {
      const factor = rows[k][pivot] / rows[pivot][pivot];
      if (factor === 0) continue;
      for (let j = 0; j < size; j++) rows[k][j] -= factor * rows[pivot][j];
      x[k] -= factor * x[pivot];
    }
  }
  const result = new Float64Array(size);
  for (const k of order.reverse()) {
    let rest = x[k];
    for (let j = 0; j < size; j++) if (j !== k) rest -= rows[k][j] * result[j];
    result[k] = rest / rows[k][k];
  }
  return result;
}

/** The exports of a compiled module, gzip in base64. */
async function exportsOf(text) {
  const packed = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const plain = new Response(new Blob([packed]).stream().pipeThrough(new DecompressionStream("gzip")));
  const compiled = await WebAssembly.compile(await plain.arrayBuffer());
  const imports = {};
  for (const { module, name } of WebAssembly.Module.imports(compiled)) {
    imports[module] = imports[module] || {};
    imports[module][name] = () => { throw new Error(`the model calls ${name}, which a page does not have`); };
  }
  const { exports } = await WebAssembly.instantiate(compiled, imports);
  if (exports._initialize) exports._initialize();
  return exports;
}

/** A motion of the model. `data` is what Python wrote: names and sizes of blocks, settings, parameters, the start. */
class Motion {
  constructor(exports, data) {
    [this.code, this.data] = [exports, data];
    this.blocks = {};
    data.blocks.forEach(([name, size], k) => (this.blocks[name] = new Float64Array(exports.memory.buffer, exports.block(k), size)));
    this.parameters = Float64Array.from(data.parameters);
    this.held = Float64Array.from(data.held, (value) => (value === null ? NaN : value));
    this.displaced = new Float64Array(data.v.length); // turns and shifts of the start, in body axes
    this.given = new Map(); // other coordinates of the start, by their places in q
    this.v = Float64Array.from(data.v);
    this.z = Float64Array.from(data.z);
    this.touched = new Set(); // coordinates of the start that the viewer has chosen
    this.spun = new Set(); // and velocities
  }

  get row() { return this.blocks.row_of_motion; }
  get t() { return this.row[0]; }
  get q() { return this.row.subarray(1, 1 + this.data.q.length); }
  get velocities() { return this.row.subarray(1 + this.data.q.length, 1 + this.data.q.length + this.data.v.length); }

  text(status) {
    const [letters, start] = [new Uint8Array(this.code.memory.buffer), this.code.text(status)];
    return new TextDecoder().decode(letters.subarray(start, letters.indexOf(0, start)));
  }

  /** Write parameters and held inputs. */
  set() {
    this.blocks.parameters.set(this.parameters);
    if (this.held.length) this.blocks.held.set(this.held);
    this.blocks.settings.set(this.data.settings);
  }

  /** Start anew. Returns an empty text, or why there is no start. */
  start() {
    this.set();
    const { factors, q, t } = this.data;
    const asked = movedBy(factors, Float64Array.from(q), this.displaced);
    for (const [place, value] of this.given) asked[place] = value;
    const same = this.touched.size === 0 && this.spun.size === 0 && this.parameters.every((value, k) => value === this.data.parameters[k]);
    if (same) [this.blocks.start_q, this.blocks.start_v].forEach((block, k) => block.set([q, this.data.v][k]));
    else {
      const fault = this.closed(asked, this.v, t, this.touched, this.spun);
      if (fault) return fault;
    }
    if (this.z.length) this.blocks.start_z.set(this.z);
    const status = this.code.start(t);
    return status ? `there is no start here: ${this.text(status)}` : "";
  }

  /** Write the state nearest to another one that meets the constraints as the start; kept coordinates do not
   * change unless the constraints have no other solution. Returns an empty text, or the fault. */
  closed(q, v, t, kept, spun) {
    const { start_q, start_v } = this.blocks;
    start_q.set(q);
    start_v.set(v);
    if (!this.blocks.constraint_jacobian_B) return "";
    for (const fixed of [kept, new Set()]) {
      start_q.set(q);
      if (this.moved(t, fixed)) {
        this.code.constrain(t);
        const rates = Array.from(this.blocks.constraint_velocity_w);
        const change = this.correction(rates, fixed.size ? spun : new Set());
        start_v.forEach((value, k) => (start_v[k] = value - change[k]));
        return "";
      }
    }
    return "the loops do not close with these values";
  }

  /** Correct start_q to the constraints. Returns whether the constraints are met. */
  moved(t, kept) {
    const phi = this.blocks.constraint_Phi;
    if (!phi) return true;
    const size = this.data.extent || 1;
    for (let round = 0; round < 60; round++) {
      this.code.constrain(t);
      const off = Math.max(...phi.map(Math.abs));
      if (!Number.isFinite(off)) return false;
      if (off < 1e-13 * size) return true;
      const step = this.correction(Array.from(phi), kept).map((value) => -value);
      const largest = Math.max(...step.map(Math.abs), 0);
      const least = largest < 1e-15 && off < 1e-10 * size;
      if (least) return true;
      const shortened = Math.min(1, 0.5 / largest);
      this.blocks.start_q.set(movedBy(this.data.factors, this.blocks.start_q, step.map((value) => shortened * value)));
    }
    this.code.constrain(t);
    return Math.max(...phi.map(Math.abs)) < 1e-9 * size;
  }

  /** The smallest change in the metric of the inertia that takes a violation of the first rows away. */
  correction(violation, kept) {
    const nv = this.data.v.length;
    const [B, M] = [this.blocks.constraint_jacobian_B, this.blocks.mass_M];
    const free = [...Array(nv).keys()].filter((k) => !kept.has(k));
    const rows = violation.map((_, i) => free.map((k) => B[i * nv + k]));
    const mass = free.map((k) => Float64Array.from(free, (j) => M[k * nv + j]));
    mass.forEach((row, k) => (row[k] += 1e-12 * Math.max(row[k], 1e-12)));
    const lifted = rows.map((row) => solved(mass, row));
    const gram = rows.map((row) => lifted.map((other) => row.reduce((sum, value, k) => sum + value * other[k], 0)));
    const multipliers = solved(gram, violation);
    const result = new Float64Array(nv);
    lifted.forEach((row, i) => free.forEach((k, place) => (result[k] += row[place] * multipliers[i])));
    return result;
  }

  /** Whether the constraints are met at present, with the present parameters. */
  isClosed() {
    if (!this.blocks.constraint_Phi) return true;
    this.set();
    this.blocks.start_q.set(this.q);
    this.blocks.start_v.set(this.velocities);
    const [t, kept] = [this.t, Float64Array.from(this.row)];
    this.code.constrain(t);
    const met = Math.max(...this.blocks.constraint_Phi.map(Math.abs)) < 1e-7 * (this.data.extent || 1);
    this.row.set(kept);
    return met;
  }

  /** Go on with changed parameters and inputs; a loop opened by new values is closed. Returns an empty text or a fault. */
  change() {
    this.set();
    if (this.isClosed()) return "";
    const [t, q, v] = [this.t, Float64Array.from(this.q), Float64Array.from(this.velocities)];
    const fault = this.closed(q, v, t, new Set(), new Set());
    if (fault) return fault;
    if (this.z.length) this.blocks.start_z.set(this.row.subarray(this.row.length - this.z.length));
    const status = this.code.start(t);
    return status ? `the motion cannot go on from here: ${this.text(status)}` : "";
  }

  /** Take whole steps of the grid to the last point up to a time, and a shorter one for the rest if asked. */
  run(time, whole = true) {
    const size = this.blocks.settings[0];
    const rest = time - this.t;
    const steps = Math.floor(rest / size + 1e-9);
    let status = steps > 0 ? this.code.step(steps) : 0;
    const left = time - this.t;
    if (!whole && status === 0 && left > 1e-9 * size) {
      this.blocks.settings[0] = left;
      status = this.code.step(1);
      this.blocks.settings[0] = size;
    }
    return status;
  }

  observe() { return this.code.observe(); }

  /** Poses of all carriers of the picture, 7 numbers each. */
  poses(out, at) {
    const { bodies, base, axes, beams } = this.data;
    const all = this.blocks.poses_pose;
    out.set(all.subarray(0, 7 * bodies), at);
    let place = at + 7 * bodies;
    if (base) {
      out.set(this.blocks.base.subarray(0, 7), place);
      place += 7;
    }
    const pose = (body) => Array.from(all.subarray(7 * body, 7 * body + 7));
    for (const axis of axes) {
      const here = pose(axis.body);
      const bent = this.q.subarray(axis.q_start, axis.q_start + axis.modes);
      axis.x.forEach((x, p) => {
        const sum = (table, i) => table[p][i].reduce((total, value, k) => total + value * bent[k], 0);
        const position = [0, 1, 2].map((i) => sum(axis.deflections, i));
        position[0] += x;
        axis.pairs.forEach(([first, second], k) => (position[0] -= bent[first] * bent[second] * axis.shortening[p][k]));
        out.set(poseTimes(here, [...turnBy([0, 1, 2].map((i) => sum(axis.rotations, i))), ...position]), place);
        place += 7;
      });
    }
    for (const { nodes, pieces } of beams) {
      for (let k = 0; k + 1 < nodes.length; k++) {
        const first = pose(nodes[k]);
        const screw = screwOf(poseTimes(inversePose(first), pose(nodes[k + 1])));
        for (let piece = 0; piece < pieces; piece++) {
          out.set(poseTimes(first, poseOf(screw.map((value) => (piece / pieces) * value))), place);
          place += 7;
        }
      }
      out.set(pose(nodes.at(-1)), place);
      place += 7;
    }
  }
}

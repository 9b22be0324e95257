// -- the live page: history of the motion, sliders, plots, clock --------------------------------------------------------

const live = scene.live;
/** Stored frames per second of the page's clock, and how many are kept. */
const [FRAMES, KEPT] = [120, 9600];
/** Speed unless the viewer chooses one: real time, for motions shorter than a second slower. */
const usual = live.duration >= 1 ? 1 : state.speed;
const restTime = { start, end }; // of the run that Python made: the picture is laid around it
const roads = scene.roads;
let motion = null;
let halted = ""; // why the motion cannot go on
let pace = 1; // part of the chosen speed that this machine reaches
let pending = false;
let before = null;
const columns = live.plots.flatMap((plot) => plot.curves);
const values = columns.map(() => new Float64Array(KEPT));
const happened = []; // events: [number, time]
let edition = 0; // changes when stored frames get other places

// -- history ------------------------------------------------------------------------------------------------------------

/** Forget all frames, and store the present one as the first. */
function forget() {
  moments = new Float64Array(KEPT);
  poses = new Float32Array(KEPT * 7 * carriers);
  [count, happened.length] = [0, 0];
  edition += 1;
  traces.clear();
  remember();
  start = moments[0];
  state.time = end;
}

/** Store the present state as a frame; the older half goes if there is no room. */
function remember() {
  if (count === KEPT) {
    const half = KEPT / 2;
    moments.copyWithin(0, half);
    poses.copyWithin(0, half * 7 * carriers);
    for (const column of values) column.copyWithin(0, half);
    count = half;
    edition += 1;
    start = moments[0];
    traces.clear();
  }
  const status = motion.observe();
  moments[count] = motion.t;
  motion.poses(poses, count * 7 * carriers);
  if (leaves(count) && untouched) resetView();
  columns.forEach(({ block, place, minus }, k) => {
    const numbers = motion.blocks[block];
    values[k][count] = place.reduce((sum, index) => sum + numbers[index], 0) - (minus || 0);
  });
  end = moments[count];
  count += 1;
  return status;
}

/** Whether the machine leaves the picture at a frame, which then is laid around it, too. */
function leaves(frame) {
  if (following) return false;
  const places = placesAt(frame);
  if (!places.some((place) => place.some((value, k) => value < bounds.low[k] || value > bounds.high[k]))) return false;
  widen(outermost(places));
  return true;
}

/** Steps between stored frames. */
const stride = () => Math.max(1, Math.floor(state.speed / (FRAMES * live.step) + 1e-9));

/** Take steps, store the frame, and note events and faults. */
function advanceBy(steps) {
  const status = motion.code.step(steps);
  if (live.events.length) {
    const log = motion.blocks.happened;
    for (let k = 0; k < log[0]; k++) happened.push([log[1 + 2 * k], log[2 + 2 * k]]);
    if (happened.length > 400) happened.splice(0, happened.length - 400);
  }
  const seen = status === 0 || live.stops.includes(status) ? remember() : 0;
  if (status || seen) {
    const last = happened.at(-1);
    const named = status === live.stops[0] && last ? `the event ${live.events[last[0]]} ends the motion` : motion.text(status || seen);
    halted = `${named}, at t = ${end.toFixed(digits)} s`;
    if (state.playing) play(false);
    tell();
  }
  return status;
}

/** Go on until a time, or until the time for computing is over. */
function advance(target, milliseconds) {
  const limit = performance.now() + milliseconds;
  while (!halted && end < target) {
    if (advanceBy(stride())) break;
    if (performance.now() > limit) break;
  }
  return Math.min(target, end);
}

/** Start again with the present settings. */
function restart() {
  halted = motion.start();
  tell();
  forget();
  refresh();
}

// -- clock --------------------------------------------------------------------------------------------------------------

const digits = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(Math.max(live.duration, 1e-9)))));

function showTime() {
  byId("slider").max = String(Math.max(count - 1, 1));
  byId("slider").value = String(frameAt(state.time)[0] + Math.round(frameAt(state.time)[1]));
  byId("clock").textContent = `${state.time.toFixed(digits)} s`;
  byId("slider").setAttribute("aria-valuetext", `${state.time.toFixed(digits)} seconds`);
  byId("pace").textContent = pace < 0.9 && state.playing ? `this machine reaches ${(pace * state.speed).toPrecision(2)}×` : "";
}

function refresh() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(tick);
}

function tick(now) {
  pending = false;
  if (!motion) return;
  if (state.playing) {
    if (before !== null && now > before) {
      const wanted = (Math.min(now - before, 100) / 1000) * state.speed;
      const from = state.time;
      state.time = advance(from + wanted, 14);
      pace = 0.95 * pace + 0.05 * Math.min((state.time - from) / wanted, 1);
    }
    before = now;
  }
  show();
  if (state.playing) refresh();
}

/** Draw the picture, the clock and the plots. */
function show() {
  scene.roads = roads.filter((road) => road.places || (isPlain() && state.time <= restTime.end));
  showTime();
  draw();
  drawCharts();
}

function showButton() {
  byId("play").replaceChildren(icon(state.playing ? ICONS.pause : ICONS.play));
  byId("play").setAttribute("aria-label", state.playing ? "Pause" : "Play");
}

function play(on) {
  state.playing = on && (!halted || state.time < end);
  [before, pace] = [null, 1];
  showButton();
  refresh();
}

/** Show an earlier moment that is stored. */
function seek(time) {
  state.time = Math.min(Math.max(time, start), end);
  play(false);
}

/** One step of the scene's grid from the end of the motion. */
function single() {
  if (state.playing) play(false);
  if (!halted) advanceBy(1);
  state.time = end;
  refresh();
}

function hasten(change) {
  const place = Math.min(Math.max(SPEEDS.indexOf(state.speed) + change, 0), SPEEDS.length - 1);
  state.speed = SPEEDS[place];
  byId("speed").value = String(state.speed);
  keep();
}

// -- sliders ------------------------------------------------------------------------------------------------------------

const sliders = live.sliders.map((slider) => ({ ...slider, now: slider.value }));
const isPlain = () => sliders.every((slider) => slider.now === slider.value);

/** Put the value of a slider into the motion; an input at its own value is as in the scene's run. */
function put(slider) {
  const { kind, index, now, value } = slider;
  if (kind === "parameter") motion.parameters[index] = now;
  else if (kind === "input") motion.held[index] = now === value ? live.held[index] ?? NaN : now;
  else if (kind === "position") {
    if (slider.place === null) motion.displaced[index] = now;
    else if (now === value) motion.given.delete(slider.place);
    else motion.given.set(slider.place, now);
    now === value ? motion.touched.delete(index) : motion.touched.add(index);
  } else if (kind === "velocity") {
    motion.v[index] = now === value ? live.v[index] : now;
    now === value ? motion.spun.delete(index) : motion.spun.add(index);
  } else motion.z[index] = now;
}

/** Take a value from the viewer: parameters and inputs act at once, initial values start the motion again. */
function choose(slider, number) {
  const earlier = slider.now;
  slider.now = number === null ? null : Math.min(Math.max(number, slider.low), slider.high);
  put(slider);
  const acts = slider.kind === "parameter" || slider.kind === "input";
  let fault = "";
  if (acts && end > live.t && !halted) {
    state.time = end;
    fault = motion.change();
  } else {
    fault = motion.start();
    if (!fault) {
      halted = "";
      forget();
    }
  }
  if (fault) {
    slider.now = earlier;
    put(slider);
    motion.set();
  }
  slider.show();
  tell(fault && `${slider.name}: ${fault}`);
  keep();
  refresh();
}

const GROUPS = { parameter: "parameters", input: "inputs", position: "positions", velocity: "velocities", state: "states" };
/** A number of a slider in four digits, in three with an exponent. */
function short(value, { low, high }) {
  if (Math.abs(value) < 1e-9 * (high - low)) return "0";
  const rounded = +value.toPrecision(4);
  return Math.abs(rounded) >= 1e6 || Math.abs(rounded) < 1e-3 ? (+value.toPrecision(3)).toExponential() : String(rounded);
}

function addSlider(slider) {
  const [row, name, range, box, unit] = ["div", "label", "input", "input", "span"].map((tag) => document.createElement(tag));
  row.className = "slider";
  const id = `${slider.kind}-${slider.index}`;
  Object.assign(range, { type: "range", min: slider.low, max: slider.high, step: (slider.high - slider.low) / 400, id });
  Object.assign(box, { type: "number", min: slider.low, max: slider.high, step: "any" });
  name.htmlFor = id;
  name.textContent = slider.name;
  name.title = row.title = slider.description || slider.name;
  unit.textContent = slider.unit;
  box.setAttribute("aria-label", `${slider.name}${slider.unit ? `, ${slider.unit}` : ""}`);
  slider.show = () => {
    range.value = String(slider.now ?? 0);
    box.value = slider.now === null ? "" : short(slider.now, slider);
    box.placeholder = slider.value === null ? "f(t)" : "";
    row.classList.toggle("changed", slider.now !== slider.value);
  };
  range.addEventListener("input", () => choose(slider, Number(range.value)));
  box.addEventListener("change", () => choose(slider, box.value === "" ? slider.value : Number(box.value)));
  name.addEventListener("dblclick", () => choose(slider, slider.value));
  row.append(name, range, box, unit);
  byId(GROUPS[slider.kind]).querySelector(".rows").append(row);
  slider.show();
}

/** Sliders in sight at first in each group. */
const SHOWN = 10;

function fillSliders() {
  for (const slider of sliders) addSlider(slider);
  for (const kind of Object.keys(GROUPS)) {
    const section = byId(GROUPS[kind]);
    const rows = [...section.querySelectorAll(".slider")];
    section.hidden = rows.length === 0;
    if (rows.length <= SHOWN + 1) continue;
    const button = document.createElement("button");
    button.type = "button";
    const fold = (closed) => {
      for (const row of rows.slice(SHOWN)) row.hidden = closed;
      button.textContent = closed ? `${rows.length - SHOWN} more` : "fewer";
    };
    button.addEventListener("click", () => fold(!rows[SHOWN].hidden));
    fold(true);
    section.append(button);
  }
  byId("defaults").addEventListener("click", () => {
    for (const slider of sliders) {
      slider.now = slider.value;
      put(slider);
      slider.show();
    }
    keep();
    restart();
  });
  byId("note").textContent = live.note;
  byId("note").hidden = !live.note;
}

// -- settings in the address --------------------------------------------------------------------------------------------

/** Name of a slider's setting in the address. */
const keyOf = (slider) => `${{ parameter: "p", input: "u", position: "q", velocity: "v", state: "z" }[slider.kind]}.${slider.name}`;

/** Write changed settings into the page's address. */
function keep() {
  const settings = new URLSearchParams();
  for (const slider of sliders) if (slider.now !== slider.value) settings.set(keyOf(slider), String(+slider.now.toPrecision(9)));
  if (state.speed !== usual) settings.set("speed", String(state.speed));
  if (page.dataset.theme) settings.set("theme", page.dataset.theme);
  const text = settings.toString();
  try {
    history.replaceState(null, "", text ? `#${text}` : location.pathname + location.search);
  } catch {
    // a page within a notebook has no address of its own
  }
}

/** Take settings from the page's address. */
function takeAddress() {
  const settings = new URLSearchParams(location.hash.slice(1));
  for (const slider of sliders) {
    const given = settings.get(keyOf(slider));
    const number = given === null || given === "" ? NaN : Number(given);
    slider.now = Number.isFinite(number) ? Math.min(Math.max(number, slider.low), slider.high) : slider.value;
    put(slider);
    slider.show();
  }
  const speed = Number(settings.get("speed"));
  state.speed = speed > 0 && Number.isFinite(speed) ? speed : usual;
  byId("speed").value = String(state.speed);
}

// -- plots --------------------------------------------------------------------------------------------------------------

const charts = [];

function fillCharts() {
  let first = 0;
  for (const plot of live.plots) {
    const place = document.createElement("canvas");
    place.setAttribute("role", "img");
    place.setAttribute("aria-label", `${plot.title} over time`);
    byId("plots").append(place);
    charts.push({ chart: new GrowingChart(place, { title: plot.title, unit: plot.unit, along: "s" }), plot, first });
    first += plot.curves.length;
  }
  byId("plots").hidden = charts.length === 0;
}

/** Parts of the plots' length by which they move on, so that a moving plot is seldom drawn anew. */
const HOPS = 10;

function drawCharts() {
  const length = live.duration || 1; // of a run that ends at its start one second
  const hop = length / HOPS;
  const to = live.t + length + hop * Math.max(0, Math.ceil((end - live.t - length) / hop - 1e-9));
  const from = Math.max(start, to - length);
  const marks = happened.map(([, time]) => time).slice(-60);
  for (const { chart, plot, first } of charts) {
    const curves = plot.curves.map(({ name }, number) => ({ name, value: (k) => values[first + number][k] }));
    Object.assign(chart.colours, { ink: style.ink, soft: style.soft, line: style.line });
    chart.draw({ first: frameAt(from)[0], count, x: (k) => moments[k], curves }, { from, to, cursor: state.time, marks, edition });
  }
}

// -- the page -----------------------------------------------------------------------------------------------------------

/** Show why a motion cannot go on. */
function tell(fault = "") {
  byId("warning").textContent = fault || halted;
  byId("warning").hidden = !(fault || halted);
}

function resize() {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const header = byId("description").getBoundingClientRect();
  const above = Math.min(header.bottom - canvas.getBoundingClientRect().top + 8, 0.35 * height);
  camera.show(width, height, { left: 14, right: width - 14, top: above, bottom: Math.max(height - 46, above + 60) });
  if (untouched) resetView();
  refresh();
}

function fillPage() {
  byId("title").replaceChildren(...breakable(scene.name));
  byId("description").textContent = scene.description;
  byId("error").textContent = live.error;
  byId("method").textContent = live.method;
  fillLegend();
  canvas.setAttribute("aria-label", `3-D picture of ${scene.name}, computed in this page. Space plays, arrow right takes a step.`);
  for (const speed of SPEEDS) {
    const option = document.createElement("option");
    [option.value, option.textContent] = [String(speed), `${speed}×`];
    byId("speed").append(option);
  }
  fold(true);
  fillSliders();
  fillCharts();
}

function listen() {
  listenToView();
  byId("play").addEventListener("click", () => play(!state.playing));
  byId("step").addEventListener("click", single);
  byId("reset").addEventListener("click", restart);
  byId("slider").addEventListener("input", (event) => seek(moments[Number(event.target.value)]));
  byId("speed").addEventListener("change", (event) => { state.speed = Number(event.target.value); keep(); });
  byId("theme").addEventListener("click", keep);
  window.addEventListener("hashchange", () => { takeAddress(); restart(); });
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || ["INPUT", "SELECT"].includes(event.target.tagName)) return;
    if (event.key === " " && event.target.tagName === "BUTTON") return;
    const keys = {
      " ": () => play(!state.playing), ArrowRight: single, ArrowLeft: () => seek(moments[Math.max(frameAt(state.time)[0] - 1, 0)]),
      Home: restart, "+": () => hasten(1), "-": () => hasten(-1), r: () => byId("home").click(), d: () => byId("theme").click(),
      ArrowUp: () => zoom(0.9), ArrowDown: () => zoom(1.1),
    };
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}

/** For programs: run to a time and report the state in digits that give the same numbers again. */
function runTo(time) {
  play(false);
  restart();
  const status = halted ? -1 : motion.run(time, false);
  if (!halted) remember();
  state.time = end;
  show();
  return { status, fault: halted, row: Array.from(motion.row, String), energy: Array.from(motion.blocks.energy_energy || [], String), outputs: Array.from(motion.blocks.outputs_y || [], String) };
}

/** For programs: mean milliseconds of a frame of 1/60 s that is computed and drawn. */
function timeFrames(frames) {
  restart();
  const began = performance.now();
  for (let k = 0; k < frames; k++) {
    state.time = advance(state.time + state.speed / 60, 1e9);
    show();
  }
  return (performance.now() - began) / frames;
}

async function begin() {
  if (["light", "dark"].includes(hash.get("theme"))) page.dataset.theme = hash.get("theme");
  shown.repeat = undefined;
  readStyle();
  fillPage();
  resize();
  resetView();
  try {
    motion = new Motion(await exportsOf(live.module), live);
  } catch (error) {
    tell(`This browser cannot run the model: ${error.message}`);
    return;
  }
  takeAddress();
  listen();
  restart();
  if (Number.isFinite(asked)) {
    state.playing = false;
    showButton();
    state.time = advance(asked, 20000);
    show();
  } else play(!calm);
  page.dataset.ready = "yes";
}

const ready = begin();

// -- playing -----------------------------------------------------------------------------------------------------------

const ICONS = { play: "M2 1l11 7-11 7z", pause: "M2 1h4v14h-4zM9 1h4v14h-4z" };

function icon(name) {
  const svg = document.createElementNS("http://www.w3.org/2000/svg", "svg");
  svg.setAttribute("viewBox", "0 0 16 16");
  svg.setAttribute("width", "15");
  svg.setAttribute("height", "15");
  svg.setAttribute("aria-hidden", "true");
  const path = document.createElementNS("http://www.w3.org/2000/svg", "path");
  path.setAttribute("d", name);
  svg.append(path);
  return svg;
}

const digits = Math.max(0, Math.min(6, 3 - Math.floor(Math.log10(Math.max(end - start, 1e-9)))));

function showTime() {
  byId("slider").value = String(frameAt(state.time)[0] + Math.round(frameAt(state.time)[1]));
  byId("clock").textContent = `${state.time.toFixed(digits)} s / ${end.toFixed(Math.min(digits, 2))} s`;
  byId("slider").setAttribute("aria-valuetext", `${state.time.toFixed(digits)} seconds`);
}

let pending = false;
let before = null;

function refresh() {
  if (pending) return;
  pending = true;
  requestAnimationFrame(tick);
}

function tick(now) {
  pending = false;
  if (state.playing) {
    if (before !== null) state.time += (Math.min(now - before, 100) / 1000) * state.speed;
    before = now;
    if (state.time >= end) {
      if (shown.repeat) state.time = start + ((state.time - start) % (end - start || 1));
      else [state.time, state.playing] = [end, false];
      if (!state.playing) showButton();
    }
  }
  showTime();
  draw();
  if (state.playing) refresh();
}

function showButton() {
  byId("play").replaceChildren(icon(state.playing ? ICONS.pause : ICONS.play));
  byId("play").setAttribute("aria-label", state.playing ? "Pause" : "Play");
}

function play(on) {
  if (on && count > 1 && state.time >= end) state.time = start;
  state.playing = on && count > 1;
  before = null;
  showButton();
  refresh();
}

function seek(time) {
  state.time = Math.min(Math.max(time, start), end);
  play(false);
}

const step = (frames) => seek(moments[Math.min(Math.max(frameAt(state.time + 1e-9)[0] + (frameAt(state.time)[1] >= 1 ? 1 : 0) + frames, 0), count - 1)]);

function hasten(change) {
  const place = Math.min(Math.max(SPEEDS.indexOf(state.speed) + change, 0), SPEEDS.length - 1);
  state.speed = SPEEDS[place];
  byId("speed").value = String(state.speed);
}

// -- the page ----------------------------------------------------------------------------------------------------------

function entry(list, parts, index) {
  const item = document.createElement("li");
  item.append(...parts);
  if (index !== undefined) {
    item.tabIndex = 0;
    const light = (value) => () => { state.lit = value; refresh(); };
    for (const event of ["pointerenter", "focus"]) item.addEventListener(event, light(index));
    for (const event of ["pointerleave", "blur"]) item.addEventListener(event, light(null));
  }
  byId(list).querySelector("ul").append(item);
}

/** Entries of a list that are in sight at first. */
const LONG = 5;

/** Fold the end of a long list. */
function shorten(list) {
  const items = [...byId(list).querySelectorAll("li")].slice(LONG);
  if (items.length < 2) return;
  const button = document.createElement("button");
  const show = (all) => {
    for (const item of items) item.hidden = !all;
    button.textContent = all ? "fewer" : `${items.length} more`;
    button.setAttribute("aria-expanded", String(all));
  };
  button.type = "button";
  button.addEventListener("click", () => show(items[0].hidden));
  show(false);
  entry(list, [button]);
}

function worded(text) {
  const span = document.createElement("span");
  span.textContent = text;
  span.title = text;
  return span;
}

function swatch(colour, kind) {
  const mark = document.createElement("i");
  mark.className = `swatch ${kind}`;
  if (colour) mark.style.background = colour;
  return mark;
}

function toggle(list, text, value, change, colour) {
  const [box, words] = [document.createElement("input"), document.createElement("label")];
  box.type = "checkbox";
  box.checked = value;
  box.addEventListener("change", () => { change(box.checked); refresh(); });
  words.append(box, ...(colour ? [swatch(colour, "dot")] : []), worded(text));
  entry(list, [words]);
}

function fillPage() {
  byId("title").textContent = scene.name;
  byId("description").textContent = scene.description;
  if (!scene.success) {
    byId("warning").hidden = false;
    byId("warning").textContent = `This run did not reach its end: ${scene.message}`;
  }
  bodies.forEach((body, index) => {
    if (body.mesh || body.ball || body.shaped) entry("bodies", [swatch(css(body.colour, 1), ""), worded(body.name)], index);
  });
  for (const point of [...scene.points].sort((a, b) => b.trace - a.trace)) {
    const colour = point.body < 0 ? style.steel : css(bodies[point.body].colour, 1);
    toggle("points", point.name, point.trace, (on) => (point.trace = on), colour);
  }
  for (const item of [...scene.springs, ...scene.rods, ...scene.tyres]) entry("others", [swatch("", "stroke"), worded(item.name)]);
  for (const name of ["bodies", "points", "others"]) {
    byId(name).hidden = !byId(name).querySelector("li");
    shorten(name);
  }
  const options = { names: "names", solids: "solids", glass: "see-through", joints: "joints", ground: "ground and axes", shadows: "shadows", follow: "follow the motion", repeat: "repeat" };
  if (bodies.some((body) => body.outline)) options.sections = "sections of beams";
  for (const [name, text] of Object.entries(options)) {
    toggle("options", text, shown[name], (on) => {
      shown[name] = on;
      if (name === "follow") untouched = false;
      if (name === "follow") camera.shift = on ? minus(camera.target, centreAt(state.time)) : null;
    });
  }
  const words = `${scene.name}: ${bodies.length} ${bodies.length === 1 ? "body" : "bodies"} from ${start.toFixed(digits)} s to ${end.toFixed(digits)} s`;
  canvas.setAttribute("aria-label", `3-D animation of ${words}. Arrow keys step in time, space plays.`);
  byId("slider").max = String(Math.max(count - 1, 1));
  byId("slider").disabled = byId("play").disabled = count < 2;
  for (const speed of SPEEDS) {
    const option = document.createElement("option");
    [option.value, option.textContent] = [String(speed), `${speed}×`];
    byId("speed").append(option);
  }
  byId("speed").value = String(state.speed);
  byId("theme").replaceChildren(icon("M8 1a7 7 0 1 0 0 14A7 7 0 0 0 8 1zm0 2v10A5 5 0 0 1 8 3z"));
  if (window.innerWidth < 760) fold(true);
}

function fold(closed) {
  byId("entries").hidden = closed;
  byId("fold").setAttribute("aria-expanded", String(!closed));
}

function changeTheme() {
  page.dataset.theme = style.dark ? "light" : "dark";
  readStyle();
  refresh();
}

function resize() {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const [title, legend, footer] = ["title", "legend", "play"].map((name) => byId(name).getBoundingClientRect());
  const right = width > 760 ? legend.left - 12 : width - 20;
  camera.show(width, height, { left: 20, right, top: title.bottom + 34, bottom: Math.max(footer.top - 50, title.bottom + 80) });
  if (untouched) resetView();
  refresh();
}

function orbit(dx, dy) {
  untouched = false;
  camera.azimuth -= 0.007 * dx;
  camera.elevation = Math.min(Math.max(camera.elevation + 0.007 * dy, -1.55), 1.55);
  refresh();
}

function shiftView(dx, dy) {
  untouched = false;
  const scale = camera.distance / camera.focal;
  const move = plus(times(-dx * scale, camera.right), times(dy * scale, camera.above));
  camera.target = plus(camera.target, move);
  if (shown.follow) camera.shift = plus(camera.shift || [0, 0, 0], move);
  refresh();
}

function zoom(factor) {
  untouched = false;
  camera.distance = Math.min(Math.max(camera.distance * factor, 1e-3 * unitSize), 1e3 * unitSize);
  refresh();
}

function listen() {
  const held = new Map();
  canvas.addEventListener("pointerdown", (event) => {
    canvas.setPointerCapture(event.pointerId);
    held.set(event.pointerId, [event.clientX, event.clientY]);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!held.has(event.pointerId)) return;
    const [x, y] = held.get(event.pointerId);
    const [dx, dy] = [event.clientX - x, event.clientY - y];
    if (held.size === 2) {
      const [a, b] = [...held.values()];
      const wide = Math.hypot(a[0] - b[0], a[1] - b[1]);
      held.set(event.pointerId, [event.clientX, event.clientY]);
      const [c, d] = [...held.values()];
      zoom(wide / (Math.hypot(c[0] - d[0], c[1] - d[1]) || 1));
      shiftView(dx / 2, dy / 2);
      return;
    }
    held.set(event.pointerId, [event.clientX, event.clientY]);
    if (event.shiftKey || event.buttons & 6) shiftView(dx, dy);
    else orbit(dx, dy);
  });
  for (const name of ["pointerup", "pointercancel"]) canvas.addEventListener(name, (event) => held.delete(event.pointerId));
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  canvas.addEventListener("wheel", (event) => { event.preventDefault(); zoom(Math.exp(0.0012 * event.deltaY)); }, { passive: false });
  byId("play").addEventListener("click", () => play(!state.playing));
  byId("slider").addEventListener("input", (event) => seek(moments[Number(event.target.value)]));
  byId("speed").addEventListener("change", (event) => (state.speed = Number(event.target.value)));
  byId("home").addEventListener("click", () => { camera.shift = null; resetView(); refresh(); });
  byId("theme").addEventListener("click", changeTheme);
  byId("fold").addEventListener("click", () => fold(!byId("entries").hidden));
  window.addEventListener("resize", resize);
  window.addEventListener("hashchange", () => {
    const time = Number(new URLSearchParams(location.hash.slice(1)).get("t"));
    if (Number.isFinite(time)) seek(time);
  });
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readStyle(); refresh(); });
  window.addEventListener("keydown", (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey || ["INPUT", "SELECT"].includes(event.target.tagName)) return;
    if (event.key === " " && event.target.tagName === "BUTTON") return;
    const keys = {
      " ": () => play(!state.playing), ArrowRight: () => step(event.shiftKey ? 10 : 1), ArrowLeft: () => step(event.shiftKey ? -10 : -1),
      Home: () => seek(start), End: () => seek(end), "+": () => hasten(1), "-": () => hasten(-1), r: () => byId("home").click(),
      d: changeTheme, ArrowUp: () => zoom(0.9), ArrowDown: () => zoom(1.1),
    };
    const action = keys[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!action) return;
    event.preventDefault();
    action();
  });
}

if (["light", "dark"].includes(hash.get("theme"))) page.dataset.theme = hash.get("theme");
readStyle();
fillPage();
listen();
resize();
resetView();
play(state.playing);

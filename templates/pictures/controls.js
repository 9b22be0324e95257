// -- legend and view: the same in pages of recorded motions and of live ones; `refresh` and `resize` are the page's own ----

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

/** A text that may break after underlines, for titles in narrow windows. */
const breakable = (text) => text.split(/(?<=_)/).flatMap((part, k) => (k ? [document.createElement("wbr"), part] : [part]));

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

/** Fill the lists of bodies, points and connections, and of what is shown. */
function fillLegend() {
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
  const options = { names: "names", solids: "solids", glass: "see-through", joints: "joints", ground: "ground and axes", shadows: "shadows", follow: "follow the motion" };
  if (shown.repeat !== undefined) options.repeat = "repeat";
  if (bodies.some((body) => body.outline)) options.sections = "sections of beams";
  for (const [name, text] of Object.entries(options)) {
    toggle("options", text, shown[name], (on) => {
      shown[name] = on;
      if (name === "follow") untouched = false;
      if (name === "follow") camera.shift = on ? minus(camera.target, centreAt(state.time)) : null;
    });
  }
  byId("theme").replaceChildren(icon("M8 1a7 7 0 1 0 0 14A7 7 0 0 0 8 1zm0 2v10A5 5 0 0 1 8 3z"));
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

/** Turn, shift and zoom the view by pointers and the wheel; the buttons of the legend and of the theme. */
function listenToView() {
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
  byId("home").addEventListener("click", () => { camera.shift = null; resetView(); refresh(); });
  byId("theme").addEventListener("click", changeTheme);
  byId("fold").addEventListener("click", () => fold(!byId("entries").hidden));
  window.addEventListener("resize", resize);
  window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => { readStyle(); refresh(); });
}

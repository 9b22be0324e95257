// -- playing -----------------------------------------------------------------------------------------------------------

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

function fillPage() {
  byId("title").replaceChildren(...breakable(scene.name));
  byId("description").textContent = scene.description;
  if (!scene.success) {
    byId("warning").hidden = false;
    byId("warning").textContent = `This run did not reach its end: ${scene.message}`;
  }
  fillLegend();
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
  if (window.innerWidth < 760) fold(true);
}

function resize() {
  const ratio = window.devicePixelRatio || 1;
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  [canvas.width, canvas.height] = [Math.round(width * ratio), Math.round(height * ratio)];
  const [title, legend, footer] = ["title", "legend", "play"].map((name) => byId(name).getBoundingClientRect());
  const right = width > 760 ? legend.left - 12 : width - 20;
  camera.show(width, height, { left: 20, right, top: title.bottom + 34, bottom: Math.max(footer.top - 50, title.bottom + 80) });
  if (untouched) resetView();
  draw(); // at once: a page that is printed or out of sight gets no further frame
}

function listen() {
  listenToView();
  byId("play").addEventListener("click", () => play(!state.playing));
  byId("slider").addEventListener("input", (event) => seek(moments[Number(event.target.value)]));
  byId("speed").addEventListener("change", (event) => (state.speed = Number(event.target.value)));
  window.addEventListener("hashchange", () => {
    const time = Number(new URLSearchParams(location.hash.slice(1)).get("t"));
    if (Number.isFinite(time)) seek(time);
  });
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

// -- a report: its charts, which zoom together ---------------------------------------------------------------------------

const byId = (name) => document.getElementById(name);
const page = document.documentElement;
window.addEventListener("error", (event) => (page.dataset.error = event.message));

const report = JSON.parse(byId("data").textContent);
const numbers = (text) => new Float32Array(Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer);
const charts = [];

function colours() {
  const computed = getComputedStyle(page);
  return Object.fromEntries(["ink", "soft", "line"].map((name) => [name, computed.getPropertyValue(`--${name}`).trim()]));
}

/** Draw a chart; one that was zoomed takes the others over the same abscissa along. */
function redraw(chart) {
  for (const other of charts) {
    if (other.across === chart.across && !chart.dragged) other.view = chart.view && { x: chart.view.x, y: null };
    if (other === chart || !chart.dragged) paint(other);
  }
}

function paint(chart) {
  Object.assign(chart.colours, colours());
  chart.draw(chart.series, { from: chart.from, to: chart.to });
}

for (const { id, title, unit, across, curves } of report.charts) {
  const chart = new Chart(byId(id), { title, unit, across });
  const read = curves.map(({ name, x, y }) => ({ name, x: numbers(x), y: numbers(y) }));
  const ends = read.flatMap(({ x }) => [x[0], x[x.length - 1]]);
  [chart.from, chart.to] = [Math.min(...ends), Math.max(...ends)];
  chart.series = { count: 0, x: () => 0, curves: read.map(({ name, x, y }) => ({ name, count: x.length, x: (k) => x[k], value: (k) => y[k] })) };
  chart.zoomable(redraw);
  charts.push(chart);
}

const paintAll = () => charts.forEach(paint);
paintAll();
window.addEventListener("resize", paintAll);
// the width of paper is known to no script: charts have the size of two in a row of A4 or letter, in fine pixels
const paper = (printed) => () => {
  for (const chart of charts) chart.printed = printed;
  paintAll();
};
window.addEventListener("beforeprint", paper({ width: 350, height: 200, ratio: 3 }));
window.addEventListener("afterprint", paper(null));
window.matchMedia("(prefers-color-scheme: dark)").addEventListener("change", paintAll);
page.dataset.ready = "yes";

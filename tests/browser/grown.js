const told = { charts: [] };
play(false);
restart();
const pixels = ({ canvas: { width, height }, canvas }) => {
  const copy = new OffscreenCanvas(width, height).getContext("2d", { willReadFrequently: true });
  copy.drawImage(canvas, 0, 0);
  return copy.getImageData(0, 0, width, height).data;
};
for (let k = 0; k < 150; k++) {
  state.time = advance(state.time + 1 / 60, 1e9);
  show();
}
let places = 0;
const go = CanvasRenderingContext2D.prototype.lineTo;
CanvasRenderingContext2D.prototype.lineTo = function (x, y) { places += 1; go.call(this, x, y); };
for (const { chart, plot, first } of charts) {
  const grown = pixels(chart);
  chart.key = "";
  places = 0;
  drawCharts();
  const anew = pixels(chart);
  let [differ, inked] = [0, 0];
  for (let k = 0; k < anew.length; k += 4) {
    inked += anew[k + 3] > 0;
    differ += [0, 1, 2, 3].some((j) => Math.abs(anew[k + j] - grown[k + j]) > 64);
  }
  const seen = plot.curves.flatMap((_, j) => [...values[first + j].subarray(frameAt(chart.shown.x[0])[0] + 1, count)]);
  const [low, high] = chart.shown.y;
  told.charts.push({ differ, inked, places, most: 4 * plot.curves.length * chart.width + 100,
    within: seen.every((y) => y > low && y < high), x: chart.shown.x, stored: count, curves: plot.curves.length });
}
told.end = end;

document.body.dataset.told = JSON.stringify(told);

const told = { names: [], cut: [], title: byId("title").textContent };
const fill = CanvasRenderingContext2D.prototype.fillText;
CanvasRenderingContext2D.prototype.fillText = function (text, x, y) {
  const width = this.measureText(text).width;
  const first = x - { left: 0, start: 0, center: width / 2, right: width }[this.textAlign];
  const { canvas } = this;
  told.names.push(text);
  if (first < 0 || first + width > canvas.width || y < 0 || y > canvas.height) told.cut.push([text, first, y]);
  fill.call(this, text, x, y);
};
play(false);
restart();
advance(1, 1e9);
drawCharts();
told.curves = live.plots.flatMap(({ curves }) => curves.map(({ name }) => name));
told.marks = ticksOf(-45, 45, 2.6).ticks;

document.body.dataset.told = JSON.stringify(told);

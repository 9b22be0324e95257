const told = { before: charts.map(({ canvas }) => canvas.width) };
window.dispatchEvent(new Event("beforeprint"));
told.printed = charts.map(({ canvas }) => [canvas.width, canvas.height]);
window.dispatchEvent(new Event("afterprint"));
told.after = charts.map(({ canvas }) => canvas.width);
told.names = charts.flatMap(({ series }) => series.curves.map(({ name }) => name));
document.body.dataset.told = JSON.stringify(told);

const told = { charts: charts.length };
const [first, second] = charts;
const pointer = (type, offsetX) => {
  const event = new PointerEvent(type, { pointerId: 1 });
  Object.defineProperty(event, "offsetX", { value: offsetX });
  first.canvas.dispatchEvent(event);
};
first.canvas.setPointerCapture = () => {};
told.before = second.shown.x;
const middle = (first.left + first.right) / 2;
pointer("pointerdown", first.left); pointer("pointermove", middle); pointer("pointerup", middle);
told.zoomed = [first.shown.x, second.shown.x];
first.canvas.dispatchEvent(new MouseEvent("dblclick"));
told.again = [first.shown.x, second.shown.x];
told.ready = document.documentElement.dataset.ready; told.error = document.documentElement.dataset.error || "";
document.body.dataset.told = JSON.stringify(told);

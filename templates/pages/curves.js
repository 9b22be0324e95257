// -- curves over time or another column: axes, ticks, lines, a cursor; zoom by dragging ---------------------------------

/** Colours of curves, in order. */
const CURVES = ["#3f7fdb", "#ef8b2c", "#34a56f", "#d6455b", "#8d70d8", "#24a4b5"];

/** Whether a curve is dashed: every other one, so that equal curves of two sides are both seen. */
const dashed = (number) => (number + Math.floor(number / CURVES.length)) % 2 === 1;

/** Marks at round numbers over a range, two or more, and the step between them. */
function ticksOf(low, high, wanted) {
  const rough = (high - low) / Math.max(wanted, 1);
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
  const first = Math.ceil(low / step - 1e-9);
  const ticks = [...Array(Math.max(Math.floor(high / step + 1e-9) - first + 1, 0)).keys()].map((k) => (first + k) * step);
  return ticks.length < 2 && wanted < 8 ? ticksOf(low, high, 2 * Math.max(wanted, 1)) : { ticks, step };
}

/** A number as a mark shows it. */
function marked(value, step, largest) {
  if (largest >= 1e5 || (largest < 1e-3 && largest > 0)) return value === 0 ? "0" : value.toExponential(Math.max(0, Math.min(4, Math.ceil(Math.log10(Math.abs(value) / step)))));
  return value.toFixed(Math.max(0, Math.min(6, -Math.floor(Math.log10(step) + 1e-9))));
}

/** The range of values with a margin; nearly equal ones get a range of their size. */
function rangeOf(low, high) {
  if (!(high >= low)) return [-1, 1];
  const size = Math.max(Math.abs(low), Math.abs(high));
  const margin = high - low > 1e-9 * size ? 0.06 * (high - low) : 0.5 * size || 1;
  return [low - margin, high + margin];
}

/** A chart on a canvas, of series { count, x(k), curves: [{ name, value(k) }] }; a curve may have a count and an x of its
 * own. `view` has the ranges that the viewer has chosen, or is null; the abscissa has the label `across` below it, or the
 * unit `along` at its last mark. */
class Chart {
  constructor(canvas, { title, unit, across, along }) {
    Object.assign(this, { canvas, title, unit, across, along, view: null });
    this.colours = { ink: "#222", soft: "#667", line: "#ccd" };
  }

  /** Take the size of the canvas, or the one for paper. */
  size() {
    const { clientWidth, clientHeight } = this.canvas;
    const { width, height, ratio } = this.printed || { width: clientWidth || 320, height: clientHeight || 180, ratio: window.devicePixelRatio || 1 };
    if (this.canvas.width !== Math.round(width * ratio)) this.canvas.width = Math.round(width * ratio);
    if (this.canvas.height !== Math.round(height * ratio)) this.canvas.height = Math.round(height * ratio);
    Object.assign(this, { width, height, ratio });
  }

  /** Ranges that show all curves over part of the abscissa. */
  fitted({ count, x, curves }, from, to) {
    let [low, high] = [Infinity, -Infinity];
    for (const { value, count: own = count, x: place = x } of curves) {
      for (let k = 0; k < own; k++) {
        if (place(k) < from || place(k) > to) continue;
        const y = value(k);
        if (y < low) low = y;
        if (y > high) high = y;
      }
    }
    return rangeOf(low, high);
  }

  placeX(x) {
    const [low, high] = this.shown.x;
    return this.left + ((x - low) / (high - low)) * (this.right - this.left);
  }

  placeY(y) {
    const [low, high] = this.shown.y;
    return this.bottom - ((y - low) / (high - low)) * (this.bottom - this.top);
  }

  draw(series, { from, to }) {
    this.size();
    const ink = this.canvas.getContext("2d");
    const x = this.view ? this.view.x : [from, to > from ? to : from + 1];
    this.frame(ink, series.curves, x, this.view && this.view.y ? this.view.y : this.fitted(series, ...x));
    this.inside(ink, () => {
      series.curves.forEach(({ value, count = series.count, x = series.x }, number) => this.trace(ink, number, { value, x }, 0, count));
      if (!this.dragged) return;
      ink.fillStyle = "rgba(90, 140, 230, 0.18)";
      ink.fillRect(this.dragged[0], this.top, this.dragged[1] - this.dragged[0], this.bottom - this.top);
    });
  }

  /** Draw all around the curves: axes with their marks, the title, names of curves. */
  frame(ink, curves, [lowX, highX], [lowY, highY]) {
    ink.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    ink.clearRect(0, 0, this.width, this.height);
    ink.font = "11px system-ui, sans-serif";
    const legend = this.legend(ink, curves);
    const [right, top, bottom] = [this.width - 10, 28 + 14 * (legend.at(-1).row + 1), this.height - (this.across ? 32 : 20)];
    const up = ticksOf(lowY, highY, (bottom - top) / 34);
    const heights = up.ticks.map((y) => marked(y, up.step, Math.max(Math.abs(lowY), Math.abs(highY))));
    const left = Math.max(52, 12 + Math.max(0, ...heights.map((text) => ink.measureText(text).width)));
    Object.assign(this, { left, right, top, bottom, shown: { x: [lowX, highX], y: [lowY, highY] } });
    ink.fillStyle = this.colours.soft;
    ink.strokeStyle = this.colours.line;
    ink.lineWidth = 1;
    ink.textBaseline = "middle";
    ink.textAlign = "right";
    ink.beginPath();
    up.ticks.forEach((y, k) => {
      ink.moveTo(left, this.placeY(y));
      ink.lineTo(right, this.placeY(y));
      ink.fillText(heights[k], left - 5, this.placeY(y));
    });
    ink.textAlign = "center";
    ink.textBaseline = "top";
    const along = ticksOf(lowX, highX, (right - left) / 70);
    for (const x of along.ticks) {
      const place = this.placeX(x);
      ink.moveTo(place, bottom);
      ink.lineTo(place, bottom + 3);
      const text = marked(x, along.step, Math.max(Math.abs(lowX), Math.abs(highX))) + (this.along && x === along.ticks.at(-1) ? ` ${this.along}` : "");
      ink.fillText(text, Math.min(place, this.width - 2 - ink.measureText(text).width / 2), bottom + 5);
    }
    ink.stroke();
    if (this.across) ink.fillText(this.across, (left + right) / 2, bottom + 18);
    ink.textAlign = "left";
    ink.textBaseline = "alphabetic";
    ink.fillStyle = this.colours.ink;
    ink.font = "600 12px system-ui, sans-serif";
    ink.fillText(this.unit ? `${this.title} (${this.unit})` : this.title, 8, 14);
    this.names(ink, legend);
  }

  /** Draw within the axes. */
  inside(ink, paint) {
    ink.save();
    ink.beginPath();
    ink.rect(this.left, this.top, this.right - this.left, this.bottom - this.top);
    ink.clip();
    paint();
    ink.restore();
  }

  /** Draw places of a curve from the first to before the end: of those in a column of pixels the first, the lowest, the
   * highest and the last, which look as all. `begun` is the length of the curve before; returns the one after. */
  trace(ink, number, { x, value }, first, end, begun = 0) {
    ink.strokeStyle = CURVES[number % CURVES.length];
    ink.setLineDash(dashed(number) ? [6, 3] : []);
    const lineCap = dashed(number) ? "butt" : "round";
    Object.assign(ink, { lineDashOffset: begun, lineWidth: 1.7, lineJoin: "round", lineCap });
    ink.beginPath();
    let [length, at, column] = [begun, null, null]; // column: places [x, y, k] of its first, lowest, highest and last
    const go = (place) => {
      if (at) ink.lineTo(place[0], place[1]);
      else ink.moveTo(place[0], place[1]);
      if (at) length += Math.hypot(place[0] - at[0], place[1] - at[1]);
      at = place;
    };
    const close = () => {
      if (!column) return;
      const [one, low, high, last] = column;
      for (const place of low[2] < high[2] ? [one, low, high, last] : [one, high, low, last]) if (place !== at) go(place);
      column = null;
    };
    for (let k = first; k < end; k++) {
      const y = value(k);
      if (!Number.isFinite(y)) {
        close();
        at = null;
        continue;
      }
      const place = [this.placeX(x(k)), this.placeY(y), k];
      if (column && Math.floor(place[0] * this.ratio) !== Math.floor(column[0][0] * this.ratio)) close();
      if (!column) column = [place, place, place, place];
      if (place[1] < column[1][1]) column[1] = place;
      if (place[1] > column[2][1]) column[2] = place;
      column[3] = place;
    }
    close();
    ink.stroke();
    return length;
  }

  /** Places of the names of the curves, in as many rows as they need, three at most; names without room are counted. */
  legend(ink, curves) {
    const shown = [];
    let [x, row] = [8, 0];
    for (const [number, { name }] of curves.entries()) {
      const width = ink.measureText(name).width + 26;
      if (x > 8 && x + width > this.width) [x, row] = [8, row + 1];
      if (row > 2) {
        shown.push({ name: `and ${curves.length - number} more`, number: null, x: shown.at(-1).end, row: 2 });
        break;
      }
      shown.push({ name, number, x, row, end: x + width });
      x += width;
    }
    return shown;
  }

  /** The names of the curves, each after a piece of its line. */
  names(ink, legend) {
    ink.font = "11px system-ui, sans-serif";
    ink.lineWidth = 2.5;
    for (const { name, number, x, row } of legend) {
      const y = 28 + 14 * row;
      ink.strokeStyle = number === null ? "transparent" : CURVES[number % CURVES.length];
      ink.setLineDash(dashed(number) ? [4, 2] : []);
      ink.beginPath();
      ink.moveTo(x, y);
      ink.lineTo(x + 12, y);
      ink.stroke();
      ink.fillStyle = this.colours.ink;
      ink.fillText(name, number === null ? x : x + 15, y + 4);
    }
    ink.setLineDash([]);
  }

  /** Zoom by dragging over a part of the abscissa; a double click shows all again. */
  zoomable(redraw) {
    let begin = null;
    const within = (event) => Math.min(Math.max(event.offsetX, this.left), this.right);
    const valueAt = (place) => this.shown.x[0] + ((place - this.left) / (this.right - this.left)) * (this.shown.x[1] - this.shown.x[0]);
    this.canvas.addEventListener("pointerdown", (event) => {
      begin = within(event);
      this.canvas.setPointerCapture(event.pointerId);
    });
    this.canvas.addEventListener("pointermove", (event) => {
      if (begin === null) return;
      this.dragged = [begin, within(event)];
      redraw(this);
    });
    this.canvas.addEventListener("pointerup", (event) => {
      const end = within(event);
      if (begin !== null && Math.abs(end - begin) > 4) {
        this.view = { x: [valueAt(Math.min(begin, end)), valueAt(Math.max(begin, end))], y: null };
      }
      [begin, this.dragged] = [null, null];
      redraw(this);
    });
    this.canvas.addEventListener("dblclick", () => {
      this.view = null;
      redraw(this);
    });
  }
}

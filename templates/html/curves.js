// -- curves over time or another column: axes, ticks, lines, a cursor; zoom by dragging ---------------------------------

/** Colours of curves, in order; the later half is dashed as well. */
const CURVES = ["#3f7fdb", "#ef8b2c", "#34a56f", "#d6455b", "#8d70d8", "#24a4b5"];

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

  draw(series, { from, to, cursor = null, marks = [] }) {
    this.size();
    const ink = this.canvas.getContext("2d");
    ink.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    ink.clearRect(0, 0, this.width, this.height);
    ink.font = "11px system-ui, sans-serif";
    const legend = this.legend(ink, series.curves);
    const [right, top, bottom] = [this.width - 10, 28 + 14 * (legend.at(-1).row + 1), this.height - (this.across ? 32 : 20)];
    const [lowX, highX] = this.view ? this.view.x : [from, to > from ? to : from + 1];
    const [lowY, highY] = this.view && this.view.y ? this.view.y : this.fitted(series, lowX, highX);
    const up = ticksOf(lowY, highY, (bottom - top) / 34);
    const heights = up.ticks.map((y) => marked(y, up.step, Math.max(Math.abs(lowY), Math.abs(highY))));
    const left = Math.max(52, 12 + Math.max(0, ...heights.map((text) => ink.measureText(text).width)));
    Object.assign(this, { left, right, top, bottom, shown: { x: [lowX, highX], y: [lowY, highY] } });
    const placeX = (x) => left + ((x - lowX) / (highX - lowX)) * (right - left);
    const placeY = (y) => bottom - ((y - lowY) / (highY - lowY)) * (bottom - top);
    ink.fillStyle = this.colours.soft;
    ink.strokeStyle = this.colours.line;
    ink.lineWidth = 1;
    ink.textBaseline = "middle";
    ink.textAlign = "right";
    up.ticks.forEach((y, k) => {
      ink.beginPath();
      ink.moveTo(left, placeY(y));
      ink.lineTo(right, placeY(y));
      ink.stroke();
      ink.fillText(heights[k], left - 5, placeY(y));
    });
    ink.textAlign = "center";
    ink.textBaseline = "top";
    const along = ticksOf(lowX, highX, (right - left) / 70);
    for (const x of along.ticks) {
      ink.beginPath();
      ink.moveTo(placeX(x), bottom);
      ink.lineTo(placeX(x), bottom + 3);
      ink.stroke();
      const text = marked(x, along.step, Math.max(Math.abs(lowX), Math.abs(highX))) + (this.along && x === along.ticks.at(-1) ? ` ${this.along}` : "");
      ink.fillText(text, Math.min(placeX(x), this.width - 2 - ink.measureText(text).width / 2), bottom + 5);
    }
    if (this.across) ink.fillText(this.across, (left + right) / 2, bottom + 18);
    ink.textAlign = "left";
    ink.textBaseline = "alphabetic";
    ink.fillStyle = this.colours.ink;
    ink.font = "600 12px system-ui, sans-serif";
    ink.fillText(this.unit ? `${this.title} (${this.unit})` : this.title, 8, 14);
    this.names(ink, legend);
    ink.save();
    ink.beginPath();
    ink.rect(left, top, right - left, bottom - top);
    ink.clip();
    for (const mark of marks) {
      ink.strokeStyle = this.colours.line;
      ink.setLineDash([2, 3]);
      ink.beginPath();
      ink.moveTo(placeX(mark), top);
      ink.lineTo(placeX(mark), bottom);
      ink.stroke();
    }
    series.curves.forEach(({ value, count = series.count, x = series.x }, number) => {
      ink.strokeStyle = CURVES[number % CURVES.length];
      ink.setLineDash(number >= 3 ? [6, 3] : []);
      ink.lineWidth = 1.7;
      ink.lineJoin = "round";
      ink.beginPath();
      let begun = false;
      for (let k = 0; k < count; k++) {
        const y = value(k);
        if (!Number.isFinite(y)) {
          begun = false;
          continue;
        }
        const place = [placeX(x(k)), placeY(y)];
        if (begun) ink.lineTo(...place);
        else ink.moveTo(...place);
        begun = true;
      }
      ink.stroke();
    });
    ink.setLineDash([]);
    if (cursor !== null) {
      ink.strokeStyle = this.colours.soft;
      ink.lineWidth = 1;
      ink.beginPath();
      ink.moveTo(placeX(cursor), top);
      ink.lineTo(placeX(cursor), bottom);
      ink.stroke();
    }
    if (this.dragged) {
      ink.fillStyle = "rgba(90, 140, 230, 0.18)";
      ink.fillRect(this.dragged[0], top, this.dragged[1] - this.dragged[0], bottom - top);
    }
    ink.restore();
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
      ink.setLineDash(number >= 3 ? [4, 2] : []);
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

// -- a chart whose curves grow: what it shows is kept, and only their new ends are drawn --------------------------------------

/** Pixels by which curves grow before their ends go into the kept picture: pieces shorter than a pixel would blend badly. */
const GROWTH = 8;

/** A chart of series { first, count, x(k), curves }, of which places `first` to `count` are in sight. */
class GrowingChart extends Chart {
  constructor(canvas, words) {
    super(canvas, words);
    Object.assign(this, { kept: document.createElement("canvas"), range: [0, 0], period: "", key: "" });
  }

  /** Draw the curves with marks at times and a cursor. Places of one `edition` do not change once they are drawn. */
  draw(series, { from, to, cursor, marks, edition }) {
    this.size();
    const { first, count, x, curves } = series;
    this.stretch(series, JSON.stringify([from, to, edition]));
    const key = JSON.stringify([this.period, this.range, this.width, this.height, this.ratio, this.colours]);
    const kept = this.kept.getContext("2d");
    const fresh = key !== this.key;
    if (fresh) {
      [this.kept.width, this.kept.height] = [this.canvas.width, this.canvas.height];
      this.frame(kept, curves, [from, to], this.range);
      Object.assign(this, { key, drawn: first, lengths: curves.map(() => 0), marked: -Infinity });
    }
    const grow = (ink) => curves.map(({ value }, number) => this.trace(ink, number, { x, value }, this.drawn, count, this.lengths[number]));
    const late = marks.filter((mark) => mark > this.marked);
    if (late.length) this.inside(kept, () => this.upright(kept, late, this.colours.line, [2, 3]));
    this.marked = late.at(-1) ?? this.marked;
    if (fresh || this.placeX(x(count - 1)) - this.placeX(x(this.drawn)) > GROWTH) {
      this.inside(kept, () => (this.lengths = grow(kept)));
      this.drawn = count - 1;
    }
    const ink = this.canvas.getContext("2d");
    ink.setTransform(1, 0, 0, 1, 0, 0);
    ink.clearRect(0, 0, this.canvas.width, this.canvas.height);
    ink.drawImage(this.kept, 0, 0);
    ink.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    this.inside(ink, () => {
      grow(ink);
      this.upright(ink, [cursor], this.colours.soft, []);
    });
  }

  /** Take new values into the range of the ordinate, which grows until the abscissa changes. */
  stretch({ first, count, curves }, period) {
    if (period !== this.period) Object.assign(this, { period, seen: first, low: Infinity, high: -Infinity });
    const begun = this.seen === first;
    for (const { value } of curves) {
      for (let k = this.seen; k < count; k++) {
        const y = value(k);
        if (y < this.low) this.low = y;
        if (y > this.high) this.high = y;
      }
    }
    this.seen = count;
    const margin = 0.02 * (this.range[1] - this.range[0]);
    if (begun || this.low < this.range[0] + margin || this.high > this.range[1] - margin) this.range = rangeOf(this.low, this.high);
  }

  /** Draw upright lines at times. */
  upright(ink, moments, colour, dash) {
    ink.strokeStyle = colour;
    ink.lineWidth = 1;
    ink.setLineDash(dash);
    ink.lineDashOffset = 0;
    ink.beginPath();
    for (const moment of moments) {
      ink.moveTo(this.placeX(moment), this.top);
      ink.lineTo(this.placeX(moment), this.bottom);
    }
    ink.stroke();
  }
}

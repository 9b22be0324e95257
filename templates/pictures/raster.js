// -- surfaces of rigid shapes, pixel by pixel with their depths: a canvas fills paths of thousands of faces too slowly ---

/** Brightnesses of the faces of a shape. */
const LIGHTS = 24;

/** A picture of triangles over part of a canvas, with the inverse of the depth of each pixel. */
class Raster {
  constructor() {
    this.picture = document.createElement("canvas");
    Object.assign(this, { width: 0, height: 0, colours: new Uint32Array(0), depths: new Float32Array(0) });
  }

  /** Begin a picture, empty, over [left, top, right, bottom] of the canvas, with `scale` pixels in one of its units. */
  begin([left, top, right, bottom], scale) {
    const [width, height] = [Math.max(Math.ceil((right - left) * scale), 0), Math.max(Math.ceil((bottom - top) * scale), 0)];
    if (width * height > this.colours.length) {
      this.colours = new Uint32Array(width * height);
      this.depths = new Float32Array(width * height);
    }
    Object.assign(this, { left, top, scale, width, height });
    this.depths.fill(0, 0, width * height);
    this.clear();
  }

  /** Remove the colours and keep the depths: earlier shapes hide later ones. */
  clear() { this.colours.fill(0, 0, this.width * this.height); }

  /** Fill a triangle of places [x, y] on the canvas and inverse depths w, in one colour of four bytes. */
  fill(ax, ay, aw, bx, by, bw, cx, cy, cw, colour) {
    if (by < ay) [ax, ay, aw, bx, by, bw] = [bx, by, bw, ax, ay, aw];
    if (cy < ay) [ax, ay, aw, cx, cy, cw] = [cx, cy, cw, ax, ay, aw];
    if (cy < by) [bx, by, bw, cx, cy, cw] = [cx, cy, cw, bx, by, bw];
    const { left, top, scale, width, height, colours, depths } = this;
    ax = (ax - left) * scale; bx = (bx - left) * scale; cx = (cx - left) * scale;
    ay = (ay - top) * scale; by = (by - top) * scale; cy = (cy - top) * scale;
    const area = (bx - ax) * (cy - ay) - (cx - ax) * (by - ay);
    if (area === 0) return;
    const along = ((bw - aw) * (cy - ay) - (cw - aw) * (by - ay)) / area;
    const down = ((cw - aw) * (bx - ax) - (bw - aw) * (cx - ax)) / area;
    const [whole, upper, lower] = [(cx - ax) / (cy - ay), (bx - ax) / (by - ay), (cx - bx) / (cy - by)];
    const last = Math.min(height, Math.ceil(cy - 0.5));
    for (let row = Math.max(0, Math.ceil(ay - 0.5)); row < last; row++) {
      const y = row + 0.5;
      const one = ax + (y - ay) * whole;
      const other = y < by ? ax + (y - ay) * upper : bx + (y - by) * lower;
      const first = Math.max(0, Math.ceil((one < other ? one : other) - 0.5));
      const end = row * width + Math.min(width, Math.ceil((one < other ? other : one) - 0.5));
      let w = aw + (first + 0.5 - ax) * along + (y - ay) * down;
      for (let pixel = row * width + first; pixel < end; pixel++) {
        if (w > depths[pixel]) {
          depths[pixel] = w;
          colours[pixel] = colour;
        }
        w += along;
      }
    }
  }

  /** Whether a surface is in front of a place of the canvas at a depth. */
  hides([x, y], depth) {
    const [column, row] = [Math.floor((x - this.left) * this.scale), Math.floor((y - this.top) * this.scale)];
    return column >= 0 && row >= 0 && column < this.width && row < this.height && this.depths[row * this.width + column] * depth > 1;
  }

  paint(ink, alpha) {
    const { picture, width, height, left, top, scale } = this;
    if (width * height === 0) return;
    if (picture.width < width) picture.width = width;
    if (picture.height < height) picture.height = height;
    const bytesOf = new Uint8ClampedArray(this.colours.buffer, 0, 4 * width * height);
    picture.getContext("2d").putImageData(new ImageData(bytesOf, width, height), 0, 0);
    ink.globalAlpha = alpha;
    ink.drawImage(picture, 0, 0, width, height, left, top, width / scale, height / scale);
    ink.globalAlpha = 1;
  }
}

const raster = new Raster();

/** Shapes with their places on the canvas, and the part of the canvas that they cover. */
function projected(shapes, pose) {
  const { eye, right, above, forward, focal, middleX, middleY, near, width, height } = camera;
  const box = [width, height, 0, 0];
  for (const shape of shapes) {
    const here = pose(shape.carrier);
    const [rows, offset] = [[right, above, forward], minus(here.p, eye)];
    const [a, b, c] = rows.map((row) => [0, 1, 2].map((k) => row[0] * here.R[0][k] + row[1] * here.R[1][k] + row[2] * here.R[2][k]));
    const [p, q, r] = rows.map((row) => dot(row, offset));
    const { vertices, flat } = shape;
    for (let k = 0; k < vertices.length; k += 3) {
      const [x, y, z] = [vertices[k], vertices[k + 1], vertices[k + 2]];
      const depth = c[0] * x + c[1] * y + c[2] * z + r;
      const scale = focal / depth;
      const across = middleX + scale * (a[0] * x + a[1] * y + a[2] * z + p);
      const down = middleY - scale * (b[0] * x + b[1] * y + b[2] * z + q);
      flat[k] = across;
      flat[k + 1] = down;
      flat[k + 2] = depth > near ? 1 / depth : 0;
      if (depth <= near) continue;
      if (across < box[0]) box[0] = across;
      if (across > box[2]) box[2] = across;
      if (down < box[1]) box[1] = down;
      if (down > box[3]) box[3] = down;
    }
    shape.here = here;
  }
  return [Math.max(box[0], 0), Math.max(box[1], 0), Math.min(box[2], width), Math.min(box[3], height)];
}

/** Fill the faces of a shape that look at the camera, of an open one all of them; planes are in the shape's own frame. */
function fillShape({ here, flat, faces, normals, closed }, rgb, lightOf) {
  const back = [0, 1, 2].map((k) => [here.R[0][k], here.R[1][k], here.R[2][k]]);
  const [ex, ey, ez] = turned(back, minus(camera.eye, here.p));
  const [lx, ly, lz] = turned(back, lightOf);
  const fills = [...Array(LIGHTS + 1).keys()].map((k) => {
    const [red, green, blue] = shaded(rgb, 0.62 + (0.5 * k) / LIGHTS).map(Math.round);
    return ((255 << 24) | (blue << 16) | (green << 8) | red) >>> 0;
  });
  for (let face = 0, plane = 0; face < faces.length; face += 3, plane += 4) {
    const [nx, ny, nz] = [normals[plane], normals[plane + 1], normals[plane + 2]];
    const away = nx * ex + ny * ey + nz * ez <= normals[plane + 3];
    if (away && closed) continue;
    const [a, b, c] = [3 * faces[face], 3 * faces[face + 1], 3 * faces[face + 2]];
    if (flat[a + 2] === 0 || flat[b + 2] === 0 || flat[c + 2] === 0) continue;
    const light = (away ? -1 : 1) * (nx * lx + ny * ly + nz * lz);
    const fill = fills[light <= 0 ? 0 : light >= 1 ? LIGHTS : Math.round(LIGHTS * light)];
    raster.fill(flat[a], flat[a + 1], flat[a + 2], flat[b], flat[b + 1], flat[b + 2], flat[c], flat[c + 1], flat[c + 2], fill);
  }
}

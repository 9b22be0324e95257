// Vectors are arrays of three numbers, quaternions of four (w, x, y, z); a camera looks along `forward` from `eye`.
const plus = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
const minus = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
const times = (s, a) => [s * a[0], s * a[1], s * a[2]];
const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (a, b) => [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]];
const norm = (a) => Math.sqrt(dot(a, a));
const unit = (a) => times(1 / (norm(a) || 1), a);
const between = (a, b, s) => plus(a, times(s, minus(b, a)));

/** The rotation matrix of a unit quaternion, row by row. */
function matrixOf([w, x, y, z]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
    [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
    [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
  ];
}

const turned = (R, a) => [dot(R[0], a), dot(R[1], a), dot(R[2], a)];
const placed = (pose, a) => plus(turned(pose.R, a), pose.p);

/** Two directions that make a right-handed frame with a third. */
function across(direction) {
  const z = unit(direction);
  const helper = Math.abs(z[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0];
  const x = unit(cross(helper, z));
  return [x, cross(z, x)];
}

const SIGNS = [-0.5, 0.5];

/** The corners of a box of this size about zero. */
const cornersOf = (size) => SIGNS.flatMap((x) => SIGNS.flatMap((y) => SIGNS.map((z) => [x * size[0], y * size[1], z * size[2]])));

/** Vertices and faces (counterclockwise from outside) of a box or a cylinder in the frame (x, y, z) about a centre. */
function meshOf(kind, size, center, [x, y, z], sides) {
  const at = (a, b, c) => plus(center, plus(times(a, x), plus(times(b, y), times(c, z))));
  if (kind === "box") {
    const [a, b, c] = size.map((side) => side / 2);
    const vertices = [];
    for (const k of [-c, c]) for (const j of [-b, b]) for (const i of [-a, a]) vertices.push(at(i, j, k));
    return { vertices, faces: [[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]], smooth: 0 };
  }
  const [radius, height] = size;
  const vertices = [];
  for (const k of [-height / 2, height / 2]) {
    for (let i = 0; i < sides; i++) {
      const angle = (2 * Math.PI * i) / sides;
      vertices.push(at(radius * Math.cos(angle), radius * Math.sin(angle), k));
    }
  }
  const ring = [...Array(sides).keys()];
  const faces = ring.map((i) => [i, (i + 1) % sides, sides + ((i + 1) % sides), sides + i]);
  return { vertices, faces: [...faces, ring.slice().reverse(), ring.map((i) => sides + i)], smooth: sides };
}

/** A circle about the x axis. */
const sectionOf = (radius, sides) => [...Array(sides).keys()].map((i) => [0, radius * Math.cos((2 * Math.PI * i) / sides), radius * Math.sin((2 * Math.PI * i) / sides)]);

/** Vertices and faces of a tube around frames by the places of its section; each frame has the next `sides` vertices, which are placed by its pose. */
function tubeOf(frames, section) {
  const sides = section.length;
  const ring = [...Array(sides).keys()];
  const vertices = [...Array(frames).keys()].flatMap(() => section);
  const walls = [...Array(frames - 1).keys()].flatMap((k) => ring.map((i) => [i, (i + 1) % sides, sides + ((i + 1) % sides), sides + i].map((vertex) => k * sides + vertex)));
  const faces = [...walls, ring.slice().reverse(), ring.map((i) => (frames - 1) * sides + i)];
  return { vertices, faces, smooth: walls.length, sides };
}

/** The outline of a tube that is drawn flat: the outermost places of each ring, and the outer halves of both ends. */
function outlineOf(rings) {
  const middles = rings.map((ring) => times(1 / ring.length, ring.reduce(plus)));
  const last = rings.length - 1;
  const [left, right, ends] = [[], [], []];
  rings.forEach((ring, k) => {
    const [x, y] = minus(middles[Math.min(k + 1, last)], middles[Math.max(k - 1, 0)]);
    const aside = (place) => (place[1] - middles[k][1]) * x - (place[0] - middles[k][0]) * y;
    const ahead = (place) => (place[0] - middles[k][0]) * x + (place[1] - middles[k][1]) * y;
    const sorted = ring.slice().sort((a, b) => aside(a) - aside(b));
    left.push(sorted[0]);
    right.push(sorted.at(-1));
    if (k === 0 || k === last) ends.push(sorted.filter((place) => (k ? ahead(place) > 0 : ahead(place) < 0)));
  });
  return [...left, ...ends[1], ...right.reverse(), ...ends[0].reverse()];
}

/** Whether a straight line in the plane meets a circle about zero. */
function meets([ax, ay], [bx, by], radius) {
  const [dx, dy] = [bx - ax, by - ay];
  const share = Math.max(0, Math.min(1, -(dx * ax + dy * ay) / (dx * dx + dy * dy || 1)));
  return Math.hypot(ax + share * dx, ay + share * dy) <= radius;
}

/** Whether a straight line in the plane crosses a ray from zero. */
function crosses(a, b, ray) {
  const [first, second] = [a, b].map((p) => ray[0] * p[1] - ray[1] * p[0]);
  const [near, far] = [a, b].map((p) => ray[0] * p[0] + ray[1] * p[1]);
  return first * second < 0 && (first * far - second * near) * (first - second) > 0;
}

/** Angles of the points of a path in the plane around a circle about zero, from contact to contact; none without contact. */
function aroundCircle(a, b, side, radius) {
  const long = side !== null && crosses(a, b, [-side[0], -side[1]]);
  if (!long && !meets(a, b, radius)) return [];
  const turn = (a[0] * b[1] < a[1] * b[0]) !== long ? -1 : 1;
  const tilt = (p) => turn * Math.acos(radius / Math.hypot(p[0], p[1]));
  const start = Math.atan2(a[1], a[0]) + tilt(a);
  const round = 2 * Math.PI;
  const angle = (((turn * (Math.atan2(b[1], b[0]) - tilt(b) - start)) % round) + round) % round;
  const count = 1 + Math.ceil(angle / 0.1);
  return [...Array(count + 1).keys()].map((k) => start + (turn * angle * k) / count);
}

/** The angle at which a path through a ring about zero touches the ring: both lines have equal angles to the radius. */
function throughRing(a, b, radius) {
  if (meets(a, b, radius)) return [];
  const shares = [a, b].map((p) => radius / Math.hypot(p[0], p[1]));
  const turn = a[0] * b[1] - a[1] * b[0];
  const opening = Math.atan2(Math.abs(turn), a[0] * b[0] + a[1] * b[1]);
  let x = Math.PI / 2;
  for (let k = 0; k < 8; k++) {
    const parts = shares.map((share) => share * Math.sin(x));
    const slope = parts.reduce((sum, part, i) => sum + (shares[i] * Math.cos(x)) / Math.sqrt(1 - part * part), -2);
    x -= (opening - 2 * x + parts.reduce((sum, part) => sum + Math.asin(part), 0)) / slope;
  }
  return [Math.atan2(a[1], a[0]) + Math.sign(turn) * (x - Math.asin(shares[0] * Math.sin(x)))];
}

/** The points of a path on an obstacle between two places, as in the module `mechanics.forces.tendons`. */
function pointsOn(obstacle, first, second, pose) {
  const frame = pose(obstacle.carrier);
  const origin = placed(frame, obstacle.position);
  const [x, y, z] = [0, 1, 2].map((k) => turned(frame.R, obstacle.axes.map((row) => row[k])));
  const [from, to] = [first, second].map((place) => minus(place, origin));
  const u = obstacle.cylinder ? x : unit(from);
  const normal = cross(from, to);
  const v = obstacle.cylinder ? y : norm(normal) ? unit(cross(normal, from)) : across(from)[0];
  const flat = (place) => [dot(place, u), dot(place, v)];
  const [a, b, radius] = [flat(from), flat(to), obstacle.radius];
  if (Math.min(Math.hypot(...a), Math.hypot(...b)) <= radius) return [];
  const side = obstacle.side && flat(minus(placed(pose(obstacle.side.carrier), obstacle.side.position), origin));
  const angles = obstacle.inside ? throughRing(a, b, radius) : aroundCircle(a, b, side, radius);
  const contacts = angles.map((angle) => [radius * Math.cos(angle), radius * Math.sin(angle)]);
  const line = [a, ...contacts, b];
  const lengths = line.slice(1).map((p, k) => Math.hypot(p[0] - line[k][0], p[1] - line[k][1]));
  const rise = obstacle.cylinder ? dot(minus(to, from), z) / lengths.reduce((sum, part) => sum + part) : 0;
  let height = obstacle.cylinder ? dot(from, z) : 0;
  return contacts.map(([p, q], k) => {
    height += rise * lengths[k];
    return plus(origin, plus(plus(times(p, u), times(q, v)), times(height, z)));
  });
}

/** The points of a line of force over points and around obstacles. */
function pathOf(line, pose) {
  const places = line.path.map((point) => placed(pose(point.carrier), point.position));
  return places.flatMap((place, k) => {
    const obstacle = line.obstacles.find((item) => item.after === k);
    return obstacle ? [place, ...pointsOn(obstacle, place, places[k + 1], pose)] : [place];
  });
}

/** The corners of the convex polygon around points of the plane (Andrew's monotone chain). */
function hullOf(points) {
  const sorted = points.slice().sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1) {
        const [a, b] = chain.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        chain.pop();
      }
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** A camera that turns about a target; `up` is the direction that stays up, `x` the direction that angle 0 looks from. */
class Camera {
  constructor(up) {
    this.up = up;
    [this.x, this.y] = Math.abs(up[2]) > 0.999 ? [[1, 0, 0], [0, Math.sign(up[2]), 0]] : across(up);
    this.halfAngle = (17 * Math.PI) / 180;
    Object.assign(this, { azimuth: 0, elevation: 0, distance: 1, target: [0, 0, 0] });
    this.show(1, 1, { left: 0, right: 1, top: 0, bottom: 1 });
  }

  /** Take the size of the canvas and the part of it that nothing covers. */
  show(width, height, free) {
    Object.assign(this, { width, height, free });
    [this.middleX, this.middleY] = [(free.left + free.right) / 2, (free.top + free.bottom) / 2];
  }

  aim() {
    const [ca, sa, ce, se] = [Math.cos(this.azimuth), Math.sin(this.azimuth), Math.cos(this.elevation), Math.sin(this.elevation)];
    const out = plus(times(ce * ca, this.x), plus(times(ce * sa, this.y), times(se, this.up)));
    this.forward = times(-1, out);
    this.right = plus(times(-sa, this.x), times(ca, this.y));
    this.above = cross(this.right, this.forward);
    this.eye = plus(this.target, times(this.distance, out));
    this.focal = Math.min(this.width, this.height) / 2 / Math.tan(this.halfAngle);
    this.near = this.distance / 500;
  }

  /** Go as near as points, given against the target, still fit into the free part. */
  fit(points) {
    this.aim();
    const [wide, high] = [(this.free.right - this.free.left) / 2, (this.free.bottom - this.free.top) / 2];
    const needed = points.map((point) => {
      const [x, y] = [Math.abs(dot(point, this.right)) / wide, Math.abs(dot(point, this.above)) / high];
      return this.focal * Math.max(x, y) - dot(point, this.forward);
    });
    this.distance = 1.1 * needed.reduce((most, value) => Math.max(most, value), 0);
    this.aim();
  }

  /** Position on the canvas and distance along the line of sight, below `near` if the point cannot be drawn. */
  project(point) {
    const ray = minus(point, this.eye);
    const depth = dot(ray, this.forward);
    const scale = this.focal / Math.max(depth, this.near);
    return [this.middleX + scale * dot(ray, this.right), this.middleY - scale * dot(ray, this.above), depth];
  }

  /** Both ends of a line on the canvas, cut at the near plane; null if no part of it is in front. */
  segment(a, b) {
    const [da, db] = [a, b].map((point) => dot(minus(point, this.eye), this.forward));
    if (da < this.near && db < this.near) return null;
    const cut = (s) => between(a, b, s);
    const first = da < this.near ? cut((this.near * 1.001 - da) / (db - da)) : a;
    const second = db < this.near ? cut((this.near * 1.001 - da) / (db - da)) : b;
    return [this.project(first), this.project(second)];
  }
}

const byId = (name) => document.getElementById(name);
const page = document.documentElement;

/** Make an error visible to the viewer, person or program. */
window.addEventListener("error", (event) => {
  page.dataset.error = event.message;
  byId("warning").hidden = false;
  byId("warning").textContent = `The animation failed: ${event.message}`;
});

const scene = JSON.parse(byId("data").textContent);
const bytes = (text) => Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0)).buffer;
const carriers = scene.carriers;
// of all stored frames: a page that is computed while it plays stores further ones
let moments = new Float64Array(bytes(scene.times));
let poses = new Float32Array(bytes(scene.poses));
let count = moments.length;
let [start, end] = [moments[0], moments[count - 1]];

// -- motion ------------------------------------------------------------------------------------------------------------

const REST = { R: [[1, 0, 0], [0, 1, 0], [0, 0, 1]], p: [0, 0, 0] };

/** Pose of a carrier at a stored frame, or between it and the next. */
function poseAt(carrier, frame, part) {
  if (carrier < 0) return REST;
  const here = 7 * (frame * carriers + carrier);
  const a = poses.subarray(here, here + 7);
  if (part <= 0 || frame + 1 >= count) return { R: matrixOf(a.subarray(0, 4)), p: [a[4], a[5], a[6]] };
  const b = poses.subarray(here + 7 * carriers, here + 7 * carriers + 7);
  let sign = 0;
  for (let k = 0; k < 4; k++) sign += a[k] * b[k];
  const q = [0, 1, 2, 3].map((k) => (1 - part) * a[k] + part * Math.sign(sign || 1) * b[k]);
  const length = Math.hypot(...q) || 1;
  const p = [4, 5, 6].map((k) => (1 - part) * a[k] + part * b[k]);
  return { R: matrixOf(q.map((value) => value / length)), p };
}

/** The stored frame at or before a time, and how far the time is from it to the next, 0 to 1. */
function frameAt(time) {
  let [low, high] = [0, count - 1];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if (moments[middle] <= time) low = middle;
    else high = middle;
  }
  if (count === 1) return [0, 0];
  const part = (time - moments[low]) / (moments[high] - moments[low] || 1);
  return [low, Math.min(Math.max(part, 0), 1)];
}

// -- the scenery ------------------------------------------------------------------------------------------------------

const up = norm(scene.gravity) > 0 ? unit(times(-1, scene.gravity)) : [0, 0, 1];
const camera = new Camera(up);
const massive = scene.bodies.filter((body) => body.solid.kind !== "none");
const shapedBodies = new Set(scene.shapes.filter((shape) => shape.whole).map((shape) => shape.body));
const bodies = scene.bodies.map((body, index) => {
  const shaped = !body.axis && shapedBodies.has(index); // a beam is drawn with its shapes: it bends
  const colour = scene.shapes.find((shape) => shaped && shape.body === index && shape.own)?.color;
  return { ...body, shaped, colour: colour ? rgbOf(colour) : colourOf(body), reach: shaped ? [] : reachOf(body) };
});
/** Directions in which the outermost vertices of a shape cast its shadow. */
const DIRECTIONS = [-1, 0, 1].flatMap((x) => [-1, 0, 1].flatMap((y) => [-1, 0, 1].map((z) => [x, y, z]))).filter((direction) => norm(direction) > 0);

const shapes = scene.shapes.map((shape) => {
  const places = placesIn(shape);
  const [vertices, faces] = [Float64Array.from(places.flat()), new (shape.wide ? Uint32Array : Uint16Array)(bytes(shape.faces))];
  return {
    ...shape,
    vertices,
    faces,
    flat: new Float64Array(vertices.length), // places on the canvas with the inverses of their depths
    normals: planesOf(places, faces),
    outer: outermost(places),
    rgb: shape.color ? rgbOf(shape.color) : shape.body < 0 ? rgbOf("#8a94a3") : bodies[shape.body].colour,
    corners: cornersAmong(places),
  };
});

/** The vertices of a shape, which is stored in whole steps from its lowest corner. */
function placesIn({ vertices, low, step }) {
  const steps = new Uint16Array(bytes(vertices));
  return [...Array(steps.length / 3).keys()].map((k) => [0, 1, 2].map((j) => low[j] + step * steps[3 * k + j]));
}

/** Places that the picture of a body reaches, each in a carrier: corners around its solid, and the ends of its links. */
function reachOf(body) {
  if (body.axis) return body.axis.flatMap((carrier) => sectionOf(body.solid.size[0], 4).map((position) => ({ carrier, position })));
  return cornersAround(body).map((position) => ({ carrier: body.carrier, position }));
}

function cornersAround({ solid: { kind, size, center, axes }, links }) {
  if (kind === "none" || kind === "point") return [center, ...links];
  const [width, depth, height] = kind === "box" ? size : [2 * size[0], 2 * size[0], kind === "sphere" ? 2 * size[0] : size[1]];
  const corner = ([a, b, c]) => plus(center, plus(times(a, axes[0]), plus(times(b, axes[1]), times(c, axes[2]))));
  return [...cornersOf([width, depth, height]).map(corner), ...links];
}

/** The corners of the box around places. */
function cornersAmong(places) {
  const [low, high] = [Math.min, Math.max].map((pick) => [0, 1, 2].map((k) => places.reduce((value, place) => pick(value, place[k]), places[0][k])));
  return cornersOf(minus(high, low)).map((corner) => plus(between(low, high, 0.5), corner));
}

/** Planes of triangles in the frame of a rigid shape, four numbers each: the normal, and its product with places. */
function planesOf(places, faces) {
  const planes = new Float64Array((4 * faces.length) / 3);
  for (let face = 0; face < faces.length; face += 3) {
    const [a, b, c] = [0, 1, 2].map((k) => places[faces[face + k]]);
    const normal = unit(cross(minus(b, a), minus(c, b)));
    planes.set([...normal, dot(normal, a)], (4 * face) / 3);
  }
  return planes;
}

/** The vertices of a shape that lie farthest in some directions; all of a shape with few. */
function outermost(vertices) {
  if (vertices.length <= 2 * DIRECTIONS.length) return vertices;
  return DIRECTIONS.map((direction) => vertices.reduce((best, vertex) => (dot(vertex, direction) > dot(best, direction) ? vertex : best), vertices[0]));
}

/** Whether a solid hides a place of its body. */
function holds({ kind, size, center, axes }, place) {
  const [x, y, z] = axes.map((axis) => Math.abs(dot(axis, minus(place, center))));
  if (kind === "box") return x < size[0] / 2 && y < size[1] / 2 && z < size[2] / 2;
  if (kind === "cylinder") return Math.hypot(x, y) < size[0] && z < size[1] / 2;
  return kind === "sphere" && Math.hypot(x, y, z) < size[0];
}

/** Places around which the picture is laid, of solids, links and points: the outermost of each frame, in the world and
 * against the centre of the machine, and the box around all. */
const bounds = { low: [Infinity, Infinity, Infinity], high: [-Infinity, -Infinity, -Infinity], cloud: [], about: [], spread: 0, travel: 0, first: null };

/** Places that a frame reaches. */
function placesAt(frame) {
  const places = [];
  const take = (carrier, place) => places.push(placed(poseAt(carrier, frame, 0), place));
  for (const body of bodies) for (const { carrier, position } of body.reach) take(carrier, position);
  for (const shape of shapes) if (shape.carrier >= 0) for (const corner of shape.corners) take(shape.carrier, corner);
  for (const point of scene.points) if (point.drawn) take(point.carrier, point.position);
  for (const { center, radius } of scene.tyres) {
    for (const turn of SIGNS) for (const k of [0, 1, 2]) take(center.carrier, plus(center.position, times(2 * turn * radius, REST.R[k])));
  }
  return places;
}

/** Lay the picture around places, too. */
function widen(places) {
  bounds.cloud.push(...places);
  for (const [side, pick] of [["low", Math.min], ["high", Math.max]]) bounds[side] = bounds[side].map((value, k) => places.reduce((most, place) => pick(most, place[k]), value));
}

/** Lay the picture around a frame. */
function widenBy(frame) {
  const places = placesAt(frame);
  if (!places.length) return;
  const [low, high] = [Math.min, Math.max].map((pick) => [0, 1, 2].map((k) => places.reduce((value, place) => pick(value, place[k]), places[0][k])));
  const [middle, centre, outer] = [between(low, high, 0.5), centreAt(moments[frame]), outermost(places)];
  bounds.first = bounds.first || middle;
  bounds.travel = Math.max(bounds.travel, norm(minus(middle, bounds.first)));
  bounds.spread = Math.max(bounds.spread, norm(minus(high, low)));
  bounds.about.push(...outer.map((place) => minus(place, centre)));
  widen(outer);
}

const each = Math.max(1, Math.floor((count * bodies.length) / 24000)); // so many poses take a tenth of a second
for (let frame = 0; frame < count; frame += each) widenBy(frame);
bounds.spread ||= 1;
const following = bounds.travel > 3 * bounds.spread;
if (!following) {
  // joints, the base, and shapes that do not move belong into the picture as far as the machine stays large
  const [low, high] = [bounds.low.map((value) => value - bounds.spread / 4), bounds.high.map((value) => value + bounds.spread / 4)];
  const clamped = (place) => place.map((value, k) => Math.min(Math.max(value, low[k]), high[k]));
  for (let frame = 0; frame < count; frame += Math.max(1, Math.floor(count / 120))) {
    const seats = scene.joints.filter((joint) => joint.type !== "free" && !joint.unmarked).map(({ seat }) => placed(poseAt(seat.carrier, frame, 0), seat.position));
    widen((scene.base >= 0 ? [...seats, poseAt(scene.base, frame, 0).p] : seats).map(clamped));
  }
  widen(shapes.filter((shape) => shape.carrier < 0).flatMap((shape) => shape.corners).map(clamped));
}
const unitSize = following ? bounds.spread : norm(minus(bounds.high, bounds.low)) || 1;
const small = unitSize * 0.012;
for (const body of bodies) {
  const { kind, size, center, axes } = body.solid;
  const sides = bodies.length > 60 ? 10 : 28;
  if (body.shaped) {
    [body.mesh, body.pieces, body.ball] = [null, [], 0];
    continue;
  }
  body.mesh = kind === "box" || kind === "cylinder" ? meshOf(kind, size, center, axes, sides) : null;
  if (body.outline) body.mesh = tubeOf(body.axis.length, body.outline.map(([y, z]) => [0, y, z]));
  else if (body.axis) body.mesh = tubeOf(body.axis.length, sectionOf(size[0], Math.min(sides, size[0] < 0.05 * size[1] ? 14 : 28)));
  body.pieces = body.links.flatMap((link) => {
    const cuts = [...Array(13).keys()].map((k) => between(body.hub, link, k / 12));
    return cuts.slice(1).map((to, k) => ({ carrier: body.carrier, from: cuts[k], to, inside: holds(body.solid, between(cuts[k], to, 0.5)) }));
  });
  for (const { carrier, position } of body.ties || []) {
    body.pieces.push({ carrier, from: [0, 0, 0], to: position, inside: norm(position) < size[0] });
  }
  body.ball = body.axis ? 0 : kind === "sphere" ? size[0] : kind === "point" ? 1.6 * small : 0;
}
for (const joint of scene.joints) {
  const [x, y] = across(joint.axis);
  joint.mesh = joint.turns ? meshOf("cylinder", [0.8 * small, 2.6 * small], [0, 0, 0], [x, y, unit(joint.axis)], 12) : null;
}
const traces = new Map();

/** Pieces of a trace from frame to frame. */
const FINE = 4;

/** Places along a trace, FINE from frame to frame: on a cubic (Catmull-Rom) between gentle turns, straight at corners. */
function traceOf(point) {
  if (!traces.has(point)) traces.set(point, { places: [], path: [] });
  const { places, path } = traces.get(point);
  if (places.length < count) {
    const first = Math.max(places.length - 3, 0); // the last pieces bend with the next places
    for (let frame = places.length; frame < count; frame++) places.push(placed(poseAt(point.carrier, frame, 0), point.position));
    path.length = Math.min(path.length, FINE * first);
    for (let k = first; k < count; k++) path.push(...(k + 1 < count ? curveFrom(places, k) : [places[k]]));
  }
  return path;
}

function curveFrom(places, k) {
  const [a, b] = [places[k], places[k + 1]];
  const [before, after] = [places[Math.max(k - 1, 0)], places[Math.min(k + 2, count - 1)]];
  const gentle = (from, to) => dot(from, to) >= 0.5 * norm(from) * norm(to);
  const round = k > 0 && k + 2 < count && gentle(minus(a, before), minus(b, a)) && gentle(minus(b, a), minus(after, b));
  const [start, end] = round ? [times(0.5, minus(b, before)), times(0.5, minus(after, a))] : [minus(b, a), minus(b, a)];
  return [...Array(FINE).keys()].map((piece) => {
    const s = piece / FINE;
    const bend = plus(times(s * (1 - s) * (1 - s), minus(start, minus(b, a))), times(-s * s * (1 - s), minus(end, minus(b, a))));
    return plus(between(a, b, s), bend);
  });
}

let middle = between(bounds.low, bounds.high, 0.5);

/** Height of the ground along `up`: at zero, or below all that hangs lower. */
const lowest = dot(middle, up) + Math.min(...cornersOf(minus(bounds.high, bounds.low)).map((corner) => dot(corner, up)));
const level = scene.ground ? dot(scene.ground, up) : lowest < -0.01 * unitSize || lowest > unitSize ? lowest - 0.02 * unitSize : Math.min(0, lowest);
const spacing = (() => {
  const rough = unitSize / 6;
  const power = 10 ** Math.floor(Math.log10(rough));
  return power * [1, 2, 5, 10].find((factor) => factor * power >= rough * 0.999);
})();

// -- state of the page -------------------------------------------------------------------------------------------------

const hash = new URLSearchParams(location.hash.slice(1));
const asked = hash.has("t") ? Number(hash.get("t")) : NaN;
const calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
const shown = { solids: true, glass: true, names: false, sections: hash.has("sections"), joints: true, ground: true, shadows: true, follow: following, repeat: true };
const state = {
  time: Number.isFinite(asked) ? Math.min(Math.max(asked, start), end) : start,
  playing: !Number.isFinite(asked) && !calm && count > 1,
  speed: 1,
  lit: null,
};
const SPEEDS = [0.001, 0.002, 0.005, 0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100, 1000];
state.speed = (() => {
  const length = end - start;
  if (length >= 3 && length <= 90) return 1;
  return SPEEDS.reduce((best, speed) => (Math.abs(Math.log(length / speed / 10)) < Math.abs(Math.log(length / best / 10)) ? speed : best), 1);
})();

/** Whether the first view is still the one shown: then it follows the window's size. */
let untouched = true;

function resetView() {
  const extent = minus(bounds.high, bounds.low);
  middle = between(bounds.low, bounds.high, 0.5);
  const [wide, deep] = [Math.abs(dot(extent, camera.x)), Math.abs(dot(extent, camera.y))];
  camera.target = following ? centreAt(state.time) : middle;
  // a machine that moves in a plane is looked at from the side of that plane
  camera.azimuth = deep < 0.4 * wide ? -1.28 : wide < 0.4 * deep ? 0.29 : -0.92;
  camera.elevation = Math.min(deep, wide) < 0.4 * Math.max(deep, wide) ? 0.2 : 0.36;
  const least = cornersOf([1, 1, 1].map((side) => 0.15 * side * unitSize));
  camera.fit([...least, ...(following ? bounds.about : [...bounds.cloud, ...axesTips()].map((place) => minus(place, middle)))]);
  untouched = true;
}

/** Tips of the axes that are drawn: of the base at some frames, and of the world if they are near. */
function axesTips() {
  const tips = (pose, length) => [0, 1, 2].map((k) => placed(pose, times(length, REST.R[k])));
  const world = norm(middle) < unitSize ? tips(REST, 0.14 * unitSize) : [];
  if (scene.base < 0) return world;
  const frames = [...Array(24).keys()].map((k) => Math.round((k * (count - 1)) / 23));
  return [...world, ...frames.flatMap((frame) => tips(poseAt(scene.base, frame, 0), 0.12 * unitSize))];
}

/** Centre of a body, of a beam the middle of its bent axis. */
function middleOf(body, pose) {
  return body.axis ? pose(body.axis[body.axis.length >> 1]).p : placed(pose(body.carrier), body.solid.center);
}

function centreAt(time) {
  const [frame, part] = frameAt(time);
  let sum = [0, 0, 0];
  for (const body of bodies) sum = plus(sum, middleOf(body, (carrier) => poseAt(carrier, frame, part)));
  return times(1 / bodies.length, sum);
}

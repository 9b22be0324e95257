// -- drawing -----------------------------------------------------------------------------------------------------------

const canvas = byId("view");
const ink = canvas.getContext("2d");
let style = {};

function readStyle() {
  const computed = getComputedStyle(page);
  for (const name of ["sky", "ground", "ink", "soft", "line", "shadow", "steel"]) style[name] = computed.getPropertyValue(`--${name}`).trim();
  style.dark = rgbOf(style.sky)[0] < 128;
}

/** Frames of a trace that are in sight, and widths of the canvas that it is long: a motion without end leaves a trace of the
 * last seconds, and a fast one draws over itself. */
const [LONGEST, WIDEST] = scene.live ? [600, 4] : [Infinity, Infinity];

const css = (rgb, alpha) => `rgba(${rgb.map((value) => Math.round(value)).join(", ")}, ${alpha})`;
/** A colour that stands out from the background: on a dark one black is grey. */
const inSight = (rgb) => (style.dark && Math.max(...rgb) < 90 ? between(rgb, [255, 255, 255], 0.18) : rgb);
const shaded = (rgb, light) => rgb.map((value) => (light < 1 ? value * light : value + (255 - value) * (light - 1)));

function line(points, colour, width, alpha = 1) {
  ink.globalAlpha = alpha;
  ink.strokeStyle = colour;
  ink.lineWidth = width;
  ink.beginPath();
  points.forEach(([x, y], k) => (k ? ink.lineTo(x, y) : ink.moveTo(x, y)));
  ink.stroke();
  ink.globalAlpha = 1;
}

function polygon(points, fill, stroke) {
  ink.beginPath();
  points.forEach(([x, y], k) => (k ? ink.lineTo(x, y) : ink.moveTo(x, y)));
  ink.closePath();
  ink.fillStyle = fill;
  ink.fill();
  if (stroke) {
    ink.strokeStyle = stroke;
    ink.lineWidth = 1;
    ink.stroke();
  }
}

function label(text, [x, y], colour) {
  ink.font = "12px system-ui, sans-serif";
  ink.lineWidth = 3;
  ink.strokeStyle = style.sky;
  ink.fillStyle = colour || style.ink;
  ink.strokeText(text, x, y);
  ink.fillText(text, x, y);
}

/** Lines of the ground, brightest below the scene; whether one ends on the canvas: a falling machine leaves them behind. */
function drawGround(centre) {
  let seen = false;
  const foot = plus(centre, times(level - dot(centre, up), up));
  const snap = (direction) => Math.round(dot(foot, direction) / spacing) * spacing;
  const origin = plus(plus(times(snap(camera.x), camera.x), times(snap(camera.y), camera.y)), times(level, up));
  const reach = 14;
  const lots = new Map(); // lines of one width and brightness are one path, which is filled faster than a path for each
  ink.lineCap = "butt";
  for (const [along, other] of [[camera.x, camera.y], [camera.y, camera.x]]) {
    for (let k = -reach; k <= reach; k++) {
      const side = plus(origin, times(k * spacing, other));
      const major = Math.round(dot(side, other) / spacing) % 5 === 0;
      for (let m = -reach; m < reach; m++) {
        const far = Math.hypot(k, m + 0.5) / reach;
        if (far >= 1) continue;
        const ends = camera.segment(plus(side, times(m * spacing, along)), plus(side, times((m + 1) * spacing, along)));
        if (!ends) continue;
        const lot = 2 * Math.ceil(16 * (1 - far * far)) + (major ? 1 : 0);
        if (!lots.has(lot)) lots.set(lot, []);
        lots.get(lot).push(ends);
        seen ||= ends.some(([x, y]) => x > 0 && y > 0 && x < camera.width && y < camera.height);
      }
    }
  }
  ink.strokeStyle = style.line;
  for (const [lot, lines] of lots) {
    const major = lot % 2 === 1;
    ink.globalAlpha = ((lot >> 1) / 16) * (major ? 1 : 0.7);
    ink.lineWidth = major ? 1.5 : 1;
    ink.beginPath();
    for (const [from, to] of lines) {
      ink.moveTo(from[0], from[1]);
      ink.lineTo(to[0], to[1]);
    }
    ink.stroke();
  }
  ink.globalAlpha = 1;
  return seen;
}

/** Places of the middle of a road, of a moving road around the wheel at a time. */
function placesOf(road, wheel, time) {
  if (road.places) return road.places;
  const last = road.times.length - 1;
  const row = Math.max(0, road.times.findLastIndex((moment) => moment <= time));
  const next = Math.min(row + 1, last);
  const part = next > row ? (time - road.times[row]) / (road.times[next] - road.times[row]) : 0;
  const [x, y] = placed(wheel, road.center.position);
  return road.along.map((ahead, k) => [x + ahead, y, (1 - part) * road.heights[row][k] + part * road.heights[next][k]]);
}

/** A road as a strip with bright edges. */
function addRoad(add, road, wheel, time) {
  const places = placesOf(road, wheel, time);
  const sides = places.map((place, k) => {
    const ahead = minus(places[Math.min(k + 1, places.length - 1)], places[Math.max(k - 1, 0)]);
    const across = unit([-ahead[1], ahead[0], 0]);
    return [-0.5, 0.5].map((side) => camera.project(plus(place, times(side * road.width, across))));
  });
  for (let k = 0; k + 1 < sides.length; k++) {
    const face = [sides[k][0], sides[k + 1][0], sides[k + 1][1], sides[k][1]];
    if (face.some((corner) => corner[2] <= camera.near)) continue;
    const depth = Math.max(...face.map((corner) => corner[2]));
    add(depth, between(face[0], face[2], 0.5), () => {
      polygon(face, css(rgbOf(style.steel), 0.28), "");
      for (const [from, to] of [[0, 1], [3, 2]]) line([face[from], face[to]], style.steel, 1.6, 0.8);
    });
  }
}

/** Colours of x, y and z. */
const AXES = ["#d8414f", "#2f9e57", "#3b76e0"];

function drawAxes(pose, length, name, lettered = () => true) {
  const [, , depth] = camera.project(pose.p);
  if (depth < camera.near) return;
  AXES.forEach((colour, k) => {
    const tip = placed(pose, [0, 1, 2].map((j) => (j === k ? length : 0)));
    const ends = camera.segment(pose.p, tip);
    if (ends) {
      line(ends, colour, 2);
      if (lettered(tip, k)) label("xyz"[k], [ends[1][0] + 4, ends[1][1] + 4], colour);
    }
  });
  if (name) label(name, [camera.project(pose.p)[0] + 6, camera.project(pose.p)[1] + 16], style.soft);
}

/** The pieces of a coil that is drawn flat; each goes a little round the next corner, so that the corners are whole. */
function zigzag(ends, amplitude) {
  const [a, b] = ends;
  const length = Math.hypot(b[0] - a[0], b[1] - a[1]);
  if (length < 1e-6) return [ends];
  const [tx, ty] = [(b[0] - a[0]) / length, (b[1] - a[1]) / length];
  const turns = 9;
  const points = [a];
  for (let k = 0; k <= 2 * turns; k++) {
    const s = length * (0.14 + (0.72 * k) / (2 * turns));
    const w = k % (2 * turns) === 0 ? 0 : k % 2 ? amplitude : -amplitude;
    points.push([a[0] + s * tx - w * ty, a[1] + s * ty + w * tx, a[2] + (s / length) * (b[2] - a[2])]);
  }
  points.push(b);
  return points.slice(1).map((point, k) => [points[k], point, ...(k + 2 < points.length ? [between(point, points[k + 2], 0.2)] : [])]);
}

/** The pieces of a line on the canvas, each a pair of ends with their depths. */
const cutUp = (ends, pieces) => [...Array(pieces).keys()].map((k) => [between(...ends, k / pieces), between(...ends, (k + 1) / pieces)]);

function dashes(ends) {
  const pieces = Math.max(1, Math.min(60, Math.round(Math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]) / 9)));
  return cutUp(ends, pieces).map(([a, b]) => [a, between(a, b, 0.55)]);
}

function draw() {
  const [frame, part] = frameAt(state.time);
  if (shown.follow) camera.target = plus(centreAt(state.time), camera.shift || [0, 0, 0]);
  camera.aim();
  const ratio = window.devicePixelRatio || 1;
  ink.setTransform(ratio, 0, 0, ratio, 0, 0);
  const sky = ink.createLinearGradient(0, 0, 0, camera.height);
  sky.addColorStop(0, style.sky);
  sky.addColorStop(1, style.ground);
  ink.fillStyle = sky;
  ink.fillRect(0, 0, camera.width, camera.height);
  ink.lineJoin = "round";
  const pose = (carrier) => poseAt(carrier, frame, part);
  const things = [];
  const add = (depth, place, paint) => depth > camera.near && things.push({ depth, place, paint });
  // a long line goes in and out of things that are nearer, so its pieces are sorted one by one
  const addLine = (ends, shape, lift, paint) => {
    if (ends) for (const piece of shape(ends)) add((piece[0][2] + piece.at(-1)[2]) / 2 - lift, between(piece[0], piece.at(-1), 0.5), () => paint(piece));
  };
  const lightOf = unit(plus(plus(times(-0.35, camera.right), times(0.8, camera.above)), times(-0.65, camera.forward)));
  const faded = (index) => (state.lit === null || state.lit === index ? 1 : 0.18);

  let squares = false;
  if (shown.ground) {
    squares = drawGround(shown.follow ? camera.target : middle);
    const reach = 0.12 * unitSize;
    // letters of the base would cover those of the world next to them
    if (scene.base >= 0) drawAxes(pose(scene.base), 0.1 * unitSize, "base", (tip, k) => norm(minus(tip, times(reach, REST.R[k]))) > 0.6 * reach);
    drawAxes(REST, reach, "");
  }

  bodies.forEach((body, index) => {
    const here = pose(body.carrier);
    const seen = faded(index);
    if (body.mesh && shown.solids) {
      const frames = body.axis ? body.axis.map(pose) : [here];
      const world = body.mesh.vertices.map((vertex, k) => placed(frames[body.axis ? Math.floor(k / body.mesh.sides) : 0], vertex));
      const flat = world.map((vertex) => camera.project(vertex));
      if (shown.shadows && shown.ground && seen === 1) castShadow(world, body.mesh.sides);
      if (shown.glass) addGlass(add, body, world, flat, seen);
      else addFaces(add, body.mesh, world, flat, body.colour, seen, lightOf);
    }
    if (body.ball && shown.solids) {
      const centre = placed(here, body.solid.center);
      const [x, y, depth] = camera.project(centre);
      if (shown.shadows && shown.ground && seen === 1) castBall(centre, body.ball);
      add(depth - body.ball, [x, y], () => drawBall(x, y, (body.ball * camera.focal) / depth, body.colour, (shown.glass && body.solid.kind === "sphere" ? 0.6 : 1) * seen));
    }
    for (const piece of body.pieces) {
      if (!piece.inside || shown.glass || !shown.solids) {
        const ends = camera.segment(placed(pose(piece.carrier), piece.from), placed(pose(piece.carrier), piece.to));
        if (ends) add((ends[0][2] + ends[1][2]) / 2 - small, between(...ends, 0.5), () => line(ends, css(shaded(body.colour, 0.8), 1), 3.5, seen));
      }
    }
    if (shown.sections && body.outline) {
      const length = Math.max(4 * body.solid.size[0], 2 * small);
      body.axis.filter((_, k) => k % body.pieces_of_element === 0).forEach((carrier) => addSection(add, body, pose(carrier), length));
    }
    if (shown.names && (body.shaped || body.mesh || body.ball || body.links.length)) {
      const [x, y, depth] = camera.project(middleOf(body, pose));
      if (depth > camera.near) things.push({ depth: 0, place: [x, y], paint: () => label(body.name, [x + 6, y - 6]) });
    }
  });

  const surfaces = shown.solids ? shapes : [];
  for (const shape of shown.shadows && shown.ground ? surfaces : []) {
    if (shape.carrier >= 0 && faded(shape.body) === 1) castShadow(shape.outer.map((vertex) => placed(pose(shape.carrier), vertex)));
  }

  for (const joint of scene.joints) {
    if (!shown.joints || joint.unmarked || joint.type === "free" || joint.type === "fixed") continue;
    const child = pose(joint.child);
    const seat = placed(pose(joint.seat.carrier), joint.seat.position);
    if (joint.slides) {
      addLine(camera.segment(seat, child.p), (ends) => dashes(ends), 0, (piece) => line(piece, style.steel, 1.5));
    }
    if (joint.mesh) {
      const placedMesh = joint.mesh.vertices.map((vertex) => placed(child, vertex));
      const flat = placedMesh.map((vertex) => camera.project(vertex));
      joint.mesh.faces.forEach((face) => {
        const normal = unit(cross(minus(placedMesh[face[1]], placedMesh[face[0]]), minus(placedMesh[face[2]], placedMesh[face[1]])));
        const middle = between(placedMesh[face[0]], placedMesh[face[face.length >> 1]], 0.5);
        if (dot(normal, minus(middle, camera.eye)) >= 0) return;
        const colour = shaded(rgbOf(style.steel), 0.75 + 0.45 * Math.max(0, dot(normal, lightOf)));
        const fill = css(colour, state.lit === null ? 1 : 0.4);
        add(camera.project(middle)[2] - small, camera.project(middle), () => polygon(face.map((k) => flat[k]), fill, fill));
      });
    } else {
      const [x, y, depth] = camera.project(child.p);
      add(depth - small, [x, y], () => drawBall(x, y, (0.7 * small * camera.focal) / depth, rgbOf(style.steel), state.lit === null ? 1 : 0.4));
    }
  }

  for (const spring of scene.springs) {
    if (spring.path) {
      const places = pathOf(spring, pose);
      places.slice(1).forEach((place, k) => addLine(camera.segment(places[k], place), (both) => [both], small, (piece) => line(piece, style.steel, 2.5, state.lit === null ? 1 : 0.4)));
      continue;
    }
    const ends = camera.segment(placed(pose(spring.first.carrier), spring.first.position), placed(pose(spring.second.carrier), spring.second.position));
    const amplitude = (2 * small * camera.focal) / (ends ? ends[0][2] : 1);
    const shape = spring.elastic ? (both) => zigzag(both, amplitude) : (both) => [both];
    addLine(ends, shape, small, (piece) => line(piece, style.steel, spring.elastic ? 2 : 3.5, state.lit === null ? 1 : 0.4));
  }
  for (const rod of scene.rods) {
    const ends = camera.segment(...rod.ends.map((item) => placed(pose(item.carrier), item.position)));
    addLine(ends, (both) => cutUp(both, 6), small, (piece) => line(piece, style.steel, 4.5));
  }

  for (const road of shown.ground ? scene.roads : []) addRoad(add, road, pose(road.center.carrier), state.time);

  for (const point of scene.points) {
    const colour = point.body < 0 ? rgbOf(style.steel) : bodies[point.body].colour;
    if (point.trace) {
      const path = traceOf(point);
      const last = placed(pose(point.carrier), point.position);
      let length = 0;
      for (let k = 12 * Math.floor((frame - 1) / 12); k >= Math.max(0, frame - LONGEST) && length < WIDEST * camera.width; k -= 12) {
        const piece = path.slice(FINE * k, FINE * Math.min(k + 12, frame) + 1).map((place) => camera.project(place));
        if (!piece.every((place) => place[2] > camera.near)) continue;
        add(piece[0][2], piece[0], () => line(piece, css(shaded(colour, style.dark ? 1.25 : 0.9), 1), 1.6, 0.85));
        length += piece.reduce((sum, [x, y], j) => (j ? sum + Math.hypot(x - piece[j - 1][0], y - piece[j - 1][1]) : 0), 0);
      }
      const ends = camera.segment(path[FINE * frame], last);
      if (ends) add(ends[0][2], ends[0], () => line(ends, css(shaded(colour, style.dark ? 1.25 : 0.9), 1), 1.6, 0.85));
    }
    if (!point.drawn && !point.trace) continue;
    const [x, y, depth] = camera.project(placed(pose(point.carrier), point.position));
    add(depth - 2 * small, [x, y], () => drawDot(x, y, css(shaded(colour, 0.85), 1)));
    if (shown.names) things.push({ depth: 0, place: [x, y], paint: () => label(point.name, [x + 7, y + 14], style.soft) });
  }

  things.sort((a, b) => b.depth - a.depth);
  const ahead = paintShapes(surfaces, things, pose, (shape) => shape.opacity * faded(shape.body), lightOf);
  for (const thing of ahead) thing.paint();
  if (squares) drawScale();
  reportView();
}

/** Paint things behind surfaces, then the surfaces, those seen through last. Returns the things in front. */
function paintShapes(surfaces, things, pose, opacityOf, lightOf) {
  if (surfaces.length === 0) return things;
  const ratio = window.devicePixelRatio || 1;
  raster.begin(projected(surfaces, pose), ratio < 2 ? 2 * ratio : ratio);
  const opacities = [...new Set(surfaces.map(opacityOf))].sort((a, b) => b - a);
  let ahead = things;
  for (const opacity of opacities) {
    for (const shape of surfaces) if (opacityOf(shape) === opacity) fillShape(shape, inSight(shape.rgb), lightOf);
    if (opacity === 1) {
      ahead = [];
      for (const thing of things) {
        if (thing.depth > 0 && raster.hides(thing.place, thing.depth)) thing.paint();
        else ahead.push(thing);
      }
    }
    raster.paint(ink, opacity);
    raster.clear();
  }
  return ahead;
}

/** The faces of a mesh that look at the camera; of one that is open all of them. */
function addFaces(add, mesh, world, flat, rgb, alpha, lightOf) {
  mesh.faces.forEach((face, number) => {
    if (face.some((k) => flat[k][2] < camera.near)) return;
    const middle = times(1 / face.length, face.reduce((sum, k) => plus(sum, world[k]), [0, 0, 0]));
    let normal = unit(cross(minus(world[face[1]], world[face[0]]), minus(world[face[2]], world[face[1]])));
    if (dot(normal, minus(middle, camera.eye)) >= 0) {
      if (mesh.closed !== false) return;
      normal = times(-1, normal);
    }
    const colour = shaded(rgb, 0.62 + 0.5 * Math.max(0, dot(normal, lightOf)));
    const smooth = mesh.smooth === undefined || number < mesh.smooth;
    // the stroke of a smooth face closes the gap to its neighbour, and would show twice through a translucent one
    const edge = smooth && alpha < 1 ? null : css(smooth ? colour : shaded(colour, 0.8), alpha);
    add(camera.project(middle)[2], camera.project(middle), () => polygon(face.map((k) => flat[k]), css(colour, alpha), edge));
  });
}

/** A solid as its outline and its edges around a light filling, so that parts inside or behind it stay in sight. */
function addGlass(add, body, world, flat, seen) {
  if (flat.some((place) => place[2] < camera.near)) return;
  const depth = flat.reduce((sum, place) => sum + place[2], 0) / flat.length;
  const edge = css(shaded(body.colour, 0.85), 0.9 * seen);
  add(depth, times(1 / flat.length, flat.reduce(plus)), () => {
    polygon(around(flat, body.mesh.sides), css(body.colour, 0.32 * seen), edge);
    for (const face of body.mesh.faces.slice(body.mesh.smooth)) {
      const normal = cross(minus(world[face[1]], world[face[0]]), minus(world[face[2]], world[face[1]]));
      const front = dot(normal, minus(world[face[0]], camera.eye)) < 0;
      polygon(face.map((k) => flat[k]), css(body.colour, front ? 0.2 * seen : 0), front ? edge : css(body.colour, 0.35 * seen));
    }
  });
}

/** The outline of a beam's section, and its axes. */
function addSection(add, body, pose, length) {
  const flat = body.outline.map(([y, z]) => camera.project(placed(pose, [0, y, z])));
  const [, , depth] = camera.project(pose.p);
  if (flat.some((place) => place[2] < camera.near)) return;
  add(depth - 2 * small, camera.project(pose.p), () => {
    polygon(flat, css(body.colour, 0.5), css(shaded(body.colour, 0.6), 1));
    AXES.forEach((colour, k) => {
      const ends = camera.segment(pose.p, placed(pose, [0, 1, 2].map((j) => (j === k ? length : 0))));
      if (ends) line(ends, colour, 1.6);
    });
  });
}

/** The outline of a flat drawing: of a tube by its rings, of anything else its convex hull. */
const around = (flat, sides) => (sides ? outlineOf([...Array(flat.length / sides).keys()].map((k) => flat.slice(k * sides, (k + 1) * sides))) : hullOf(flat));

function castShadow(world, sides) {
  if (Math.max(...world.map((vertex) => dot(vertex, up))) < level) return;
  const flat = world.map((vertex) => camera.project(plus(vertex, times(level - dot(vertex, up), up))));
  if (flat.some((place) => place[2] < camera.near)) return;
  if (dot(minus(camera.eye, times(level, up)), up) > 0) polygon(around(flat, sides), style.shadow, null);
}

function castBall(centre, radius) {
  const [x, y] = across(up);
  const ring = [...Array(20).keys()].map((k) => plus(centre, plus(times(radius * Math.cos((k * Math.PI) / 10), x), times(radius * Math.sin((k * Math.PI) / 10), y))));
  castShadow(ring);
}

function drawBall(x, y, radius, colour, alpha) {
  const fill = ink.createRadialGradient(x - 0.35 * radius, y - 0.45 * radius, 0.1 * radius, x, y, radius);
  fill.addColorStop(0, css(shaded(colour, 1.35), alpha));
  fill.addColorStop(0.6, css(colour, alpha));
  fill.addColorStop(1, css(shaded(colour, 0.68), alpha));
  ink.beginPath();
  ink.arc(x, y, Math.max(radius, 0.5), 0, 2 * Math.PI);
  ink.fillStyle = fill;
  ink.fill();
}

function drawDot(x, y, colour) {
  ink.beginPath();
  ink.arc(x, y, 3.5, 0, 2 * Math.PI);
  ink.fillStyle = style.sky;
  ink.fill();
  ink.lineWidth = 2;
  ink.strokeStyle = colour;
  ink.stroke();
}

/** How long a square of the ground is, beside the lower edge. */
function drawScale() {
  const metres = spacing >= 1000 ? `${spacing / 1000} km` : spacing >= 1 ? `${spacing} m` : spacing >= 0.001 ? `${+(spacing * 1000).toPrecision(3)} mm` : `${spacing.toExponential(0)} m`;
  ink.textAlign = "right";
  label(`one square: ${metres}`, [camera.width - 20, Math.min(camera.free.bottom + 38, camera.height - 14)], style.soft);
  ink.textAlign = "left";
}

/** The view of the camera, for programs: the place of a point of the world on the canvas follows from it. */
function reportView() {
  if (state.playing) return;
  const { eye, right, above, forward, focal, middleX, middleY } = camera;
  canvas.dataset.view = JSON.stringify({ time: state.time, eye, right, above, forward, focal, middle: [middleX, middleY] });
}

const told = [];
for (const [width, height] of [[1200, 800], [900, 600], [480, 800]]) {
  [canvas.style.width, canvas.style.height] = [`${width}px`, `${height}px`];
  resize();
  const [columns, rows] = [[], []];
  const see = (place) => { const [x, y] = camera.project(place); columns.push(x); rows.push(y); };
  for (let frame = 0; frame < count; frame += 5) {
    const base = poseAt(scene.base, frame, 0);
    for (const place of [base.p, ...[0, 1, 2].map((k) => placed(base, times(0.1 * unitSize, REST.R[k])))]) see(place);
    for (const { seat } of scene.joints) see(placed(poseAt(seat.carrier, frame, 0), seat.position));
    for (const point of scene.points) see(placed(poseAt(point.carrier, frame, 0), point.position));
    for (const body of bodies) {
      for (const { carrier, position } of body.reach) see(placed(poseAt(carrier, frame, 0), position));
    }
  }
  const { left, right, top, bottom } = camera.free;
  told.push([Math.min(...columns) - left, right - Math.max(...columns),
    Math.min(...rows) - top, bottom - Math.max(...rows)]);
}
orbit(30, 0); const mine = camera.azimuth; resize();
document.body.dataset.told = JSON.stringify({ margins: told, kept: camera.azimuth === mine });

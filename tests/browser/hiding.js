[camera.azimuth, camera.elevation, camera.target] = [0, 0, [0, 0, 0]];
[shown.ground, untouched] = [false, false];
for (const point of scene.points) point.drawn = true;
draw();

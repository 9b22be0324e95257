play(false);
restart();
const told = { before: [...bounds.high] };
const height = sliders.find((item) => item.name === "height" && item.kind === "position");
for (let k = 0; k < 5; k++) choose(height, height.high);
const inside = ([x, y]) => x >= 0 && x <= camera.width && y >= 0 && y <= camera.height;
told.after = [...bounds.high];
told.inside = placesAt(count - 1).every((place) => inside(camera.project(place)));
told.top = motion.q[1];

document.body.dataset.told = JSON.stringify(told);

const press = (key, more) => window.dispatchEvent(new KeyboardEvent("keydown", { key, bubbles: true, ...more }));
const told = { begin: state.time, rows: count };
const clock = () => (showTime(), byId("clock").textContent);
press("ArrowRight"); told.stepped = state.time;
press("ArrowLeft"); press("End"); told.end = state.time; told.clock = clock();
press("Home"); told.home = state.time;
press("+"); told.faster = byId("speed").value; press("-"); press("-"); told.slower = byId("speed").value;
press("d"); told.theme = document.documentElement.dataset.theme; press("d");
const view = JSON.stringify([camera.azimuth, camera.distance, camera.target]);
const pointer = (type, clientX, clientY, more) =>
  canvas.dispatchEvent(new PointerEvent(type, { pointerId: 1, clientX, clientY, ...more }));
canvas.setPointerCapture = () => {};
pointer("pointerdown", 300, 300); pointer("pointermove", 340, 320); pointer("pointerup", 340, 320);
pointer("pointerdown", 300, 300); pointer("pointermove", 340, 320, { shiftKey: true }); pointer("pointerup", 340, 320);
canvas.dispatchEvent(new WheelEvent("wheel", { deltaY: 200, cancelable: true }));
told.turned = JSON.stringify([camera.azimuth, camera.distance, camera.target]) !== view;
press("r"); told.reset = JSON.stringify([camera.azimuth, camera.distance, camera.target]) === view;
for (const box of document.querySelectorAll("input[type=checkbox]")) { box.click(); draw(); }
for (const item of document.querySelectorAll("#bodies li")) { item.focus(); draw(); item.blur(); }
byId("fold").click(); told.folded = byId("entries").hidden;
byId("slider").value = 3; byId("slider").dispatchEvent(new Event("input")); told.slid = state.time;
press(" "); told.playing = state.playing; tick(1000); tick(1050); told.played = state.time;
byId("play").click(); told.paused = !state.playing;
told.title = document.title; told.description = byId("description").textContent;
told.names = [...document.querySelectorAll("#bodies li, #points li, #others li")].map((item) => item.textContent);
told.unnamed = [...document.querySelectorAll("button, input, select")].filter((item) =>
  !(item.getAttribute("aria-label") || item.textContent.trim() || (item.labels && item.labels.length))).length;
told.label = canvas.getAttribute("aria-label");
document.body.dataset.told = JSON.stringify(told);

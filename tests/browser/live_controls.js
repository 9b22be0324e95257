const told = {};
play(false);
restart();
single(); told.step = end;
const slider = (name, kind) => sliders.find((item) => item.name === name && item.kind === kind);
const ball = slider("restitution", "parameter");
told.low = ball.low; told.high = ball.high;
choose(ball, 0.5);
told.parameter = motion.blocks.parameters[0]; told.kept = end; told.hash = location.hash;
choose(slider("height", "position"), 0.85);
told.start = [end, motion.q[1]];
advance(0.5, 1e9); state.time = end; show();
told.moved = motion.q[1]; told.frames = count; told.events = happened.length;
choose(ball, 99); told.limited = ball.now;
byId("defaults").click(); told.again = [end, motion.q[1], location.hash];
play(true); told.playing = state.playing; tick(1000); tick(1050); told.played = state.time; play(false);
seek(0.01); told.sought = state.time;
hasten(-1); told.speed = byId("speed").value;
told.unnamed = [...document.querySelectorAll("button, input, select")].filter((item) =>
  !(item.getAttribute("aria-label") || item.textContent.trim() || (item.labels && item.labels.length))).length;
told.error = byId("error").textContent;
told.warning = byId("warning").hidden;

document.body.dataset.told = JSON.stringify(told);

/** Colours of bodies, as [red, green, blue] from 0 to 255. */
const PALETTE = ["#3f7fdb", "#ef8b2c", "#34a56f", "#e2586a", "#8d70d8", "#24a4b5", "#d3a21f", "#d667a6", "#9c7650", "#7c8aa0"];

/** Bodies with mass take the colours in their order; bodies that only carry others are grey. */
function colourOf(body) {
  return rgbOf(body.solid.kind === "none" ? "#8a94a3" : PALETTE[massive.indexOf(body) % PALETTE.length]);
}

function rgbOf(text) {
  return [1, 3, 5].map((k) => parseInt(text.slice(k, k + 2), 16));
}

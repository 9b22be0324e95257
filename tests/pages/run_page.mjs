// Runs the motion of a live page without a browser: node run_page.mjs PAGE T_END [NAME=VALUE ...]
// Prints the last state in digits that give the same numbers again.
import { readFileSync } from "node:fs";

const [file, end, ...changes] = process.argv.slice(2);
const page = readFileSync(file, "utf8");
const data = JSON.parse(/<script id="data" type="application\/json">(.*?)<\/script>/s.exec(page)[1]);
const [begin, stop] = ["// -- the model in WebAssembly", "// -- the live page"].map((mark) => page.indexOf(mark));
const { exportsOf, Motion } = new Function(`${page.slice(begin, stop)}; return { exportsOf, Motion };`)();
const motion = new Motion(await exportsOf(data.live.module), data.live);
for (const change of changes) {
  const [name, value] = change.split("=");
  const slider = data.live.sliders.find((item) => item.name === name);
  if (slider.kind === "parameter") motion.parameters[slider.index] = Number(value);
  else if (slider.kind === "input") motion.held[slider.index] = Number(value);
  else if (slider.kind === "position") {
    if (slider.place === null) motion.displaced[slider.index] = Number(value);
    else motion.given.set(slider.place, Number(value));
    motion.touched.add(slider.index);
  } else throw new Error(`${slider.kind} ${name}`);
}
const fault = motion.start();
const first = Array.from(motion.row, String);
const began = performance.now();
const status = fault ? -1 : motion.run(Number(end), false);
const seconds = (performance.now() - began) / 1000;
const seen = fault ? 0 : motion.observe();
const poses = new Float64Array(7 * data.carriers);
if (!fault) motion.poses(poses, 0);
const values = (name) => Array.from(motion.blocks[name] || [], String);
const closed = motion.isClosed();
console.log(JSON.stringify({
  fault, status, seen, text: status > 0 ? motion.text(status) : "", seconds, first, row: Array.from(motion.row, String),
  outputs: values("outputs_y"), energy: values("energy_energy"), violation: values("constraint_Phi"), closed, poses: Array.from(poses, String),
}));

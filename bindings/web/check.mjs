// Learns and reaches balls in a module of this folder, as the page does.
//
//     node bindings/web/check.mjs MODULE.wasm [BALLS]
import { readFileSync } from "node:fs";

const [path, balls = "3"] = process.argv.slice(2);
const { instance } = await WebAssembly.instantiate(readFileSync(path));
const web = instance.exports;
const told = () => JSON.parse(new TextDecoder().decode(
  new Uint8Array(web.memory.buffer, web.text(), web.text_length())));
const fail = words => { console.error(words); process.exit(1); };

if (web.reach(1)) fail("a ball was reached before anything was learned");
if (told()[0].error !== "nothing is learned yet") fail(`it says ${told()[0].error}`);
let start = performance.now();
if (!web.learn(1)) fail(told()[0].error);
const last = told().at(-1);
console.log(`learned in ${((performance.now() - start) / 1000).toFixed(1)} s, `
  + `${(100 * last.success).toFixed(0)} % of the last episodes reach the goal`);
let grasped = 0;
for (let ball = 1; ball <= +balls; ball++) {
  start = performance.now();
  if (!web.reach(ball)) fail(told()[0].error);
  const events = told();
  const frames = events.filter(({ frame }) => frame).length;
  const pixels = new Uint8Array(web.memory.buffer, web.frame(frames),
    web.frame_width() * web.frame_height());
  if (new Set(pixels).size < 20) fail("the last frame shows nothing");
  if (web.frame(frames + 1)) fail("there is a frame too many");
  const { words } = events.at(-1);
  grasped += words === "grasped";
  console.log(`ball ${ball}: ${words}, ${frames} frames of `
    + `${web.frame_width()}x${web.frame_height()}, ${Math.round(performance.now() - start)} ms`);
}
if (grasped < +balls * 0.6) fail(`${grasped} of ${balls} grasped`);

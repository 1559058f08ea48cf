// Preview of the tool: a ring on the surface under the pointer, a line to the floor; and aiming by keyboard.

import { find, note, svg } from "./make.js";
import { on, send } from "./link.js";
import { hand } from "./tools.js";

const drawing = find("aim"), under = svg("polyline", { class: "under" }), ring = svg("polyline", {}), drop = svg("polyline", { class: "drop" }), foot = svg("polyline", { class: "drop" }), cross = find("cross");
drawing.append(drop, foot, under, ring);

const BETWEEN = 50, SELDOM = 600; // ms between two requests while the pointer moves, and while it rests: each takes time from the water
let place = null, asked = 0, answered = 0, shown = "";

/** Say where the pointer is, as shares of the picture; null where it is not over it. */
export function hover(at) {
  place = at;
  if (!at || performance.now() - answered > BETWEEN) ask();
}

/** Ask what is there: one question at a time; the answer asks again where the pointer has moved on. */
function ask() {
  if (performance.now() - asked < 400) return;
  const key = place ? `${place.x} ${place.y} ${hand.tool.name} ${JSON.stringify(hand.options)}` : "";
  if (!place || hand.tool.name === "look") {
    show(null);
    if (shown) send({ do: "hover" });
    shown = "";
    return;
  }
  shown = key;
  asked = performance.now();
  send({ do: "hover", x: place.x, y: place.y, tool: hand.tool.name, reach: reach() });
}

/** How far the tool reaches, as a share of the world. */
function reach() {
  if (!hand.tool.cursor) return 0;
  const option = (name) => hand.options[name] ?? hand.fixed[name] ?? hand.tool.options.find((about) => about.name === name)?.default;
  return option("radius") ?? (option("width") ?? 0.1) / 2;
}

const points = (list) => list.map((p) => p.join()).join(" ");
/** Draw it in a box no larger than it is: all that lies over the picture is put together with it, picture by picture. */
function show(aim) {
  const all = [...aim?.ring ?? [], ...aim?.drop ?? [], ...aim?.foot ?? []];
  drawing.style.display = all.length ? "" : "none";
  if (all.length) {
    const [us, vs] = [all.map((p) => p[0]), all.map((p) => p[1])];
    const [left, top] = [Math.max(0, Math.min(...us) - 0.01), Math.max(0, Math.min(...vs) - 0.01)];
    const [width, height] = [Math.max(0.01, Math.min(1, Math.max(...us) + 0.01) - left), Math.max(0.01, Math.min(1, Math.max(...vs) + 0.01) - top)];
    drawing.setAttribute("viewBox", `${left} ${top} ${width} ${height}`);
    Object.assign(drawing.style, { left: `${100 * left}%`, top: `${100 * top}%`, width: `${100 * width}%`, height: `${100 * height}%` });
  }
  for (const [line, list] of [[ring, aim?.ring], [under, aim?.ring], [drop, aim?.drop], [foot, aim?.foot]]) line.setAttribute("points", points(list ?? []));
}

on("aim", (aim) => {
  asked = 0;
  if (!place) { ask(); return; }
  show(aim);
  const key = `${place.x} ${place.y} ${hand.tool.name} ${JSON.stringify(hand.options)}`;
  answered = performance.now();
  if (key !== shown) setTimeout(ask, BETWEEN);
});
// The water moves under a resting pointer.
on("status", ({ paused }) => { if (place && !paused && performance.now() - answered > SELDOM) ask(); });
on("closed", () => { place = null; asked = 0; show(null); });

// --- by keys ---

const held = new Set();
let aiming = null, down = false, last = 0;
export const keys = { get on() { return aiming !== null; }, get down() { return down; } };

/** Enter: begin to aim, put the tool down, lift it. */
export function enter() {
  if (hand.tool.name === "look") { note("Choose a tool first: press its key, or Tab to it."); return; }
  if (!aiming) {
    aiming = { x: 0.5, y: 0.5 };
    note("Aiming: arrows move (Shift: slowly), Enter presses and releases the tool, Escape ends.");
    move();
  } else if (!down) {
    down = true;
    send({ do: "point-begin", tool: hand.tool.name, options: hand.options, ...aiming });
  } else lift();
  cross.classList.toggle("down", down);
}

function lift() {
  if (down) send({ do: "point-end" });
  down = false;
  cross.classList.remove("down");
}

/** End aiming; say whether there was any. */
export function leave() {
  if (!aiming) return false;
  lift();
  aiming = null;
  held.clear();
  cross.hidden = true;
  hover(null);
  return true;
}

function move() {
  cross.hidden = false;
  Object.assign(cross.style, { left: `${100 * aiming.x}%`, top: `${100 * aiming.y}%` });
  hover(aiming);
}

const ARROWS = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };
/** An arrow went down or up; say whether it was used. */
export function arrow(event, pressed) {
  if (!aiming || !ARROWS[event.key]) return false;
  if (!pressed) { held.delete(event.key); return true; }
  const first = !held.size;
  held.add(event.key);
  if (first) { last = performance.now() - 16; slow = event.shiftKey; requestAnimationFrame(glide); }
  slow = event.shiftKey;
  return true;
}

let slow = false;
/** While arrows are down the aim goes on, a third of the picture's width a second. */
function glide(now) {
  if (!aiming || !held.size) return;
  const way = Math.min(0.1, Math.max(0.008, (now - last) / 1000)) * (slow ? 0.08 : 0.35);
  last = now;
  for (const key of held) {
    aiming = { x: Math.min(1, Math.max(0, aiming.x + ARROWS[key][0] * way)), y: Math.min(1, Math.max(0, aiming.y + ARROWS[key][1] * way * 1.6)) };
  }
  if (down) send({ do: "point-move", ...aiming });
  move();
  requestAnimationFrame(glide);
}
addEventListener("blur", () => held.clear());
on("closed", () => { aiming = null; down = false; cross.hidden = true; });

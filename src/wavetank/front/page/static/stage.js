// The picture, and hands on it: the tool with one pointer, the camera with the other buttons, the wheel or two fingers.

import { find } from "./make.js";
import { on, send } from "./link.js";
import { hand } from "./tools.js";

const canvas = find("picture"), stage = find("stage"), ring = find("ring"), veil = find("veil");
const context = canvas.getContext("2d", { alpha: false, desynchronized: true }); // a third less work for the browser
const pointers = new Map(); // id -> { x, y, mode }
let dim = 3, size = 1, height = 1, tooling = null, pinch = 0, last = null;
export const seen = { pictures: 0, bytes: 0 };

on("picture", async (blob) => {
  const bitmap = await createImageBitmap(blob).catch(() => null);
  // One picture is on its way at a time; the next is asked for before this one is drawn.
  send({ do: "ack" });
  if (!bitmap) return;
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  seen.pictures += 1; seen.bytes += blob.size;
  last = blob;
  veil.classList.add("gone");
});
on("closed", () => { find("veil-text").textContent = "The connection is gone; trying again …"; veil.classList.remove("gone"); pointers.clear(); tooling = null; });
on("open", () => { tellSize(); });
on("hello", (world) => { dim = world.dim; size = world.size; });
on("status", (status) => { height = status.height; if (status.world) ({ dim, size } = status.world); place(); });

export const snapshot = () => last;

function tellSize() {
  const ratio = Math.min(window.devicePixelRatio || 1, 1.5);
  send({ do: "size", width: Math.max(1, Math.round(stage.clientWidth * ratio)), height: Math.max(1, Math.round(stage.clientHeight * ratio)) });
}
let resizing = 0;
new ResizeObserver(() => { clearTimeout(resizing); resizing = setTimeout(tellSize, 120); }).observe(stage);

const where = (event) => {
  const box = canvas.getBoundingClientRect();
  return { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height, width: box.width, height: box.height };
};

let mouse = null;
function place() {
  const share = hand.options.radius ?? hand.tool.options.find((about) => about.name === "radius")?.default ?? (hand.options.width ?? 0.1) / 2;
  ring.hidden = !mouse || !hand.tool.cursor;
  if (ring.hidden) return;
  const radius = Math.max(4, share * size / height * mouse.height);
  ring.style.width = ring.style.height = `${2 * radius}px`;
  ring.style.transform = `translate(${mouse.x * mouse.width - radius}px, ${mouse.y * mouse.height - radius}px)`;
}

function modeOf(event) {
  if (event.pointerType !== "mouse") return hand.tool.name === "look" ? "orbit" : "tool";
  if (event.button === 1 || (event.shiftKey && event.button !== 2)) return "pan";
  if (event.button === 2) return event.shiftKey ? "pan" : "orbit";
  return hand.tool.name === "look" ? "orbit" : "tool";
}

canvas.onpointerdown = (event) => {
  event.preventDefault();
  canvas.focus({ preventScroll: true });
  canvas.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, { ...where(event), mode: modeOf(event) });
  if (pointers.size === 2) {
    // A second finger turns the first one's tool into a look around.
    lift();
    for (const pointer of pointers.values()) pointer.mode = "both";
    pinch = spread();
  } else if (pointers.get(event.pointerId).mode === "tool") {
    tooling = event.pointerId;
    const { x, y } = where(event);
    send({ do: "point-begin", x, y, tool: hand.tool.name, options: hand.options });
  }
};

canvas.onpointermove = (event) => {
  const at = where(event);
  if (event.pointerType === "mouse" || pointers.size === 1) { mouse = at; place(); }
  const pointer = pointers.get(event.pointerId);
  if (!pointer) return;
  const [dx, dy] = [at.x - pointer.x, at.y - pointer.y];
  Object.assign(pointer, at);
  if (event.pointerId === tooling) move(at);
  else if (pointer.mode === "orbit") turn(dx, dy, at);
  else if (pointer.mode === "pan") send({ do: "pan", right: -dx * at.width / at.height, up: dy });
  else if (pointer.mode === "both") {
    turn(dx / 2, dy / 2, at);
    const now = spread();
    if (now > 0 && pinch > 0) send({ do: "zoom", factor: Math.min(2, Math.max(0.5, pinch / now)) });
    pinch = now;
  }
};

// The hand sends at most one place for each picture of the screen; the last one is always sent.
let next = null;
function move({ x, y }) {
  if (!next) requestAnimationFrame(() => { if (next && tooling !== null) send({ do: "point-move", ...next }); next = null; });
  next = { x, y };
}

function turn(dx, dy, at) {
  if (dim === 2) send({ do: "pan", right: -dx * at.width / at.height, up: dy });
  else send({ do: "orbit", azimuth: -3.2 * dx * at.width / at.height, elevation: 3.2 * dy });
}

function spread() {
  const [a, b] = [...pointers.values()];
  return a && b ? Math.hypot((a.x - b.x) * a.width, (a.y - b.y) * a.height) : 0;
}

function lift() {
  if (tooling === null) return;
  if (next) send({ do: "point-move", ...next });
  next = null; tooling = null;
  send({ do: "point-end" });
}

const up = (event) => {
  if (event.pointerId === tooling) lift();
  pointers.delete(event.pointerId);
  if (event.pointerType !== "mouse" && !pointers.size) { mouse = null; place(); }
};
canvas.onpointerup = up;
canvas.onpointercancel = up;
canvas.onpointerleave = () => { if (!pointers.size) { mouse = null; place(); } };
canvas.oncontextmenu = (event) => event.preventDefault();
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  send({ do: "zoom", factor: Math.min(1.6, Math.max(0.6, Math.exp(0.0012 * event.deltaY * (event.deltaMode ? 30 : 1)))) });
}, { passive: false });

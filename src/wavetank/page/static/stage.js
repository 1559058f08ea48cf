// The picture and its pointers: one pointer uses the tool; other buttons, the wheel or two fingers move the camera.

import { find, note, say } from "./make.js";
import { on, pending, send } from "./link.js";
import { hand } from "./tools.js";
import { hover, leave } from "./aim.js";

const canvas = find("picture"), stage = find("stage"), veil = find("veil"), busy = find("busy");
const context = canvas.getContext("2d", { alpha: false, desynchronized: true }); // a third less work for the browser
const pointers = new Map(); // id -> { x, y, mode }
let dim = 3, tooling = null, pinch = 0;
export const seen = { pictures: 0, bytes: 0 };

on("picture", async (blob) => {
  const bitmap = await createImageBitmap(blob).catch(() => null);
  // One picture is in flight at a time; the next is requested before this one is drawn.
  send({ do: "ack" });
  if (!bitmap) return;
  if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
  context.drawImage(bitmap, 0, 0);
  bitmap.close();
  seen.pictures += 1; seen.bytes += blob.size;
  veil.classList.add("gone");
});
on("closed", () => { find("veil-text").textContent = "Connection lost; reconnecting …"; veil.classList.remove("gone"); pointers.clear(); tooling = null; });
on("refused", (ours) => {
  find("veil-text").textContent = ours ? "wavetank was restarted, and this page belongs to the previous run: open the link that it printed."
    : "Open this page with the link that wavetank printed, which includes the token.";
});
on("open", () => { tellSize(); });
on("restarted", () => note("wavetank was restarted: the previous session is lost."));

// Kernels are compiled at their first use; until then no picture and no status comes.
const WAIT = 1500; // ms without a message after which the page says why
let heard = performance.now(), waitsFor = "", kernel = 0;
on("compiling", ({ number }) => { kernel = number; });
const compiling = (what) => `${what}${kernel ? ` (kernel ${kernel})` : ""}`;
on("hello", () => { heard = performance.now(); waitsFor = "first"; });
on("status", () => { heard = performance.now(); waitsFor = waitsFor === "scene" ? "" : waitsFor; busy.hidden = true; });
on("picture", () => { waitsFor = ""; heard = performance.now(); });
setInterval(() => {
  if (performance.now() - heard < WAIT || !pending()) return;
  if (veil.classList.contains("gone")) { say(busy, compiling("Compiling for this kind of water, once …")); busy.hidden = false; }
  else if (waitsFor === "first") say(find("veil-text"), compiling("Compiling, once: the next start takes seconds."));
}, 300);
on("hello", (world) => { dim = world.dim; });
on("status", ({ world }) => { if (world) ({ dim } = world); });

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

function modeOf(event) {
  if (event.pointerType !== "mouse") return hand.tool.name === "look" ? "orbit" : "tool";
  if (event.button === 1 || (event.shiftKey && event.button !== 2)) return "pan";
  if (event.button === 2) return event.shiftKey ? "pan" : "orbit";
  return hand.tool.name === "look" ? "orbit" : "tool";
}

canvas.onpointerdown = (event) => {
  event.preventDefault();
  canvas.focus({ preventScroll: true });
  leave();
  canvas.setPointerCapture(event.pointerId);
  pointers.set(event.pointerId, { ...where(event), mode: modeOf(event) });
  if (pointers.size === 2) {
    // A second finger ends the first one's tool and moves the camera.
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
  const pointer = pointers.get(event.pointerId);
  const looks = pointer && pointer.mode !== "tool"; // then there is no preview of the tool
  if (event.pointerType === "mouse" || pointers.size === 1) hover(looks ? null : at);
  if (!pointer) return;
  const [dx, dy] = [at.x - pointer.x, at.y - pointer.y];
  Object.assign(pointer, at);
  if (event.pointerId === tooling) move(at);
  else if (pointer.mode === "orbit") turn(dx, dy, at);
  else if (pointer.mode === "pan") send({ do: "pan", right: -dx * at.width / at.height, up: dy });
  else if (pointer.mode === "both") {
    turn(dx / 2, dy / 2, at);
    const now = spread();
    if (now > 0 && pinch > 0) send({ do: "zoom", factor: Math.min(2, Math.max(0.5, pinch / now)), ...middle() });
    pinch = now;
  }
};

// At most one position is sent for each frame of the screen; the last one is always sent.
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

/** Return the point between two fingers. */
function middle() {
  const [a, b] = [...pointers.values()];
  return { x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 };
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
  if (event.pointerType !== "mouse" && !pointers.size) hover(null);
};
canvas.onpointerup = up;
canvas.onpointercancel = up;
canvas.onpointerleave = () => { if (!pointers.size) hover(null); };
canvas.oncontextmenu = (event) => event.preventDefault();
canvas.addEventListener("wheel", (event) => {
  event.preventDefault();
  const { x, y } = where(event);
  send({ do: "zoom", factor: Math.min(1.6, Math.max(0.6, Math.exp(0.0012 * event.deltaY * (event.deltaMode ? 30 : 1)))), x, y });
}, { passive: false });

// Thumbnails of scenes; any scene file can be dropped on the page.

import { colour, find, make, note, pretty } from "./make.js";
import { on, send, tell } from "./link.js";
import { control } from "./slider.js";

let current = "", fits = {}, fitted = true, inLevel = false;

/** A drawing of boxes and balls: flat for 2-D, from above the corner for 3-D. */
function draw(canvas, scene) {
  const [width, height] = [canvas.width, canvas.height];
  const g = canvas.getContext("2d");
  const flat = scene.dim === 2;
  const project = flat ? ([x, y]) => [x, -y] : ([x, y, z]) => [0.9 * x + 0.42 * z, -y + 0.3 * z - 0.12 * x];
  const corners = ({ lower: a, upper: b }) => [0, 1, 2, 3, 4, 5, 6, 7].map((k) => [k & 1 ? b[0] : a[0], k & 2 ? b[1] : a[1], k & 4 ? b[2] : a[2]]);
  const places = corners(scene).map(project);
  const [xs, ys] = [places.map((p) => p[0]), places.map((p) => p[1])];
  const [left, right, top, bottom] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  const scale = Math.min(0.84 * width / (right - left), 0.78 * height / (bottom - top));
  const to = (p) => { const [x, y] = project(p); return [width / 2 + (x - (left + right) / 2) * scale, height / 2 + (y - (top + bottom) / 2) * scale]; };
  const shade = (what) => ["front", "top", "side"].map((side) => colour(`${what}-${side}`));
  const face = (shape, ks, style) => {
    const all = corners(shape);
    g.beginPath();
    ks.forEach((k, n) => g[n ? "lineTo" : "moveTo"](...to(all[k])));
    g.closePath(); g.fillStyle = style; g.fill();
  };
  const order = [...scene.shapes].sort((a, b) => a.lower[2] + a.lower[0] * 0.1 - b.lower[2] - b.lower[0] * 0.1);
  for (const shape of order) {
    const [front, up, side] = shape.color ? Array(3).fill(shape.color) : shape.what === "water" ? shade("water") : shade("solid");
    if (shape.round) {
      const middle = to(shape.lower.map((v, k) => (v + shape.upper[k]) / 2));
      g.beginPath(); g.arc(...middle, 0.5 * scale * (shape.upper[1] - shape.lower[1]), 0, 7);
      g.fillStyle = front; g.fill();
    } else if (flat) face(shape, [0, 1, 3, 2], front);
    else { face(shape, [1, 5, 7, 3], side); face(shape, [2, 3, 7, 6], up); face(shape, [4, 5, 7, 6], front); }
  }
  g.strokeStyle = colour("edge"); g.lineWidth = 1.4; g.lineJoin = "round";
  const all = corners(scene);
  const edges = flat ? [[0, 1], [1, 3], [3, 2], [2, 0]] : [[0, 1], [1, 5], [5, 4], [4, 0], [2, 3], [3, 7], [7, 6], [6, 2], [0, 2], [1, 3], [5, 7], [4, 6]];
  for (const [a, b] of edges) { g.beginPath(); g.moveTo(...to(all[a])); g.lineTo(...to(all[b])); g.stroke(); }
}

/** Begin a scene, as fine as this machine can compute in real time unless it is wanted in full; a level as it is. */
function begin(scene) {
  const left = last > 0.5;
  send({ do: "load", name: scene.name, particles: coarser(scene) ? fits[scene.name].particles : 0 });
  if (left) note("Scene changed.", ["Undo", () => send({ do: "undo" })]);
  tell("chosen", scene);
}

/** Whether a scene begins with fewer particles than it has; both numbers are rounded. */
const coarser = (scene) => fitted && !scene.goal && (fits[scene.name]?.particles ?? Infinity) < 0.93 * scene.count;

/** What a card says below its title. */
function size(scene) {
  const fit = fits[scene.name], whole = `≈ ${scene.count.toLocaleString("en")}`;
  if (scene.goal || !fit) return `${scene.dim}-D · ${whole}`;
  return `${scene.dim}-D · ${coarser(scene) ? `≈ ${fit.particles.toLocaleString("en")} of ${scene.count.toLocaleString("en")}` : whole} · ${pace(coarser(scene) ? fit.pace : fit.full)}`;
}

const pace = (value) => (value >= 0.95 ? "real time" : `${pretty(value, value < 0.1 ? 1 : 2)} ×`);

/** How fine the water is: a slider over what the machine can be expected to make of it. */
function detail(here) {
  const box = find("scenes-detail");
  box.replaceChildren();
  if (here.length < 2 || inLevel) return;
  const text = make("p"), now = here.reduce((best, one, k) => (Math.abs(Math.log(one.particles / count)) < Math.abs(Math.log(here[best].particles / count)) ? k : best), 0);
  const range = make("input", { type: "range", min: 0, max: here.length - 1, step: 1, value: now, id: "detail" });
  const show = () => {
    const { particles, pace: speed } = here[range.value];
    text.textContent = `About ${particles.toLocaleString("en")} particles: ${speed >= 0.95 ? "real time" : `${pretty(speed, 2)} × real time`} on this machine`;
    range.setAttribute("aria-valuetext", text.textContent);
    range.style.setProperty("--share", `${100 * range.value / (here.length - 1)}%`);
  };
  range.oninput = show;
  range.onchange = () => { send({ do: "reset", parameters: { spacing: here[range.value].spacing } }); };
  show();
  box.append(make("label", { for: "detail", textContent: "Detail" }), range, text);
}

function build({ scenes, title, dim }) {
  known = scenes;
  const fit = make("input", { type: "checkbox", id: "fit", checked: fitted, onchange: () => { fitted = fit.checked; write(); } });
  const card = (scene) => {
    const canvas = make("canvas", { width: 264, height: 198 });
    draw(canvas, scene);
    const stars = scene.goal ? make("em", { data: { level: scene.name } }) : null;
    return make("button", { title: scene.goal || `${scene.title}: ${scene.dim}-D, about ${scene.count.toLocaleString("en")} particles`, data: { title: `${scene.dim} ${scene.title}`, scene: scene.name }, onclick: () => begin(scene) },
      canvas, make("span", { textContent: scene.title }), sizes[scene.name] = make("small", { textContent: size(scene) }), stars);
  };
  const heading = (textContent) => make("h3", { textContent });
  sizes = {};
  const [levels, others] = [scenes.filter((scene) => scene.goal), scenes.filter((scene) => !scene.goal)];
  const file = make("input", { type: "file", accept: ".toml,.obj", hidden: true, onchange: () => open(file.files[0]) });
  const pick = make("button", { className: "quiet", textContent: "Open a file …", onclick: () => file.click() });
  pick.style.gridColumn = "1 / -1"; pick.style.padding = "9px";
  find("scenes").replaceChildren(make("div", { id: "scenes-detail" }), make("div", { className: "fit" }, fit, make("label", { for: "fit", textContent: "Fit scenes to this machine" })),
    heading("Levels"), ...levels.map(card), heading("Scenes"), ...others.map(card), pick, file, make("p", { textContent: "Or drop it anywhere on this page: a scene's TOML file starts that scene, an OBJ mesh becomes a solid." }));
  named({ title, dim });
}

function named({ title, dim }) {
  current = `${dim} ${title}`;
  find("title").textContent = title || "Scene";
  for (const card of find("scenes").querySelectorAll("button[data-scene]")) card.classList.toggle("now", card.dataset.title === current);
}

async function open(file) {
  if (!file) return;
  if (file.size > 2_000_000) { note(`${file.name} has ${pretty(file.size / 1e6, 2)} MB; at most 2 MB can be opened here.`); return; }
  const text = await file.text();
  if (/\.obj$/i.test(file.name)) send({ do: "mesh", text, file: file.name });
  else send({ do: "load", text, file: file.name.slice(0, 200) });
  tell("chosen", null);
}

let known = [], sizes = {}, count = 0, last = 0;
const write = () => { for (const scene of known) if (sizes[scene.name]) sizes[scene.name].textContent = size(scene); };
on("hello", build);
on("fit", (message) => { fits = message.scenes; write(); detail(message.here); });
on("status", ({ world, scores, game, count: now, time }) => {
  inLevel = Boolean(game); count = now; last = time;
  if (world) { named(world); if (!find("scenes").hidden) send({ do: "fit" }); }
  for (const place of find("scenes").querySelectorAll("em")) {
    const stars = scores[place.dataset.level]?.stars ?? 0, text = "★".repeat(stars) + "☆".repeat(3 - stars);
    if (place.textContent !== text) place.textContent = text;
  }
});

let depth = 0;
addEventListener("dragenter", (event) => { event.preventDefault(); depth += 1; find("drop-here").hidden = false; });
addEventListener("dragleave", () => { depth -= 1; if (depth <= 0) { depth = 0; find("drop-here").hidden = true; } });
addEventListener("dragover", (event) => event.preventDefault());
addEventListener("drop", (event) => {
  event.preventDefault(); depth = 0; find("drop-here").hidden = true;
  open(event.dataTransfer.files[0]);
});

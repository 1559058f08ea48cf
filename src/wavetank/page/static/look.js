// View, colours, light, and measured figures.

import { colour, find, make, note, pretty, say, words } from "./make.js";
import { link, on, send } from "./link.js";
import { control } from "./slider.js";
import { seen } from "./stage.js";

const rows = {};
const past = {};
const suns = {};
let touched = 0; // when the sun was last moved here: a late status must not move the slider back
let about = { views: [], colorings: [], paints: [] };

function pills(title, choices, current, act) {
  return [make("h3", { textContent: title }), make("div", { className: "pills" }, ...choices.map(([value, text]) =>
    make("button", { textContent: text, "aria-pressed": value === current, onclick: () => act(value) })))];
}

let detail = "auto";
function build() {
  const colours = [...about.colorings.map((name) => [name, words(name)]), ...about.paints];
  const figures = make("div", { id: "figures" });
  find("look").replaceChildren(
    ...(about.views.length > 1 ? pills("View", about.views.map((v) => [v, words(v)]), about.view, (view) => send({ do: "view", view })) : []),
    ...(about.view === "slice" ? slice() : []),
    ...pills("Colour by", colours, about.painted, (color_by) => send({ do: "view", color_by })),
    ...(about.bodies ? pills("Forces on bodies", [[false, "Hidden"], [true, "Shown"]], about.forces, (forces) => send({ do: "view", forces })) : []),
    ...(about.dim === 3 ? light() : []),
    ...pills("Picture", [["auto", "Automatic"], ["full", "Sharp"], ["half", "Fast"]], detail, (value) => { detail = value; send({ do: "detail", detail }); build(); }),
    make("h3", { textContent: "Measured" }), figures,
    make("h3", { textContent: "Keep" }),
    make("div", { className: "links" },
      make("a", { href: link("/picture.png"), download: "wavetank.png", textContent: "Save this picture at full resolution" }),
      make("a", { href: link("/scene.toml"), download: "scene.toml", textContent: "Save the current world as a scene" }),
      make("a", { href: link("/recording.toml"), download: "session.toml", textContent: "Save this session for replay" })));
  for (const [key, label] of [["error", "Density error, mean"], ["energy", "Kinetic energy"], ["frame", "Frame"], ["picture", "Picture"]]) {
    const value = make("b", {}), canvas = make("canvas", { width: 270, height: 34 });
    figures.append(make("div", { className: "figure" }, make("span", { textContent: label }), value, canvas));
    rows[key] = { value, canvas };
  }
}

/** Show what the water does to bodies, or hide it. */
export const toggleForces = () => send({ do: "view", forces: !about.forces });

/** Where the slice lies. */
function slice() {
  const [axis, place] = about.cut;
  const move = control({ name: "place", label: "Position", low: 0, high: 100, unit: "%", straight: true, sentence: "Position of the slice, from one end of the world to the other." }, 100 * place,
    (value) => send({ do: "view", place: value / 100 }));
  return [...(about.dim === 3 ? pills("Slice normal", ["x", "y", "z"].map((name) => [name, name]), axis, (name) => send({ do: "view", axis: name })) : []),
    ...(about.dim === 3 ? [move.element] : [])];
}

/** Environments by name, and a sun that can be turned. */
function light() {
  const { environment, azimuth, elevation } = about.light, { lowest, highest } = about.sun;
  const slider = (name, label, low, high, sentence, value) => {
    suns[name] = control({ name, label, low, high, unit: "°", straight: true, sentence }, value, (v) => { touched = performance.now(); send({ do: "light", [name]: v }); });
    return suns[name].element;
  };
  return [...pills("Light", about.environments.map((name) => [name, words(name)]), environment, (name) => send({ do: "light", environment: name })),
    slider("azimuth", "Sun azimuth", 0, 360, "Direction of the sun, from the front towards the right.", azimuth),
    slider("elevation", "Sun elevation", lowest, highest, "Height of the sun above the horizon.", elevation)];
}

/** What the colours mean, over the picture. */
function legend() {
  const box = find("legend"), shown = about.legend;
  box.hidden = !shown;
  if (!shown) return;
  const bar = make("canvas", { width: shown.colors.length, height: 1 }), g = bar.getContext("2d");
  shown.colors.forEach((color, k) => { g.fillStyle = color; g.fillRect(k, 0, 1, 1); });
  box.replaceChildren(...(shown.names ? shown.names.map(([name, color]) => {
    const patch = make("i");
    patch.style.background = color;
    return make("span", { className: "key" }, patch, name);
  }) : [make("span", { textContent: shown.title }), bar,
    make("span", { className: "ends" }, ...shown.ticks.map((value) => make("b", { textContent: pretty(value) })))]));
}

function plot(key, value, text) {
  const list = (past[key] ??= []);
  list.push(value);
  if (list.length > 135) list.shift(); // 13 s
  const { value: label, canvas } = rows[key];
  if (find("look").hidden || !canvas.isConnected) return;
  say(label, text);
  const g = canvas.getContext("2d"), top = Math.max(...list, 1e-9);
  g.clearRect(0, 0, canvas.width, canvas.height);
  g.beginPath();
  list.forEach((v, k) => g[k ? "lineTo" : "moveTo"](canvas.width - 2 * (list.length - 1 - k) - 1, canvas.height - 2 - (canvas.height - 5) * v / top));
  g.strokeStyle = colour("accent"); g.lineWidth = 1.5; g.stroke();
  g.lineTo(canvas.width - 1, canvas.height); g.lineTo(canvas.width - 2 * list.length + 1, canvas.height);
  g.fillStyle = `${colour("accent")}1c`; g.fill();
}

const stats = { count: make("b"), rate: make("b"), error: make("b") };
const wide = (...parts) => make("span", { className: "wide" }, ...parts);
const unit = make("span");
find("stats").append(wide(stats.count, " particles · "), stats.rate, unit, wide(" · compression ", stats.error));
const behind = make("span");
find("late").append(behind, wide(" real time"));
find("late").title = "This machine is slower than real time, so the water moves in slow motion.";

let pictures = [performance.now(), 0], paused = false;
setInterval(() => {
  const now = performance.now(), rate = 1000 * (seen.pictures - pictures[1]) / (now - pictures[0]);
  pictures = [now, seen.pictures];
  const rests = paused && rate < 2; // pictures are rare while paused, not slow
  say(stats.rate, rests ? "paused" : rate.toFixed(0));
  say(unit, rests ? "" : " fps");
}, 1000);
on("hello", (hello) => { about = hello; build(); legend(); });
on("status", (status) => {
  if (status.world) {
    const shape = () => JSON.stringify([
      about.view, about.painted, about.cut?.[0], about.dim, about.forces, about.bodies > 0, about.light?.environment,
    ]);
    const before = shape();
    about = { ...about, ...status.world };
    if (shape() !== before) build(); // a slider that is being moved stays
    if (performance.now() - touched > 600) for (const name in suns) suns[name].show(about.light[name]);
    legend();
  }
  plot("error", status.density_error_mean ?? 0, `${(100 * (status.density_error_mean ?? 0)).toFixed(2)} %`);
  plot("energy", status.kinetic_energy ?? 0, `${pretty(status.kinetic_energy ?? 0)} J`);
  plot("frame", status.frame_ms || 0, `${pretty(status.frame_ms || 0)} ms`);
  plot("picture", status.picture_ms, `${pretty(status.picture_ms)} ms`);
  say(stats.count, status.count.toLocaleString("en"));
  paused = status.paused;
  say(stats.error, `${(100 * (status.density_error_mean ?? 0)).toFixed(2)} %`);
  find("late").hidden = !status.late;
  say(behind, `${status.pace.toFixed(2)} ×`);
  status.notes.forEach(note);
});
on("note", ({ text }) => note(text));
on("role", ({ driving, viewers }) => {
  const chip = find("role");
  chip.hidden = driving && viewers < 2;
  chip.replaceChildren(driving ? `${viewers - 1} watching` : "Watching");
  if (!driving) chip.append(make("button", { textContent: "Take control", onclick: () => send({ do: "drive" }) }));
});

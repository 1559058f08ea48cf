// How it looks, and what is measured.

import { colour, find, make, note, pretty, say, words } from "./make.js";
import { link, on, send } from "./link.js";
import { seen, snapshot } from "./stage.js";

const rows = {};
const past = {};
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
    ...pills("Colour by", colours, about.color_by, (color_by) => send({ do: "view", color_by })),
    ...pills("Picture", [["auto", "Automatic"], ["full", "Sharp"], ["half", "Fast"]], detail, (value) => { detail = value; send({ do: "detail", detail }); build(); }),
    make("h3", { textContent: "Measured" }), figures,
    make("h3", { textContent: "Keep" }),
    make("div", { className: "links" },
      make("button", { textContent: "Save this picture", onclick: save }),
      make("a", { href: link("/scene.toml"), download: "scene.toml", textContent: "Save what is there as a scene" }),
      make("a", { href: link("/recording.toml"), download: "session.toml", textContent: "Save this session, to be replayed" })));
  for (const [key, label] of [["error", "Compression, mean"], ["energy", "Kinetic energy"], ["frame", "Frame computed in"], ["picture", "Picture painted in"]]) {
    const value = make("b", {}), canvas = make("canvas", { width: 270, height: 34 });
    figures.append(make("div", { className: "figure" }, make("span", { textContent: label }), value, canvas));
    rows[key] = { value, canvas };
  }
}

function save() {
  const blob = snapshot();
  if (!blob) return;
  const url = URL.createObjectURL(blob);
  make("a", { href: url, download: "wavetank.jpg" }).click();
  setTimeout(() => URL.revokeObjectURL(url), 1000);
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
find("late").title = "This machine is slower than real time; the water slows down rather than cheat.";

let pictures = [performance.now(), 0], paused = false;
setInterval(() => {
  const now = performance.now(), rate = 1000 * (seen.pictures - pictures[1]) / (now - pictures[0]);
  pictures = [now, seen.pictures];
  const rests = paused && rate < 2; // a picture that rests is not a slow one
  say(stats.rate, rests ? "paused" : rate.toFixed(0));
  say(unit, rests ? "" : " fps");
}, 1000);
on("hello", (hello) => { about = hello; build(); });
on("status", (status) => {
  if (status.world) { about = { ...about, ...status.world }; build(); }
  plot("error", status.density_error_mean ?? 0, `${(100 * (status.density_error_mean ?? 0)).toFixed(2)} %`);
  plot("energy", status.kinetic_energy ?? 0, `${pretty(status.kinetic_energy ?? 0)} J`);
  plot("frame", status.frame_ms || 0, `${pretty(status.frame_ms || 0)} ms`);
  plot("picture", status.picture_ms, `${pretty(status.picture_ms)} ms`);
  say(stats.count, status.count.toLocaleString("en"));
  paused = status.paused;
  say(stats.error, `${(100 * (status.density_error_mean ?? 0)).toFixed(2)} %`);
  find("late").hidden = !status.late;
  say(find("late"), `${status.pace.toFixed(2)} × real time`);
  status.notes.forEach(note);
});
on("note", ({ text }) => note(text));
on("role", ({ driving, viewers }) => {
  const chip = find("role");
  chip.hidden = driving && viewers < 2;
  chip.replaceChildren(driving ? `${viewers - 1} watching` : "Watching");
  if (!driving) chip.append(make("button", { textContent: "Take the helm", onclick: () => send({ do: "drive" }) }));
});

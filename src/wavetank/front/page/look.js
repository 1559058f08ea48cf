// How it looks, and what is measured.

import { find, make, note, pretty, words } from "./make.js";
import { link, on, send } from "./link.js";
import { seen, snapshot } from "./stage.js";

const COLOURS = { "#3f99da": "Blue", "#e8eef2": "Milk" };
const rows = {};
const past = {};
let about = { views: [], colorings: [] };

function pills(title, choices, current, act) {
  return [make("h3", { textContent: title }), make("div", { className: "pills" }, ...choices.map(([value, text]) =>
    make("button", { textContent: text, "aria-pressed": value === current, onclick: () => act(value) })))];
}

let detail = "auto";
function build() {
  const colours = [...about.colorings.map((name) => [name, words(name)]), ...Object.entries(COLOURS)];
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
  label.textContent = text;
  if (!canvas.isConnected || !canvas.offsetParent) return;
  const g = canvas.getContext("2d"), top = Math.max(...list, 1e-9);
  g.clearRect(0, 0, canvas.width, canvas.height);
  g.beginPath();
  list.forEach((v, k) => g[k ? "lineTo" : "moveTo"](canvas.width - 2 * (list.length - 1 - k) - 1, canvas.height - 2 - (canvas.height - 5) * v / top));
  g.strokeStyle = "#59c8ff"; g.lineWidth = 1.5; g.stroke();
  g.lineTo(canvas.width - 1, canvas.height); g.lineTo(canvas.width - 2 * list.length + 1, canvas.height);
  g.fillStyle = "#59c8ff1c"; g.fill();
}

let pictures = [performance.now(), 0], rate = 0;
on("hello", (hello) => { about = hello; build(); });
on("status", (status) => {
  if (status.world) { about = { ...about, ...status.world }; build(); }
  plot("error", status.density_error_mean ?? 0, `${(100 * (status.density_error_mean ?? 0)).toFixed(2)} %`);
  plot("energy", status.kinetic_energy ?? 0, `${pretty(status.kinetic_energy ?? 0)} J`);
  plot("frame", status.frame_ms || 0, `${pretty(status.frame_ms || 0)} ms`);
  plot("picture", status.picture_ms, `${pretty(status.picture_ms)} ms`);
  const now = performance.now();
  if (now - pictures[0] > 900) { rate = 1000 * (seen.pictures - pictures[1]) / (now - pictures[0]); pictures = [now, seen.pictures]; }
  const wide = (text) => make("span", { className: "wide" }, text);
  find("stats").replaceChildren(
    wide(make("b", { textContent: status.count.toLocaleString("en") })), wide(" particles · "),
    make("b", { textContent: rate.toFixed(0) }), " fps",
    wide(" · compression "), wide(make("b", { textContent: `${(100 * (status.density_error_mean ?? 0)).toFixed(2)} %` })));
  find("late").hidden = !status.late;
  find("late").textContent = `${status.pace.toFixed(2)} × real time`;
  find("late").title = "This machine is slower than real time; the water slows down rather than cheat.";
  status.notes.forEach(note);
});
on("note", ({ text }) => note(text));
on("role", ({ driving, viewers }) => {
  const chip = find("role");
  chip.hidden = driving && viewers < 2;
  chip.replaceChildren(driving ? `${viewers - 1} watching` : "Watching");
  if (!driving) chip.append(make("button", { textContent: "Take the helm", onclick: () => send({ do: "drive" }) }));
});

// The page: tabs, keys, help. Everything else is in the file of its name.

import { find, make } from "./make.js";
import { connect, on, send } from "./link.js";
import { allows, choose, tools } from "./tools.js";
import { time } from "./timeline.js";
import "./stage.js";
import "./water.js";
import "./scenes.js";
import "./look.js";
import "./hud.js";

const narrow = matchMedia("(max-width: 760px)");

function show(tab) {
  for (const button of document.querySelectorAll(".tabs button")) button.setAttribute("aria-selected", button.dataset.tab === tab);
  for (const section of document.querySelectorAll("#panel section")) section.hidden = section.id !== tab;
}
function panel(open) {
  document.body.classList.toggle("no-panel", open === undefined ? undefined : !open);
}
for (const button of document.querySelectorAll(".tabs button")) button.onclick = () => show(button.dataset.tab);
find("panel-toggle").onclick = () => panel();
find("title").onclick = () => { const shown = !document.body.classList.contains("no-panel") && !find("scenes").hidden; show(shown ? "water" : "scenes"); panel(!(shown && narrow.matches)); };
panel(!narrow.matches);
find("picture").addEventListener("pointerdown", () => { if (narrow.matches) panel(false); });

const KEYS = [
  [" ", "Space", "Pause, play", time.toggle], [".", ".", "One frame", time.step], [",", ",", "One second back", time.back],
  ["r", "R", "Start again", time.reset], ["[", "[", "Slower", () => time.faster(-1)], ["]", "]", "Faster", () => time.faster(1)],
  ["m", "M", "Bookmark", time.bookmark], ["h", "H", "See all", () => send({ do: "home" })],
  ["Escape", "Esc", "Stop all tools", () => send({ do: "tool-stop" })],
  ["f", "F", "Full screen", () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen())],
  ["Tab", "Tab", "Panel", () => panel()], ["+", "+", "Closer", () => send({ do: "zoom", factor: 0.85 })], ["-", "−", "Farther", () => send({ do: "zoom", factor: 1.18 })],
  ["ArrowLeft", "← → ↑ ↓", "Turn", () => send({ do: "orbit", azimuth: -0.12 })], ["ArrowRight", "", "", () => send({ do: "orbit", azimuth: 0.12 })],
  ["ArrowUp", "", "", () => send({ do: "orbit", elevation: 0.08 })], ["ArrowDown", "", "", () => send({ do: "orbit", elevation: -0.08 })],
  ["?", "?", "This list", () => help()],
];

function help() {
  const dialog = find("help");
  if (dialog.open) { dialog.close(); return; }
  const row = (key, text) => make("div", {}, make("span", { textContent: text }), make("kbd", { textContent: key }));
  dialog.replaceChildren(make("h2", { textContent: "Keys" }), make("div", { className: "keys" },
    ...KEYS.filter(([, label]) => label).map(([, label, text]) => row(label, text)),
    ...tools.filter((tool) => tool.key).map((tool) => row(tool.key.toUpperCase(), tool.label))),
  make("h2", { className: "second", textContent: "Pointer" }), make("div", { className: "keys" },
    row("left, one finger", "Use the tool"), row("right, two fingers", "Turn the view"), row("wheel, pinch", "Zoom"), row("middle, Shift", "Move the view"), row("double click a slider", "Its default")));
  dialog.showModal();
}
find("help-toggle").onclick = help;
find("help").onclick = (event) => { if (event.target === find("help")) find("help").close(); };

addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (find("help").open && event.key === "?") { find("help").close(); return; }
  if (find("help").open || event.target.matches("input.number, select, dialog *")) return;
  if (event.target.matches("input[type=range]") && event.key.startsWith("Arrow")) return;
  const key = KEYS.find(([code]) => code === event.key || code === event.key.toLowerCase());
  const tool = tools.find((other) => other.key && other.key === event.key.toLowerCase());
  if (!key && !tool) return;
  event.preventDefault();
  if (key) key[3](); else if (allows(tool.name)) choose(tool.name);
});

on("closed", () => { document.title = "wavetank (not connected)"; });
on("open", () => { document.title = "wavetank"; });
connect();

// The page: tabs, keys, help. Everything else is in the file of its name.

import { colour, find, make } from "./make.js";
import { connect, on, send } from "./link.js";
import { allows, choose, tools } from "./tools.js";
import { time } from "./timeline.js";
import "./stage.js";
import "./water.js";
import "./scenes.js";
import "./look.js";
import "./hud.js";

document.head.append(make("meta", { name: "theme-color", content: colour("ground") }));
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

let keys = [];
on("hello", (hello) => { keys = hello.keys; });
const ACTIONS = {
  pause: time.toggle, back: time.back, again: time.reset, slower: () => time.faster(-1), faster: () => time.faster(1), bookmark: time.bookmark,
  "full-screen": () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()),
  panel: () => panel(), help: () => help(),
};

function help() {
  const dialog = find("help");
  if (dialog.open) { dialog.close(); return; }
  const row = (key, text) => make("div", {}, make("span", { textContent: text }), make("kbd", { textContent: key }));
  dialog.replaceChildren(make("h2", { textContent: "Keys" }), make("div", { className: "keys" },
    ...keys.filter(({ label }) => label).map(({ label, text }) => row(label, text)),
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
  const key = keys.find((other) => other.key === event.key || other.key === event.key.toLowerCase());
  const tool = tools.find((other) => other.key && other.key === event.key.toLowerCase());
  if (!key && !tool) return;
  event.preventDefault();
  if (key) (key.command ? send(key.command) : ACTIONS[key.action]()); else if (allows(tool.name)) choose(tool.name);
});

on("closed", () => { document.title = "wavetank (not connected)"; });
on("open", () => { document.title = "wavetank"; });
connect();

// The page: tabs, keys, help. Other files have one part each, by name.

import { colour, find, make, narrow, note } from "./make.js";
import { connect, on, send } from "./link.js";
import { allows, choose, tools } from "./tools.js";
import { time } from "./timeline.js";
import "./stage.js";
import "./water.js";
import "./scenes.js";
import { toggleForces } from "./look.js";
import "./hud.js";
import { arrow, enter, keys as aim, leave } from "./aim.js";

document.head.append(make("meta", { name: "theme-color", content: colour("ground") }));

const tabs = [...document.querySelectorAll(".tabs button")];
function show(tab) {
  for (const button of tabs) { button.setAttribute("aria-selected", button.dataset.tab === tab); button.tabIndex = button.dataset.tab === tab ? 0 : -1; }
  for (const section of document.querySelectorAll("#panel section")) section.hidden = section.id !== tab;
  if (tab === "scenes") send({ do: "fit" });
}
function panel(open) {
  document.body.classList.toggle("no-panel", open === undefined ? undefined : !open);
  find("panel-toggle").setAttribute("aria-expanded", !document.body.classList.contains("no-panel"));
}
for (const button of tabs) {
  button.onclick = () => show(button.dataset.tab);
  button.onkeydown = (event) => {
    const way = { ArrowRight: 1, ArrowLeft: -1 }[event.key];
    if (!way) return;
    event.preventDefault(); event.stopPropagation();
    const next = tabs[(tabs.indexOf(button) + way + tabs.length) % tabs.length];
    show(next.dataset.tab);
    next.focus();
  };
}
find("home").onclick = () => send({ do: "home" });
find("panel-close").onclick = () => panel(false);
find("panel-toggle").onclick = () => panel();
find("title").onclick = () => { const shown = !document.body.classList.contains("no-panel") && !find("scenes").hidden; show(shown ? "water" : "scenes"); panel(!(shown && narrow.matches)); };
show("water");
panel(!narrow.matches);
find("picture").addEventListener("pointerdown", () => { if (narrow.matches) panel(false); });
on("chosen", () => { if (narrow.matches) panel(false); find("picture").focus({ preventScroll: true }); });

let keys = [];
on("hello", (hello) => { keys = hello.keys; });
const ACTIONS = {
  pause: time.toggle, back: time.back, again: time.reset, slower: () => time.faster(-1), faster: () => time.faster(1), bookmark: time.bookmark, forces: toggleForces,
  "full-screen": () => (document.fullscreenElement ? document.exitFullscreen() : document.documentElement.requestFullscreen()),
  panel: () => panel(), help: () => help(), aim: enter,
};

// A phone has no right button: what fingers do is shown once.
function gestures(event) {
  if (event.pointerType !== "touch") return;
  removeEventListener("pointerdown", gestures, true);
  if (localStorage.getItem("wavetank gestures")) return;
  localStorage.setItem("wavetank gestures", "told");
  note("One finger uses the tool. Two fingers turn the view, and pinch to zoom.", ["Got it", () => {}]);
}
addEventListener("pointerdown", gestures, true);

function help() {
  const dialog = find("help");
  if (dialog.open) { dialog.close(); return; }
  const row = (key, text) => make("div", {}, make("span", { textContent: text }), make("kbd", { textContent: key }));
  dialog.replaceChildren(make("h2", { id: "help-title", textContent: "Keys" }), make("div", { className: "keys" },
    ...keys.filter(({ label }) => label).map(({ label, text }) => row(label, text)),
    ...tools.filter((tool) => tool.key).map((tool) => row(tool.key.toUpperCase(), tool.label))),
  make("h2", { className: "second", textContent: "Pointer" }), make("div", { className: "keys" },
    row("left, one finger", "Use the tool"), row("right, two fingers", "Turn the view"), row("wheel, pinch", "Zoom"), row("middle, Shift", "Move the view"), row("double-click a slider", "Reset it")),
  make("button", { className: "accent", textContent: "Close", onclick: () => dialog.close() }));
  dialog.showModal();
}
find("help-toggle").onclick = help;
find("help").onclick = (event) => { if (event.target === find("help")) find("help").close(); };

// Whether the focus was moved by the keyboard: only then Space and Enter go to the focused button.
let byKeys = false;
const keyed = (on) => { byKeys = on; document.body.classList.toggle("by-keys", on); };
addEventListener("pointerdown", () => keyed(false), true);
addEventListener("keydown", (event) => { if (event.key === "Tab" || event.target.matches("body, #picture")) keyed(true); }, true);
addEventListener("keyup", (event) => arrow(event, false));
addEventListener("keydown", (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  if (find("help").open && event.key === "?") { find("help").close(); return; }
  if (find("help").open || event.target.matches("input.number, select, dialog *")) return;
  if (event.target.matches("input[type=range]") && /^(Arrow|Home|End|Page)/.test(event.key)) return;
  if (event.target.matches("button, a, summary, input") && byKeys && (event.key === "Enter" || event.key === " ")) return;
  if (event.key === "Escape" && leave()) return;
  if (arrow(event, true)) { event.preventDefault(); return; }
  const key = keys.find((other) => other.key === event.key || other.key === event.key.toLowerCase());
  const tool = tools.find((other) => other.key && other.key === event.key.toLowerCase());
  if (!key && !tool) return;
  event.preventDefault();
  if (event.repeat && !key?.repeats) return;
  if (key) (key.command ? send(key.command) : ACTIONS[key.action]()); else if (allows(tool.name)) choose(tool.name);
});

on("status", ({ world }) => { if (world) find("undo").hidden = world.undo === null; });
on("hello", ({ undo }) => { find("undo").hidden = undo === null; });
find("undo").onclick = () => send({ do: "undo" });

on("closed", () => { document.title = "wavetank (not connected)"; });
on("open", () => { document.title = "wavetank"; });
connect();

// The panel of parameters, made from their descriptions: live ones act at once, others wait for a restart.

import { find, make, pretty, words } from "./make.js";
import { on, send } from "./link.js";
import { control } from "./slider.js";
import { dial } from "./dial.js";

const controls = new Map();
const pending = new Map();
let touched = new Map(); // when a value was last set here: a late status must not move the slider back

function set(about, value) {
  touched.set(about.name, performance.now());
  if (about.live) send({ do: "set", name: about.name, value });
  else { pending.set(about.name, value); showPending(); }
}

function showPending() {
  find("pending").hidden = pending.size === 0;
  find("pending").querySelector("p").textContent = [...pending].map(([name, value]) => `${words(name)} = ${typeof value === "number" ? pretty(value, 4) : value}`).join(", ");
}

find("pending").querySelector("button").onclick = () => {
  send({ do: "reset", parameters: Object.fromEntries(pending) });
  pending.clear();
  showPending();
};

function build({ parameters, values }) {
  const everyday = find("everyday"), more = find("more").querySelector("div");
  everyday.replaceChildren(); more.replaceChildren(); controls.clear();
  for (const about of [...parameters].sort((a, b) => (b.name === "gravity") - (a.name === "gravity"))) {
    let made;
    if (about.name === "gravity") {
      made = dial((v) => set(about, v));
      made.show(values.gravity);
    } else {
      const range = about.name === "spacing" ? { low: values.spacing / 2, high: values.spacing * 2, default: null } : {};
      made = control({ ...about, ...range }, values[about.name], (v) => set(about, v));
      if (!about.live) made.element.querySelector("label").append(make("small", { textContent: "at restart", title: "Takes effect at the next restart" }));
    }
    controls.set(about.name, made);
    (about.everyday ? everyday : more).append(made.element);
  }
}

let declared = null, shown = "";
function update(world) {
  const { values, title, dim } = world;
  if (`${title} ${dim}` !== shown) { shown = `${title} ${dim}`; pending.clear(); showPending(); build({ parameters: declared, values }); return; }
  const now = performance.now();
  for (const [name, made] of controls) {
    if (!pending.has(name) && now - (touched.get(name) ?? -1e9) > 600) made.show(values[name]);
  }
}

on("hello", (hello) => { declared = hello.parameters; shown = `${hello.title} ${hello.dim}`; build(hello); });
on("status", ({ world, game }) => {
  if (world) update(world);
  // A level allows no changes: disabled controls take no focus.
  for (const part of [find("everyday"), find("more")]) part.inert = Boolean(game);
  find("water").tabIndex = game ? 0 : -1; // so that it can be scrolled by keyboard
});

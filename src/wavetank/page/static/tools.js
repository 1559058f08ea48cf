// The bar of tools, the card with the options of the current one, and those that keep running.

import { find, icon, make, narrow, words } from "./make.js";
import { on, send } from "./link.js";
import { control } from "./slider.js";

let look = { name: "look", options: [], cursor: false }; // until the server sends it
const chosen = new Map(); // options by tool
const buttons = new Map();
export const hand = { tool: look, options: {}, fixed: {} };
export let tools = [look];

export function choose(name) {
  const tool = tools.find((other) => other.name === name) ?? look;
  hand.tool = tool;
  hand.options = chosen.get(tool.name) ?? {};
  chosen.set(tool.name, hand.options);
  for (const [other, button] of buttons) button.setAttribute("aria-pressed", other === tool.name);
  buttons.get(tool.name)?.scrollIntoView({ block: "nearest", inline: "center" }); // with its neighbours on both sides
  find("picture").classList.toggle("look", tool === look);
  card(tool);
}

let allowed = null; // by the level: tools and their fixed options
let folded = narrow.matches;

function card(tool) {
  const box = find("tool-card");
  const fixed = hand.fixed = allowed?.[tool.name] ?? {};
  const options = tool.options.filter((about) => !(about.name in fixed)).map((about) =>
    control(about, hand.options[about.name] ?? about.default, (v) => { hand.options[about.name] = v; }).element);
  const fold = make("button", { className: "quiet fold", title: "Options", "aria-label": `Options of ${tool.label}`, "aria-expanded": !folded }, icon("M6 15l6-6 6 6"));
  fold.onclick = () => { folded = !folded; box.classList.toggle("folded", folded); fold.setAttribute("aria-expanded", !folded); };
  box.replaceChildren(make("h2", { textContent: tool.label }), fold, make("p", { textContent: tool.sentence }), ...options);
  box.classList.toggle("folded", folded);
  box.hidden = false;
}

on("hello", ({ tools: list }) => {
  tools = list;
  look = list.find((tool) => tool.name === "look");
  buttons.clear();
  find("tools").replaceChildren(...tools.map((tool) => {
    const button = make("button", { title: `${tool.label}${tool.key ? ` (${tool.key.toUpperCase()})` : ""}: ${tool.sentence}`, "aria-pressed": false, data: { tool: tool.name } },
      icon(tool.icon), make("span", { textContent: tool.label }));
    button.onclick = () => choose(tool.name);
    buttons.set(tool.name, button);
    return button;
  }));
  rules = "";
  choose(hand.tool.name === "look" && !chosen.size ? "push" : hand.tool.name);
});

let shown = "", rules = "";
on("status", ({ running, game, world }) => {
  if (world) card(hand.tool); // lengths depend on the size of the world
  // A level has its own tools; options that it fixes have no slider.
  const now = JSON.stringify(game?.tools ?? null);
  if (now !== rules) {
    rules = now;
    allowed = game?.tools ?? null;
    for (const [name, button] of buttons) button.hidden = Boolean(allowed) && name !== "look" && !(name in allowed);
    choose(allowed ? Object.keys(allowed)[0] : hand.tool.name);
  }
  if (running.join() === shown) return;
  shown = running.join();
  for (const [name, button] of buttons) button.classList.toggle("on", running.includes(name));
  find("running").replaceChildren(...running.map((name) =>
    make("button", { textContent: `${words(name)}  ✕`, title: "Stop", "aria-label": `Stop ${name}`, onclick: () => send({ do: "tool-stop", tool: name }) })));
});

/** Return whether the level, if there is one, allows a tool. */
export const allows = (name) => !allowed || name === "look" || name in allowed;

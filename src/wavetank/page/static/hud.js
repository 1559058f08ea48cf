// A level: goal, progress, its regions over the picture, and the result; forces on bodies.

import { find, make, say, svg } from "./make.js";
import { on, send } from "./link.js";

const hud = find("hud"), banner = find("banner"), drawing = find("regions"), names = find("region-names");
const EDGES = [[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [5, 7], [7, 6], [6, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
let regions = [], game = null, shown = "", waits = false, lit = null;

/** Draw a force on a body as an arrow with a number, or the power of a joint as a number. */
function drawForce(outline, mark, text) {
  const [x, y] = outline.at(-1), label = make("span", { className: `force ${mark}`, textContent: text });
  if (outline.length > 1) {
    const { width, height } = drawing.getBoundingClientRect(), [u, v] = outline[0];
    const dx = (x - u) * width, dy = (y - v) * height, long = Math.hypot(dx, dy), head = Math.min(11, long);
    if (long > 2) {
      const at = (along, across) => `${x - (along * dx - across * dy) / long / width},${y - (along * dy + across * dx) / long / height}`;
      const back = at(head, 0).split(",");
      drawing.append(svg("line", { x1: u, y1: v, x2: back[0], y2: back[1], class: `force ${mark}`, "vector-effect": "non-scaling-stroke" }));
      drawing.append(svg("polygon", { points: [at(0, 0), at(head, 0.45 * head), at(head, -0.45 * head)].join(" "), class: `force ${mark}` }));
    }
  }
  label.style.left = `${100 * x}%`;
  label.style.top = `${100 * y}%`;
  names.append(label);
}

/** Separate overlapping numbers: from top to bottom, each is moved below those that it would cover. */
function part() {
  const placed = [], gap = 2;
  const labels = [...names.querySelectorAll(".force")].map((label) => ({ label, box: label.getBoundingClientRect() }));
  for (const { label, box } of labels.sort((a, b) => a.box.top - b.box.top)) {
    let { top, bottom } = box;
    for (const other of placed)
      if (box.left < other.right + gap && other.left < box.right + gap && top < other.bottom + gap && other.top < bottom + gap)
        [top, bottom] = [other.bottom + gap, other.bottom + gap + box.height];
    if (top > box.top) label.style.marginTop = `${top - box.top}px`;
    placed.push({ left: box.left, right: box.right, top, bottom });
    placed.sort((a, b) => a.top - b.top);
  }
}

let outlined = "";
function drawRegions() {
  const now = JSON.stringify([regions, game?.aims ?? null]);
  if (now === outlined) return;
  outlined = now;
  drawing.replaceChildren(); names.replaceChildren();
  regions.forEach(({ corners: points, outline, mark, label: text }, k) => {
    if (text) return drawForce(outline, mark, text);
    if (mark) return drawing.append(svg("polygon", { points: outline.map((p) => p.join()).join(" "), class: mark, "vector-effect": "non-scaling-stroke" }));
    const aim = game?.aims[k];
    if (!points.length || !aim) return;
    const kind = aim.forbids ? "forbidden" : aim.progress >= 1 ? "met" : "wanted";
    drawing.append(svg("polygon", { points: outline.map((p) => p.join()).join(" "), class: kind }));
    for (const [a, b] of EDGES.filter(([a, b]) => a < points.length && b < points.length))
      drawing.append(svg("line", { x1: points[a][0], y1: points[a][1], x2: points[b][0], y2: points[b][1], class: kind, "vector-effect": "non-scaling-stroke" }));
    const label = make("span", { className: kind, textContent: aim.label });
    const xs = points.map((p) => p[0]), low = Math.max(...points.map((p) => p[1]));
    label.style.left = `${50 * (Math.min(...xs) + Math.max(...xs))}%`;
    label.style.top = `${100 * Math.min(0.99, low)}%`;
    names.append(label);
  });
  part();
}

const stars = (count) => make("span", { className: "stars", role: "img", "aria-label": `${count} stars` }, ...[1, 2, 3].map((k) => make("i", { className: k <= count ? "on" : "", textContent: "★" })));
const again = () => send({ do: "reset" }); // a level waits for the first touch
const go = (name) => send({ do: "load", name });
const seconds = (value) => `${value.toFixed(1)} s`;

const parts = {
  level: make("small"), text: make("p"), begin: make("p", { className: "begin", textContent: "Time starts with your first touch." }), bar: make("div", { className: "bar" }, make("div")), clock: make("b"), stars: make("span"), strokes: make("span"),
};
hud.append(make("div", { className: "line" }, parts.level, parts.strokes, parts.stars, parts.clock), parts.text, parts.begin, parts.bar);

function showHud() {
  hud.hidden = !game;
  if (!game) return;
  const left = Math.max(0, game.seconds - game.elapsed);
  say(parts.level, game.heading);
  say(parts.text, game.text.replaceAll(" %", "\u00a0%"));
  say(parts.clock, seconds(left));
  parts.clock.classList.toggle("short", left < 5 && !game.outcome && !game.endured);
  if (lit !== game.stars) parts.stars.replaceChildren(stars(lit = game.stars));
  parts.begin.hidden = !waits;
  say(parts.strokes, game.strokes === null ? "" : `${game.strokes} left`);
  const bar = parts.bar.firstChild;
  bar.style.width = `${100 * game.progress}%`;
  parts.bar.classList.toggle("met", game.progress >= 1);
}

function showBanner() {
  const now = game ? `${game.outcome} ${game.level}` : "";
  if (now === shown) return;
  shown = now;
  banner.hidden = !game?.outcome;
  if (banner.hidden) return;
  const won = game.outcome === "won";
  const next = won && game.next ? make("button", { id: "next-level", className: "accent", textContent: "Next level", onclick: () => go(game.next) }) : null;
  const retry = make("button", { id: "retry", className: next || (won && !game.next) ? "" : "accent", textContent: won ? "Play again" : "Try again", onclick: again });
  const skip = !won && game.next ? make("button", { className: "quiet", textContent: "Next level", onclick: () => go(game.next) }) : null;
  banner.className = game.outcome;
  banner.replaceChildren(
    make("h2", { textContent: game.headline }),
    ...(won ? [stars(game.stars)] : []),
    make("p", { textContent: game.verdict }),
    make("div", { className: "row" }, skip, retry, next));
  // Focus it for the keyboard, unless something else has the focus.
  if (document.activeElement === document.body || document.activeElement === find("picture")) (next ?? retry).focus({ preventScroll: true });
}

on("regions", (message) => { regions = message.regions; drawRegions(); });
on("status", (status) => {
  ({ game, waits } = status);
  document.body.classList.toggle("playing-level", Boolean(game));
  showHud(); showBanner(); drawRegions();
});
on("closed", () => { shown = ""; banner.hidden = true; });

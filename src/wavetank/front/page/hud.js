// A level: what is asked, how it stands, its regions over the picture, and what became of it.

import { find, make, svg } from "./make.js";
import { on, send } from "./link.js";

const hud = find("hud"), banner = find("banner"), drawing = find("regions"), names = find("region-names");
const EDGES = [[0, 1], [1, 3], [3, 2], [2, 0], [4, 5], [5, 7], [7, 6], [6, 4], [0, 4], [1, 5], [2, 6], [3, 7]];
const percent = (value) => `${Math.round(100 * value)} %`;
let corners = [], game = null, shown = "";

/** The outline of a few points: monotone chain. */
function hull(points) {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (list) => {
    const chain = [];
    for (const p of list) {
      while (chain.length > 1) {
        const [a, b] = chain.slice(-2);
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        chain.pop();
      }
      chain.push(p);
    }
    return chain.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

function drawRegions() {
  drawing.replaceChildren(); names.replaceChildren();
  corners.forEach((points, k) => {
    const aim = game?.aims[k];
    if (!points.length || !aim) return;
    const kind = aim.forbids ? "forbidden" : aim.progress >= 1 ? "met" : "wanted";
    drawing.append(svg("polygon", { points: hull(points).map((p) => p.join()).join(" "), class: kind }));
    for (const [a, b] of EDGES.filter(([a, b]) => a < points.length && b < points.length))
      drawing.append(svg("line", { x1: points[a][0], y1: points[a][1], x2: points[b][0], y2: points[b][1], class: kind, "vector-effect": "non-scaling-stroke" }));
    const label = make("span", { className: kind, textContent: `${aim.name ? `${aim.name} ` : ""}${aim.forbids ? "keep dry" : `${percent(aim.value)} of ${percent(aim.share)}`}` });
    const xs = points.map((p) => p[0]), low = Math.max(...points.map((p) => p[1]));
    label.style.left = `${50 * (Math.min(...xs) + Math.max(...xs))}%`;
    label.style.top = `${100 * Math.min(0.99, low)}%`;
    names.append(label);
  });
}

const stars = (count) => make("span", { className: "stars", "aria-label": `${count} stars` }, ...[1, 2, 3].map((k) => make("i", { className: k <= count ? "on" : "", textContent: "★" })));
const again = () => { send({ do: "reset" }); send({ do: "pause", on: false }); };
const go = (name) => { send({ do: "load", name }); send({ do: "pause", on: false }); };
const seconds = (value) => `${value.toFixed(1)} s`;
const mark = (best) => (game.endured ? `${percent(best)} of what is allowed got wet` : seconds(best));

const parts = {
  level: make("small"), text: make("p"), bar: make("div", { className: "bar" }, make("div")), clock: make("b"), stars: make("span"), strokes: make("span"),
};
hud.append(make("div", { className: "line" }, parts.level, parts.strokes, parts.stars, parts.clock), parts.text, parts.bar);

function showHud() {
  hud.hidden = !game;
  if (!game) return;
  const left = Math.max(0, game.seconds - game.elapsed);
  parts.level.textContent = game.number ? `Level ${game.number} of ${game.levels}` : "Level";
  parts.text.textContent = game.text.replaceAll(" %", "\u00a0%");
  parts.clock.textContent = seconds(left);
  parts.clock.classList.toggle("short", left < 5 && !game.outcome && !game.endured);
  parts.stars.replaceChildren(stars(game.stars));
  parts.strokes.textContent = game.strokes === null ? "" : `${game.strokes} left`;
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
  const best = game.best && (won && game.record ? "A new best." : `Best: ${"★".repeat(game.best.stars)} ${mark(game.best.mark)}.`);
  const next = won && game.next ? make("button", { id: "next-level", className: "accent", textContent: "Next level", onclick: () => go(game.next) }) : null;
  const retry = make("button", { id: "retry", className: next || (won && !game.next) ? "" : "accent", textContent: won ? "Play again" : "Try again", onclick: again });
  const skip = !won && game.next ? make("button", { className: "quiet", textContent: "Next level", onclick: () => go(game.next) }) : null;
  banner.className = game.outcome;
  banner.replaceChildren(
    make("h2", { textContent: won ? (game.next || !game.number ? "Won" : "Won: the last level") : game.elapsed < game.seconds - 0.01 ? "Too wet" : "Time is over" }),
    ...(won ? [stars(game.stars)] : []),
    make("p", { textContent: won ? [game.endured ? "" : `In ${seconds(game.elapsed)}.`, best || ""].join(" ").trim() : game.hint }),
    make("div", { className: "row" }, skip, retry, next));
}

on("regions", ({ regions }) => { corners = regions; drawRegions(); });
on("status", (status) => {
  game = status.game;
  document.body.classList.toggle("playing-level", Boolean(game));
  showHud(); showBanner(); drawRegions();
});
on("closed", () => { shown = ""; banner.hidden = true; });

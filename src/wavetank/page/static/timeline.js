// Time: play, step, back, the scrubber with its bookmarks, the speed.

import { find, icon, make, note, pretty, say } from "./make.js";
import { on, send } from "./link.js";

let speeds = [[1, "1 ×"]];
const now = { time: 0, paused: false, speed: 1, past: [0, 0], bookmarks: [] };
const scrub = find("scrub"), speed = find("speed");
const marks = new Map(); // bookmark -> time at which it was set on this page
let held = 0;

on("hello", (hello) => {
  speeds = hello.speeds;
  speed.replaceChildren(...speeds.map(([value, textContent]) => make("option", { value, textContent })));
  speed.value = speeds[closest(now.speed)][0];
});
speed.onchange = () => send({ do: "speed", factor: Number(speed.value) });

export const time = {
  toggle: () => send({ do: "pause", on: !now.paused }),
  step: () => send({ do: "step" }),
  back: () => send({ do: "rewind", time: Math.max(0, now.time - 1) }),
  reset: () => {
    const left = now.time > 0.5;
    send({ do: "reset" });
    if (left) note("Restarted.", ["Undo", () => send({ do: "undo" })]);
  },
  faster: (by) => send({ do: "speed", factor: speeds[Math.min(speeds.length - 1, Math.max(0, closest(now.speed) + by))][0] }),
  bookmark: () => {
    const name = `${pretty(now.time, 3)} s`;
    marks.set(name, now.time);
    send({ do: "bookmark", name });
  },
};

const closest = (value) => speeds.reduce((best, [other], k) => (Math.abs(other - value) < Math.abs(speeds[best][0] - value) ? k : best), 0);

for (const [id, act] of Object.entries({ play: time.toggle, step: time.step, back: time.back, reset: time.reset, bookmark: time.bookmark })) find(id).onclick = act;

scrub.oninput = () => {
  held = performance.now();
  if (!now.paused) send({ do: "pause", on: true });
  send({ do: "rewind", time: Number(scrub.value) });
};

const clock = make("b");
find("clock").append(clock, " s");
let drawn = "", icon_ = null;
on("status", (status) => {
  Object.assign(now, status);
  const [from, to] = [status.past[0], Math.max(status.past[1], status.time, status.past[0] + 0.1)];
  if (performance.now() - held > 400) {
    Object.assign(scrub, { min: from, max: to, value: status.time });
    scrub.setAttribute("aria-valuetext", `${status.time.toFixed(1)} s`);
    scrub.style.setProperty("--share", `${100 * (status.time - from) / (to - from)}%`);
  }
  say(clock, status.time.toFixed(2));
  if (icon_ !== status.paused) {
    icon_ = status.paused;
    find("play").replaceChildren(icon(icon_ ? "M8 5v14l11-7z" : "M7 5h3.500v14H7zM13.500 5H17v14h-3.500z"));
    find("play").title = icon_ ? "Play (space)" : "Pause (space)";
    find("play").setAttribute("aria-label", icon_ ? "Play" : "Pause");
  }
  if (document.activeElement !== speed) speed.value = speeds[closest(status.speed)][0];
  const list = JSON.stringify(status.bookmarks);
  if (list !== drawn) {
    drawn = list;
    find("bookmarks").replaceChildren(...status.bookmarks.map(flag));
  }
  // The range grows while the water moves. Flags are moved, not recreated, or a click on one would be lost.
  status.bookmarks.forEach((name, k) => {
    const at = marks.get(name) ?? parseFloat(name);
    find("bookmarks").children[k].style.left = `${100 * Math.min(1, Math.max(0, ((at || 0) - from) / (to - from)))}%`;
  });
});

function flag(name) {
  const result = make("button", { title: `${name}: click to go there, right-click or Delete to remove it`, "aria-label": `Bookmark ${name}` });
  result.onclick = () => send({ do: "bookmark", name, action: "go" });
  const forget = (event) => { event.preventDefault(); send({ do: "bookmark", name, action: "forget" }); };
  result.oncontextmenu = forget;
  result.onkeydown = (event) => { if (event.key === "Delete") forget(event); };
  return result;
}

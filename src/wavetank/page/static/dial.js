// The gravity dial: drag the needle to turn and stretch gravity; the z part of a 3-D world is left alone.

import { make, pretty, svg } from "./make.js";

const EARTH = 9.81, MOST = 20;

export function dial(change) {
  const needle = svg("line", { x1: 0, y1: 0, x2: 0, y2: 24, stroke: "var(--accent)", "stroke-width": 3 });
  const knob = svg("circle", { r: 6, fill: "var(--knob)", stroke: "none" });
  const face = svg("svg", { viewBox: "-46 -46 92 92", role: "slider", tabindex: 0, "aria-label": "Gravity: left and right turn it, up and down change its strength", "aria-valuemin": 0, "aria-valuemax": MOST },
    svg("circle", { r: 44, fill: "var(--ground)", stroke: "var(--line)" }), svg("circle", { r: 22, stroke: "var(--line)", "stroke-dasharray": "2 4" }),
    svg("circle", { r: 2.5, fill: "var(--soft)", stroke: "none" }), needle, knob);
  const text = make("p", {});
  const preset = (label, ...xy) => make("button", { textContent: label, onclick: () => set(...xy) });
  const element = make("div", { className: "dial" }, face, make("div", {}, make("div", {}, "Gravity"), text,
    make("div", { className: "row" }, preset("Earth", 0, -EARTH), preset("Moon", 0, -1.62), preset("None", 0, 0))));
  let vector = [0, -EARTH];
  const show = (v) => {
    vector = v;
    const size = Math.hypot(v[0], v[1]);
    const reach = size ? Math.min(40, 22 * size / EARTH) / size : 0;
    needle.setAttribute("x2", v[0] * reach); needle.setAttribute("y2", -v[1] * reach);
    knob.setAttribute("cx", v[0] * reach); knob.setAttribute("cy", -v[1] * reach);
    text.textContent = `${pretty(Math.hypot(...v))} m/s²`;
    const turn = size ? Math.round(Math.atan2(v[0], -v[1]) * 180 / Math.PI) : 0;
    const way = !size ? "" : turn === 0 ? ", straight down" : Math.abs(turn) === 180 ? ", straight up" : `, ${Math.abs(turn)}° to the ${turn > 0 ? "right" : "left"} of down`;
    face.setAttribute("aria-valuenow", Number(size.toFixed(3)));
    face.setAttribute("aria-valuetext", text.textContent + way);
  };
  const set = (x, y) => { const v = [Number(x.toFixed(3)), Number(y.toFixed(3)), ...vector.slice(2)]; show(v); change(v); };
  face.onkeydown = (event) => {
    const turn = { ArrowRight: 1, ArrowLeft: -1 }[event.key] ?? 0, more = { ArrowUp: 1, ArrowDown: -1 }[event.key] ?? 0;
    if (!turn && !more) return;
    event.preventDefault(); event.stopPropagation();
    const size = Math.hypot(vector[0], vector[1]), angle = (size ? Math.atan2(vector[1], vector[0]) : -Math.PI / 2) + turn * Math.PI / 36;
    const next = Math.min(MOST, Math.max(0, size + more * 0.5));
    set(next * Math.cos(angle), next * Math.sin(angle));
  };
  const follow = (event) => {
    const box = face.getBoundingClientRect();
    const x = (event.clientX - box.left - box.width / 2) / box.width * 92, y = (box.height / 2 - (event.clientY - box.top)) / box.height * 92;
    let size = Math.min(MOST, Math.hypot(x, y) / 22 * EARTH), angle = Math.atan2(y, x);
    // It snaps to upright, to Earth's gravity and to zero.
    const step = Math.PI / 2, near = Math.round(angle / step) * step;
    if (Math.abs(angle - near) < 0.09) angle = near;
    if (Math.abs(size - EARTH) < 1) size = EARTH;
    if (size < 1) size = 0;
    set(size * Math.cos(angle), size * Math.sin(angle));
  };
  face.onpointerdown = (event) => { face.setPointerCapture(event.pointerId); follow(event); };
  face.onpointermove = (event) => { if (face.hasPointerCapture(event.pointerId)) follow(event); };
  return { element, show: (v) => { if (!face.matches(":active")) show(v); } };
}

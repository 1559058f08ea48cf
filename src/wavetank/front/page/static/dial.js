// The gravity dial: drag the needle to turn and stretch gravity; the z part of a 3-D world is left alone.

import { make, pretty, svg } from "./make.js";

const EARTH = 9.81, MOST = 20;

export function dial(change) {
  const needle = svg("line", { x1: 0, y1: 0, x2: 0, y2: 24, stroke: "var(--accent)", "stroke-width": 3 });
  const knob = svg("circle", { r: 6, fill: "var(--knob)", stroke: "none" });
  const face = svg("svg", { viewBox: "-46 -46 92 92", role: "slider", "aria-label": "gravity" },
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
  };
  const set = (x, y) => { const v = [x, y, ...vector.slice(2)]; show(v); change(v); };
  const follow = (event) => {
    const box = face.getBoundingClientRect();
    const x = (event.clientX - box.left - box.width / 2) / box.width * 92, y = (box.height / 2 - (event.clientY - box.top)) / box.height * 92;
    let size = Math.min(MOST, Math.hypot(x, y) / 22 * EARTH), angle = Math.atan2(y, x);
    // It clicks into place near upright, near Earth's and near none.
    const step = Math.PI / 2, near = Math.round(angle / step) * step;
    if (Math.abs(angle - near) < 0.09) angle = near;
    if (Math.abs(size - EARTH) < 1) size = EARTH;
    if (size < 1) size = 0;
    set(Number((size * Math.cos(angle)).toFixed(3)), Number((size * Math.sin(angle)).toFixed(3)));
  };
  face.onpointerdown = (event) => { face.setPointerCapture(event.pointerId); follow(event); };
  face.onpointermove = (event) => { if (face.hasPointerCapture(event.pointerId)) follow(event); };
  return { element, show: (v) => { if (!face.matches(":active")) show(v); } };
}

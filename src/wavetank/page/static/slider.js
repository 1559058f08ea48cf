// Controls for a number, choice, colour or switch, of parameters and options of tools.

import { colour, make, pretty, typed, words } from "./make.js";
import { on } from "./link.js";

let units = {}; // factor and name of units relative to the world's size
on("hello", (hello) => { units = hello.units; });
on("status", ({ world }) => { if (world) units = world.units; });
let count = 0;

/** How slider positions 0..1 map to values: straight, or bent where the range spans decades. */
function scale(low, high, straight) {
  const wide = high - low >= 100 && !straight;
  if (low > 0 && high / low > 200) {
    const [a, b] = [Math.log(low), Math.log(high)];
    return [(x) => Math.exp(a + x * (b - a)), (v) => (Math.log(Math.max(v, low)) - a) / (b - a)];
  }
  const power = wide && low >= 0 ? (high > 500 ? 5 : 3) : 1;
  return [(x) => low + (high - low) * x ** power, (v) => ((v - low) / (high - low)) ** (1 / power)];
}

/** Make a control from a description; `change(value)` is called when it is changed. Returns { element, show(value) }. */
export function control(about, value, change) {
  const id = `control-${count += 1}`;
  const label = make("label", { title: about.sentence ?? "", for: id }, about.label ?? words(about.name));
  const element = make("div", { className: "control" }, label);
  const named = { ...about, id, title: about.label ?? words(about.name) };
  if (about.choices?.length) return select(element, named, value, change);
  if (about.unit === "color") return color(element, named, value, change);
  if (typeof value === "boolean") return toggle(element, named, value, change);
  return slider(element, named, value, change);
}

function slider(element, about, value, change) {
  const low = about.low ?? 0, high = about.high ?? Math.max(1, 4 * Math.abs(value ?? about.default ?? 1));
  const whole = about.whole ?? false;
  const [toValue, toPlace] = scale(low, high, about.straight);
  const [factor, unit] = units[about.unit] ?? [1, about.unit];
  const range = make("input", { type: "range", min: 0, max: 1, step: "any", id: about.id, "aria-label": about.title, title: about.sentence ?? "" });
  const number = make("input", { className: "number", "aria-label": `${about.title}, typed${unit ? ` in ${unit}` : ""}`, inputMode: "decimal" });
  const text = (v) => pretty(factor * v, whole ? 6 : 3) + (unit ? ` ${unit}` : "");
  let now = value;
  const show = (v) => {
    now = v;
    if (document.activeElement !== number) number.value = text(v);
    if (!range.matches(":active")) range.value = toPlace(v);
    range.setAttribute("aria-valuetext", text(v));
    range.style.setProperty("--share", `${100 * range.value}%`);
    element.classList.toggle("changed", about.default != null && Math.abs(v - about.default) > 1e-6 * Math.abs(about.default) + 1e-9);
  };
  /** Tell of a value and return the one that is allowed. */
  const set = (v) => {
    const fixed = whole ? Math.round(v) : Number(v.toPrecision(4));
    const kept = Math.min(about.high ?? Infinity, Math.max(about.low ?? -Infinity, fixed));
    change(kept);
    return kept;
  };
  range.oninput = () => {
    now = set(toValue(Number(range.value)));
    number.value = text(now);
    range.setAttribute("aria-valuetext", text(now));
    range.style.setProperty("--share", `${100 * range.value}%`);
  };
  range.onkeydown = (event) => {
    const way = { ArrowRight: 1, ArrowUp: 1, ArrowLeft: -1, ArrowDown: -1 }[event.key];
    if (!way || !whole) return; // a hundredth of the range would be less than one
    event.preventDefault();
    show(set(now + way));
  };
  range.ondblclick = () => { if (about.default != null) { set(about.default); show(about.default); } };
  number.onfocus = () => { number.value = Number((factor * now).toPrecision(6)); number.select(); };
  number.onkeydown = (event) => { event.stopPropagation(); if (event.key === "Enter") number.blur(); };
  number.onchange = () => { const v = typed(number.value) / factor; if (Number.isFinite(v)) now = set(v); };
  number.onblur = () => show(now);
  element.append(number, range);
  show(value);
  return { element, show };
}

function select(element, about, value, change) {
  const box = make("select", { id: about.id });
  box.append(...about.choices.map((choice) => make("option", { value: choice, textContent: choice })));
  box.onchange = () => change(box.value);
  const show = (v) => { box.value = v; };
  show(value);
  element.append(box);
  return { element, show };
}

function toggle(element, about, value, change) {
  const box = make("input", { type: "checkbox", id: about.id });
  box.onchange = () => change(box.checked);
  const show = (v) => { box.checked = v; };
  show(value);
  element.append(box);
  return { element, show };
}

function color(element, about, value, change) {
  const pick = make("input", { type: "color", "aria-label": about.title });
  const none = make("input", { type: "checkbox", id: about.id, title: "With colour", "aria-label": `${about.title}: with one` });
  const tell = () => change(none.checked ? pick.value : "");
  pick.oninput = () => { none.checked = true; tell(); };
  none.onchange = tell;
  const show = (v) => { none.checked = Boolean(v); if (v) pick.value = v; };
  pick.value = value || colour("dye");
  show(value);
  element.append(make("span", { className: "row" }, none, " ", pick));
  return { element, show };
}

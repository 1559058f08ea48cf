// One control for one number, choice, colour or switch: parameters and tool options look alike.

import { colour, make, pretty, words } from "./make.js";

/** How slider positions 0..1 map to values: straight, or bent where the range spans decades. */
function scale(low, high) {
  const wide = high - low >= 100;
  if (low > 0 && high / low > 200) {
    const [a, b] = [Math.log(low), Math.log(high)];
    return [(x) => Math.exp(a + x * (b - a)), (v) => (Math.log(Math.max(v, low)) - a) / (b - a)];
  }
  const power = wide && low >= 0 ? (high > 500 ? 5 : 3) : 1;
  return [(x) => low + (high - low) * x ** power, (v) => ((v - low) / (high - low)) ** (1 / power)];
}

/** Make a control from a declaration; `change(value)` hears of it. Returns { element, show(value) }. */
export function control(about, value, change) {
  const label = make("label", { title: about.sentence ?? "" }, about.label ?? words(about.name));
  const element = make("div", { className: "control" }, label);
  if (about.choices?.length) return select(element, about, value, change);
  if (about.unit === "color") return color(element, value, change);
  if (typeof value === "boolean") return toggle(element, label, value, change);
  return slider(element, about, value, change);
}

function slider(element, about, value, change) {
  const low = about.low ?? 0, high = about.high ?? Math.max(1, 4 * Math.abs(value ?? about.default ?? 1));
  const whole = about.whole ?? false;
  const [toValue, toPlace] = scale(low, high);
  const range = make("input", { type: "range", min: 0, max: 1, step: "any", "aria-label": about.name });
  const number = make("input", { className: "number", "aria-label": about.name, inputMode: "decimal" });
  const text = (v) => pretty(v, whole ? 6 : 3) + (about.unit ? ` ${about.unit}` : "");
  let now = value;
  const show = (v) => {
    now = v;
    if (document.activeElement !== number) number.value = text(v);
    if (!range.matches(":active")) range.value = toPlace(v);
    range.style.setProperty("--share", `${100 * range.value}%`);
    element.classList.toggle("changed", about.default != null && Math.abs(v - about.default) > 1e-6 * Math.abs(about.default) + 1e-9);
  };
  const set = (v) => {
    const fixed = whole ? Math.round(v) : Number(v.toPrecision(4));
    change(Math.min(about.high ?? Infinity, Math.max(about.low ?? -Infinity, fixed)));
  };
  range.oninput = () => {
    const v = toValue(Number(range.value));
    set(v); number.value = text(whole ? Math.round(v) : v);
    range.style.setProperty("--share", `${100 * range.value}%`);
  };
  range.ondblclick = () => { if (about.default != null) { set(about.default); show(about.default); } };
  number.onfocus = () => { number.value = pretty(now, 6); number.select(); };
  number.onkeydown = (event) => { event.stopPropagation(); if (event.key === "Enter") number.blur(); };
  number.onchange = () => { const v = parseFloat(number.value.replace(",", ".")); if (Number.isFinite(v)) { set(v); now = v; } };
  number.onblur = () => show(now);
  element.append(number, range);
  show(value);
  return { element, show };
}

function select(element, about, value, change) {
  const box = make("select", { "aria-label": about.name });
  box.append(...about.choices.map((choice) => make("option", { value: choice, textContent: choice })));
  box.onchange = () => change(box.value);
  const show = (v) => { box.value = v; };
  show(value);
  element.append(box);
  return { element, show };
}

function toggle(element, label, value, change) {
  const box = make("input", { type: "checkbox", id: `switch-${Math.random().toString(36).slice(2)}` });
  label.htmlFor = box.id;
  box.onchange = () => change(box.checked);
  const show = (v) => { box.checked = v; };
  show(value);
  element.append(box);
  return { element, show };
}

function color(element, value, change) {
  const pick = make("input", { type: "color", "aria-label": "colour" });
  const none = make("input", { type: "checkbox", title: "with colour" });
  const tell = () => change(none.checked ? pick.value : "");
  pick.oninput = () => { none.checked = true; tell(); };
  none.onchange = tell;
  const show = (v) => { none.checked = Boolean(v); if (v) pick.value = v; };
  pick.value = value || colour("dye");
  show(value);
  element.append(make("span", { className: "row" }, none, " ", pick));
  return { element, show };
}

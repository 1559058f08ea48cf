// Small ways to make elements.

/** An element with properties and children; `on...` are listeners, `data` goes to the dataset. */
export function make(tag, { data, ...properties } = {}, ...children) {
  const element = document.createElement(tag);
  for (const [key, value] of Object.entries(properties)) {
    if (key.startsWith("aria-") || key === "role" || key === "for") element.setAttribute(key, value);
    else element[key] = value;
  }
  Object.assign(element.dataset, data ?? {});
  element.append(...children.filter((child) => child != null));
  return element;
}

const SVG = "http://www.w3.org/2000/svg";

export function svg(tag, attributes, ...children) {
  const element = document.createElementNS(SVG, tag);
  for (const [key, value] of Object.entries(attributes)) element.setAttribute(key, value);
  element.append(...children);
  return element;
}

/** A line icon in a square of 24. */
export function icon(path) {
  return svg("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, svg("path", { d: path }));
}

/** A colour of the page by its name: what a canvas draws with. */
export const colour = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();

export const find = (id) => document.getElementById(id);

/** A number as a person writes it. */
export function pretty(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  if (value !== 0 && (Math.abs(value) >= 1e5 || Math.abs(value) < 1e-3)) return value.toExponential(1);
  return String(Number(value.toPrecision(digits)));
}

/** A parameter's name in words. */
export const words = (name) => name.charAt(0).toUpperCase() + name.slice(1).replaceAll("_", " ");

/** Set an element's text; a page that is told the same again has nothing to lay out. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

let shown = [];
/** Show a sentence for a while. */
export function note(text) {
  if (shown.includes(text)) return;
  shown.push(text);
  const box = make("div", { textContent: text });
  find("notes").append(box);
  setTimeout(() => { box.remove(); shown = shown.filter((other) => other !== text); }, 2500 + 45 * text.length);
}

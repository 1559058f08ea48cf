// Helpers that make elements.

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

/** Format a number for people. */
export function pretty(value, digits = 3) {
  if (!Number.isFinite(value)) return "–";
  const size = Math.abs(value);
  if (size >= 1e9 || (size < 1e-4 && size > 0)) {
    const [mantissa, power] = value.toExponential(1).split("e");
    return `${mantissa} × 10${[...String(Number(power))].map((sign) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign] ?? "⁻").join("")}`;
  }
  return Number(value.toPrecision(size >= 1e4 ? 6 : digits)).toLocaleString("en", { maximumFractionDigits: 8 });
}

/** Parse a typed number, with commas between thousands or a decimal comma. */
export function typed(text) {
  const plain = text.trim().replace(/[\s\u00a0]/g, "");
  return parseFloat(/^-?\d{1,3}(,\d{3})+(?!\d)/.test(plain) ? plain.replaceAll(",", "") : plain.replace(",", "."));
}

/** Return a parameter's name in words. */
export const words = (name) => name.charAt(0).toUpperCase() + name.slice(1).replaceAll("_", " ");

/** Matches phones, upright or sideways, where the panel covers the picture. */
export const narrow = matchMedia("(max-width: 760px), (max-height: 500px)");

/** Set an element's text, without a new layout where it is the same. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

let shown = [];
/** Show a sentence for a while, with a button where `action` is [label, function]. */
export function note(text, action) {
  if (shown.includes(text)) return;
  shown.push(text);
  const box = make("div", { textContent: text });
  if (action) box.append(make("button", { textContent: action[0], onclick: () => { action[1](); box.remove(); } }));
  find("notes").append(box);
  setTimeout(() => { box.remove(); shown = shown.filter((other) => other !== text); }, 2500 + 45 * text.length);
}

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
  const size = Math.abs(value);
  if (size >= 1e9 || (size < 1e-4 && size > 0)) {
    const [mantissa, power] = value.toExponential(1).split("e");
    return `${mantissa} × 10${[...String(Number(power))].map((sign) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign] ?? "⁻").join("")}`;
  }
  return Number(value.toPrecision(size >= 1e4 ? 6 : digits)).toLocaleString("en", { maximumFractionDigits: 8 });
}

/** The number that a person typed: with commas between thousands, or one for the decimals. */
export function typed(text) {
  const plain = text.trim().replace(/[\s\u00a0]/g, "");
  return parseFloat(/^-?\d{1,3}(,\d{3})+(?!\d)/.test(plain) ? plain.replaceAll(",", "") : plain.replace(",", "."));
}

/** A parameter's name in words. */
export const words = (name) => name.charAt(0).toUpperCase() + name.slice(1).replaceAll("_", " ");

/** Whether the page is a phone's, upright or on its side: then the panel lies over the picture. */
export const narrow = matchMedia("(max-width: 760px), (max-height: 500px)");

/** Set an element's text; a page that is told the same again has nothing to lay out. */
export function say(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

let shown = [];
/** Show a sentence for a while, with a button where `action` is [its text, what it does]. */
export function note(text, action) {
  if (shown.includes(text)) return;
  shown.push(text);
  const box = make("div", { textContent: text });
  if (action) box.append(make("button", { textContent: action[0], onclick: () => { action[1](); box.remove(); } }));
  find("notes").append(box);
  setTimeout(() => { box.remove(); shown = shown.filter((other) => other !== text); }, 2500 + 45 * text.length);
}

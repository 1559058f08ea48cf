// The view in a cell: pictures and status come over the kernel's channel, pointers and controls go back.

const words = (name) => { const text = name.replaceAll("_", " ").replaceAll("-", " "); return text[0].toUpperCase() + text.slice(1); };
const pretty = (value, digits = 3) => (Number.isFinite(value) ? Number(value.toPrecision(Math.abs(value) >= 1e4 ? 6 : digits)).toLocaleString("en", { maximumFractionDigits: 8 }) : "");

function make(tag, attributes = {}, ...children) {
  const element = document.createElement(tag);
  for (const [name, value] of Object.entries(attributes)) {
    if (name in element && !name.startsWith("aria")) element[name] = value; else element.setAttribute(name, value);
  }
  element.append(...children);
  return element;
}

function drawn(tag, attributes, ...children) {
  const element = document.createElementNS("http://www.w3.org/2000/svg", tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  element.append(...children);
  return element;
}

const icon = (path) => drawn("svg", { viewBox: "0 0 24 24", "aria-hidden": "true" }, drawn("path", { d: path }));

/** Make a control from a description; `change(value)` is called when it is changed, `show(value)` sets it. */
function control(about, value, change, units = {}) {
  const label = words(about.name), title = about.sentence ?? "";
  if (about.choices?.length || typeof value === "boolean") {
    const choices = about.choices?.length ? about.choices : ["false", "true"];
    const select = make("select", { "aria-label": label, title }, ...choices.map((choice) => make("option", { value: choice, textContent: words(choice || "none") })));
    select.value = String(value);
    select.onchange = () => change(typeof value === "boolean" ? select.value === "true" : select.value);
    return { element: make("label", { title }, make("span", { textContent: label }), select), show: (now) => { select.value = String(now); } };
  }
  if (about.unit === "color") {
    const input = make("input", { type: "color", value: value || "#2f9fe8", "aria-label": label });
    input.oninput = () => change(input.value);
    return { element: make("label", { title }, make("span", { textContent: label }), input), show: () => {} };
  }
  const whole = about.whole ?? Number.isInteger(about.default), low = about.low ?? 0;
  const high = Math.min(about.high ?? Infinity, Math.max(1, 4 * Math.abs(about.default ?? 1), 2 * Math.abs(value)));
  const said = make("output", {}), range = make("input", { type: "range", min: low, max: high, step: whole ? 1 : (high - low) / 200, "aria-label": label });
  const [factor, unit] = units[about.unit] ?? [1, about.unit ?? ""]; // units relative to the world's size, in metres and newtons
  const show = (now) => {
    if (!range.matches(":active")) range.value = now;
    said.textContent = `${pretty(factor * Number(now))} ${unit}`;
    range.setAttribute("aria-valuetext", said.textContent);
  };
  range.oninput = () => { const now = Number(Number(range.value).toPrecision(4)); show(now); change(whole ? Math.round(now) : now); };
  show(value);
  return { element: make("label", { title }, make("span", { textContent: label }), range, said), show };
}

function render({ model, el }) {
  const view = `${Date.now().toString(36)}${Math.random().toString(36).slice(2)}`;
  const send = (message) => model.send(message);
  const canvas = make("canvas", { className: "picture", tabIndex: 0, role: "img", "aria-label": "The water. Space pauses, arrows turn the view." });
  const rings = ["drop", "foot", "under", "ring"].map((part) => drawn("polyline", { class: part })), legend = make("div", { className: "legend", hidden: true });
  const aim = drawn("svg", { class: "aim", viewBox: "0 0 1 1", preserveAspectRatio: "none", "aria-hidden": "true" }, ...rings);
  const stage = make("div", { className: "stage" }, canvas, aim, legend);
  const bar = make("div", { className: "bar" }), tools = make("div", { className: "tools", role: "toolbar", "aria-label": "Tools" });
  const card = make("div", { className: "card" }), parameters = make("div", { className: "card" }), notes = make("div", { className: "notes", role: "status" });
  const more = make("details", {}, make("summary", { textContent: "Parameters and view" }), parameters);
  const root = make("div", { className: "wavetank-live", "data-lm-suppress-shortcuts": "true", hidden: true }, stage, bar, tools, card, more, notes);
  el.append(root);

  let about = null, tool = null, now = {}, world = {}, poster = null, sliders = new Map(), chosen = new Map(), parameter = new Map();

  // --- the picture saved in the notebook is hidden while there is a live one ---
  function hidePoster() {
    // It is the output before this one, within the outputs of the cell.
    for (let node = el, up = 0; node && up < 8 && !node.matches(".jp-OutputArea, .jp-Cell, .output_container"); node = node.parentElement, up += 1) {
      const before = node.previousElementSibling;
      if (before?.querySelector("img") && !before.querySelector("canvas")) { poster = before; break; }
    }
    if (poster) poster.style.display = "none";
  }

  async function paint(buffer) {
    const bitmap = await createImageBitmap(new Blob([buffer], { type: "image/jpeg" })).catch(() => null);
    send({ do: "ack" });
    if (!bitmap) return;
    if (canvas.width !== bitmap.width || canvas.height !== bitmap.height) Object.assign(canvas, { width: bitmap.width, height: bitmap.height });
    canvas.getContext("2d").drawImage(bitmap, 0, 0);
    bitmap.close();
  }

  // --- time ---
  const pause = make("button", { onclick: () => send({ do: "pause", on: !now.paused }) });
  const step = make("button", { title: "One frame (.)", "aria-label": "One frame", onclick: () => send({ do: "step" }) }, icon("M6 5l8 7-8 7zM17 5v14"));
  const back = make("button", { title: "One second back (,)", "aria-label": "One second back", onclick: () => send({ do: "rewind", time: Math.max(0, now.time - 1) }) }, icon("M18 5l-8 7 8 7zM7 5v14"));
  const again = make("button", { title: "Restart (R)", "aria-label": "Restart", onclick: () => send({ do: "reset" }) }, icon("M5 12a7 7 0 1 0 2.500-5.400M5 4v4h4"));
  const undo = make("button", { title: "Undo the last restart (Z)", "aria-label": "Undo", hidden: true, onclick: () => send({ do: "undo" }) }, icon("M8 5L4 9l4 4M4 9h9a6 6 0 0 1 0 12h-3"));
  const home = make("button", { title: "Reset the view (H)", "aria-label": "Reset the view", onclick: () => send({ do: "home" }) }, icon("M4 9V4h5M15 4h5v5M20 15v5h-5M9 20H4v-5M9 12h6M12 9v6"));
  const pace = make("select", { title: "Speed of time", "aria-label": "Speed of time" });
  const said = make("span", { className: "said" });
  pace.onchange = () => send({ do: "speed", factor: Number(pace.value) });
  bar.append(back, pause, step, again, undo, home, pace, said);

  function showStatus(status) {
    now = status;
    pause.replaceChildren(icon(status.paused ? "M7 5l11 7-11 7z" : "M8 5v14M16 5v14"));
    pause.title = `${status.paused ? "Play" : "Pause"} (Space)`;
    pause.setAttribute("aria-label", status.paused ? "Play" : "Pause");
    pace.value = String(status.speed);
    const slow = status.late ? ` · ${status.pace.toFixed(2)} × real time` : "";
    said.textContent = `t = ${status.time.toFixed(2)} s · ${status.count.toLocaleString("en")} particles${slow}`;
    for (const button of tools.children) button.classList.toggle("on", status.running.includes(button.dataset.tool));
    for (const text of status.notes) note(text);
    if (status.world) {
      world = { ...world, ...status.world };
      for (const [name, slider] of parameter) slider.show(world.values[name]);
      showWorld();
      if (more.open) send({ do: "fit" });
    }
    // The water moves under a resting pointer.
    if (hovered && !status.paused && performance.now() - answered > SELDOM) ask();
  }

  /** What there is to undo, and what the colours mean. */
  function showWorld() {
    undo.hidden = world.undo === null;
    const shown = world.legend;
    legend.hidden = !shown;
    if (!shown) return;
    const strip = make("i", { className: "strip" });
    strip.style.background = `linear-gradient(to right, ${shown.colors.join()})`;
    legend.replaceChildren(...(shown.names ? shown.names.map(([name, color]) => {
      const patch = make("i");
      patch.style.background = color;
      return make("span", { className: "key" }, patch, name);
    }) : [make("span", { textContent: shown.title }), strip, make("span", { className: "ends" }, ...shown.ticks.map((value) => make("b", { textContent: pretty(value) })))]));
  }

  // --- number of particles, and the pace to expect on this machine ---
  const fine = make("div", { className: "fine" });
  more.ontoggle = () => { if (more.open) send({ do: "fit" }); };
  function showFit({ here }) {
    fine.replaceChildren();
    if (here.length < 2) return;
    const far = ({ particles }) => Math.abs(Math.log(particles / now.count));
    const first = here.reduce((best, one, k) => (far(one) < far(here[best]) ? k : best), 0);
    const said = make("output", {}), range = make("input", { type: "range", min: 0, max: here.length - 1, step: 1, value: first, "aria-label": "Detail" });
    const show = () => {
      const { particles, pace: speed } = here[range.value];
      said.textContent = `about ${pretty(particles, 2)} particles: ${speed >= 0.95 ? "real time" : `${pretty(speed, 2)} × real time`} expected`;
      range.setAttribute("aria-valuetext", said.textContent);
    };
    range.oninput = show;
    range.onchange = () => send({ do: "reset", parameters: { spacing: here[range.value].spacing } });
    show();
    fine.append(make("label", { title: "Restarts with that many particles." }, make("span", { textContent: "Detail" }), range, said));
  }

  function note(text) {
    const line = make("p", { textContent: text });
    notes.append(line);
    setTimeout(() => line.remove(), 8000);
  }

  // --- tools, parameters, view: made from the kernel's descriptions ---
  function choose(name) {
    tool = about.tools.find((other) => other.name === name);
    const options = chosen.get(name) ?? {};
    chosen.set(name, options);
    for (const button of tools.children) button.setAttribute("aria-pressed", button.dataset.tool === name);
    canvas.classList.toggle("look", name === "look");
    sliders = tool.options.map((each) => control(each, options[each.name] ?? each.default, (value) => { options[each.name] = value; }, world.units).element);
    card.replaceChildren(make("p", { textContent: tool.sentence }), ...sliders);
  }

  function build(hello) {
    about = world = hello;
    tools.replaceChildren(...hello.tools.map((each) => {
      const button = make("button", { title: `${each.label}${each.key ? ` (${each.key.toUpperCase()})` : ""}: ${each.sentence}`, "aria-label": each.label, onclick: () => choose(each.name) }, icon(each.icon));
      button.dataset.tool = each.name;
      return button;
    }));
    pace.replaceChildren(...hello.speeds.map(([factor, text]) => make("option", { value: String(factor), textContent: text })));
    parameter = new Map();
    const live = hello.parameters.filter((each) => each.live && (each.choices.length || typeof each.default !== "object"));
    for (const each of live) parameter.set(each.name, control(each, hello.values[each.name], (value) => send({ do: "set", name: each.name, value }), hello.units));
    const looks = [["view", hello.views, hello.view], ["color_by", hello.colorings, hello.color_by]].map(([name, choices, value]) =>
      control({ name, choices, sentence: name === "view" ? "What is drawn." : "Quantity that colours the particles." }, value, (chosen) => send({ do: "view", [name]: chosen })).element);
    parameters.replaceChildren(fine, ...looks, ...[...parameter.values()].map(({ element }) => element));
    if (!tool) choose("push"); else choose(tool.name);
    showWorld();
    root.hidden = false;
    hidePoster();
    tellSize();
  }

  function tellSize() {
    const ratio = Math.min(window.devicePixelRatio || 1, 1.5), width = Math.round((canvas.clientWidth || 960) * ratio);
    send({ do: "size", width: Math.max(1, width), height: Math.max(1, Math.round(width * 9 / 16)) });
  }
  let resizing = 0;
  const watcher = new ResizeObserver(() => { clearTimeout(resizing); resizing = setTimeout(tellSize, 150); });
  watcher.observe(canvas);

  // --- preview of the tool: a ring on the surface under the pointer, a line to the floor ---
  const BETWEEN = 80, SELDOM = 600; // ms between two requests while the pointer moves, and while it rests
  let hovered = null, asked = 0, answered = 0, sent = "";
  const question = () => (hovered ? `${hovered.x} ${hovered.y} ${tool?.name}` : "");
  function hover(at) {
    hovered = at;
    if (!at || performance.now() - answered > BETWEEN) ask();
  }
  /** One question at a time; the answer asks again where the pointer has moved on. */
  function ask() {
    if (performance.now() - asked < 1000) return;
    if (!hovered || !tool || tool.name === "look") {
      showAim({});
      if (sent) send({ do: "hover" });
      sent = "";
      return;
    }
    sent = question();
    asked = performance.now();
    const value = (name) => chosen.get(tool.name)?.[name] ?? tool.options.find((each) => each.name === name)?.default;
    send({ do: "hover", x: hovered.x, y: hovered.y, tool: tool.name, reach: tool.cursor ? value("radius") ?? (value("width") ?? 0.1) / 2 : 0 });
  }
  function showAim(places) {
    for (const line of rings) line.setAttribute("points", (places[line.getAttribute("class").replace("under", "ring")] ?? []).map((p) => p.join()).join(" "));
  }
  function answer(message) {
    asked = 0;
    answered = performance.now();
    if (!hovered) { ask(); return; }
    showAim(message);
    if (question() !== sent) setTimeout(ask, BETWEEN);
  }

  // --- pointers ---
  const pointers = new Map();
  let tooling = null, pinch = 0, next = null, beat = 0;
  const where = (event) => {
    const box = canvas.getBoundingClientRect();
    return { x: (event.clientX - box.left) / box.width, y: (event.clientY - box.top) / box.height, shape: box.width / box.height };
  };
  const turn = (dx, dy, shape) => send(world.dim === 2 ? { do: "pan", right: -dx * shape, up: dy } : { do: "orbit", azimuth: -3.2 * dx * shape, elevation: 3.2 * dy });
  const spread = () => { const [a, b] = [...pointers.values()]; return a && b ? Math.hypot((a.x - b.x) * a.shape, a.y - b.y) : 0; };
  const lift = () => {
    if (tooling === null) return;
    if (next) send({ do: "point-move", x: next.x, y: next.y });
    next = tooling = null;
    send({ do: "point-end" });
  };
  canvas.onpointerdown = (event) => {
    event.preventDefault();
    canvas.focus({ preventScroll: true });
    canvas.setPointerCapture(event.pointerId);
    const at = where(event), turning = tool?.name === "look" || event.button === 2, sliding = event.button === 1 || event.shiftKey;
    pointers.set(event.pointerId, { ...at, mode: sliding ? "pan" : turning ? "turn" : "tool" });
    if (pointers.size === 2) {
      lift();
      for (const pointer of pointers.values()) pointer.mode = "both";
      pinch = spread();
    } else if (pointers.get(event.pointerId).mode === "tool") {
      tooling = event.pointerId;
      send({ do: "point-begin", x: at.x, y: at.y, tool: tool.name, options: chosen.get(tool.name) });
    }
  };
  canvas.onpointermove = (event) => {
    const pointer = pointers.get(event.pointerId), at = where(event);
    if (event.pointerType === "mouse" || pointers.size === 1) hover(pointer && pointer.mode !== "tool" ? null : at);
    if (!pointer) return;
    const [dx, dy] = [at.x - pointer.x, at.y - pointer.y];
    Object.assign(pointer, at);
    if (event.pointerId === tooling) {
      // At most thirty positions a second are sent, and always the last one.
      if (!next) beat = setTimeout(() => { if (next && tooling !== null) send({ do: "point-move", x: next.x, y: next.y }); next = null; }, 33);
      next = at;
    } else if (pointer.mode === "turn") turn(dx, dy, at.shape);
    else if (pointer.mode === "pan") send({ do: "pan", right: -dx * at.shape, up: dy });
    else if (pointer.mode === "both") {
      turn(dx / 2, dy / 2, at.shape);
      const wide = spread();
      const [a, b] = [...pointers.values()];
      if (wide > 0 && pinch > 0) send({ do: "zoom", factor: Math.min(2, Math.max(0.5, pinch / wide)), x: (a.x + b.x) / 2, y: (a.y + b.y) / 2 });
      pinch = wide;
    }
  };
  canvas.onpointerup = canvas.onpointercancel = (event) => {
    if (event.pointerId === tooling) lift();
    pointers.delete(event.pointerId);
    if (event.pointerType !== "mouse" && !pointers.size) hover(null);
  };
  canvas.onpointerleave = () => { if (!pointers.size) hover(null); };
  canvas.oncontextmenu = (event) => event.preventDefault();
  // The wheel belongs to the notebook until the water was clicked.
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !root.contains(document.activeElement)) return;
    event.preventDefault();
    const { x, y } = where(event);
    send({ do: "zoom", factor: Math.min(1.6, Math.max(0.6, Math.exp(0.0012 * event.deltaY * (event.deltaMode ? 30 : 1)))), x, y });
  }, { passive: false });

  const ACTIONS = { pause: () => pause.click(), back: () => back.click(), again: () => again.click() };
  canvas.onkeydown = (event) => {
    if (!about || event.ctrlKey || event.metaKey || event.altKey) return;
    const key = about.keys.find((other) => other.key === event.key || other.key === event.key.toLowerCase());
    const hit = about.tools.find((other) => other.key && other.key === event.key.toLowerCase());
    if (key ? !(key.command || ACTIONS[key.action]) : !hit) return;
    event.preventDefault();
    event.stopPropagation();
    if (event.repeat && !key?.repeats) return;
    if (key) (key.command ? send(key.command) : ACTIONS[key.action]()); else choose(hit.name);
  };

  // --- the channel ---
  const hear = (message, buffers) => {
    if (message.type === "picture") paint(buffers[0]);
    else if (message.type === "hello") build(message);
    else if (message.type === "status") showStatus(message);
    else if (message.type === "compiling") said.textContent = `Compiling, once (kernel ${message.number}) …`;
    else if (message.type === "note") note(message.text);
    else if (message.type === "aim") answer(message);
    else if (message.type === "fit") showFit(message);
    else if (message.type === "end") leave();
  };
  const hide = () => send({ do: "hidden", on: document.hidden });
  function leave() {
    root.remove();
    if (poster) poster.style.display = "";
  }
  model.on("msg:custom", hear);
  document.addEventListener("visibilitychange", hide);
  send({ do: "open", view });
  return () => {
    send({ do: "leave", view });
    model.off("msg:custom", hear);
    document.removeEventListener("visibilitychange", hide);
    watcher.disconnect();
    clearTimeout(beat);
    leave();
  };
}

export default { render };

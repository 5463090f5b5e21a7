"use strict";
// A drawn mechanism that the user can play, turn and enlarge.

const FRAME_MS = 66; // sixty-one samples in four seconds
const VIEW_WORDS = { oblique: "oblique", "y z": "front", "x z": "side", "x y": "top" };

// Draw a mechanism into a box, and connect its buttons, slider and keys.
//   name: of the files of its pictures; trouble: called with the reason why there is none.
// Returns `draw`, which draws it again, and `change`, which shows another drawing in the same view.
function mechanism(box, drawing, name, trouble) {
  let motion = motionOf(drawing);
  const bounds = boundsOf(motion);
  const views = viewsOf(bounds);
  box.querySelector(".controls").prepend(...controlsOf(box, drawing));
  const canvas = box.querySelector("canvas");
  const slider = box.querySelector("input[type=range]");
  const sample = box.querySelector("output");
  const last = () => motion.frames - 1;
  const [azimuth, elevation] = views[firstView(bounds)];
  const camera = { frame: drawing.start, azimuth, elevation, zoom: 1, pan: [0, 0] };

  const draw = () => paint(box, drawing, motion, bounds, camera);
  const limited = (value, low, high) => Math.min(Math.max(value, low), high);

  function show(frame) {
    camera.frame = limited(frame, 0, last());
    sample.textContent = drawing.steps[camera.frame] || "design position";
    if (slider) {
      slider.value = camera.frame;
      slider.setAttribute("aria-valuetext", sample.textContent);
    }
    draw();
  }

  function look(azimuth, elevation) {
    camera.azimuth = azimuth;
    camera.elevation = limited(elevation, -Math.PI / 2, Math.PI / 2);
    draw();
  }
  const turn = (aside, upwards) => look(camera.azimuth + aside, camera.elevation + upwards);

  function enlarge(factor) {
    const before = camera.zoom;
    camera.zoom = limited(camera.zoom * factor, 0.3, 20);
    camera.pan = camera.pan.map((value) => (value * camera.zoom) / before);
    draw();
  }

  function move(right, down) {
    camera.pan = [camera.pan[0] + right, camera.pan[1] + down];
    draw();
  }
  // An arrow key turns the view, and with Shift moves it.
  const arrow =
    (right, up) =>
    ({ shiftKey }) =>
      shiftKey ? move(24 * right, -24 * up) : turn(-0.1 * right, 0.1 * up);

  function change(next, moved = motionOf(next)) {
    drawing = next;
    motion = moved;
    explainArrows(box, motion);
    if (slider) slider.max = last();
    show(camera.frame);
  }

  const closed = () => isClosed(motion);
  const { toggle, pause } = player(box, () => camera.frame, show, last, closed);
  const step = (by) => {
    pause();
    show(camera.frame + by);
  };
  listenToKeys(canvas, {
    ArrowLeft: arrow(-1, 0),
    ArrowRight: arrow(1, 0),
    ArrowUp: arrow(0, 1),
    ArrowDown: arrow(0, -1),
    " ": toggle,
    ",": () => step(-1),
    ".": () => step(1),
    "+": () => enlarge(1.15),
    "=": () => enlarge(1.15),
    "-": () => enlarge(1 / 1.15),
  });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    const [right, down] = [event.movementX, event.movementY];
    if (event.buttons & 6 || (event.buttons & 1 && event.shiftKey)) move(right, down);
    else if (event.buttons & 1) turn(-right / 120, down / 120);
  });
  canvas.addEventListener("contextmenu", (event) => event.preventDefault());
  // The wheel scrolls the page unless the picture was chosen.
  canvas.addEventListener("wheel", (event) => {
    if (document.activeElement !== canvas && !event.ctrlKey) return;
    event.preventDefault();
    enlarge(Math.exp(-0.0015 * event.deltaY));
  });
  if (slider) {
    slider.addEventListener("input", () => {
      pause();
      show(Number(slider.value));
    });
  }
  for (const button of box.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => {
      Object.assign(camera, { zoom: 1, pan: [0, 0] });
      look(...views[button.dataset.view]);
    });
  }
  box.querySelector("[data-act=in]").addEventListener("click", () => enlarge(1.25));
  box.querySelector("[data-act=out]").addEventListener("click", () => enlarge(0.8));
  for (const check of box.querySelectorAll("[data-layer]")) check.addEventListener("change", draw);
  for (const button of box.querySelectorAll("[data-picture]")) {
    button.addEventListener("click", async () => {
      button.disabled = true;
      const size = [canvas.clientWidth, canvas.clientHeight];
      const onto = (pen, frame = camera.frame) =>
        paint(box, drawing, motion, bounds, { ...camera, frame, pen, size });
      const there = Array.from({ length: motion.frames }, (_, frame) => frame);
      const film = closed() ? there : [...there, ...there.slice(1, -1).reverse()];
      try {
        await savePicture(button.dataset.picture, onto, size, name, film);
      } catch (error) {
        trouble(error.message);
      }
      button.disabled = false;
    });
  }
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  explainArrows(box, motion);
  show(camera.frame);
  return { draw, change };
}

// The controls of a scene: the player of several samples; views, layers and pictures. Layers named
// in the box's `data-off` begin hidden; with `data-forces`, arrows may follow.
function controlsOf(box, { steps, wheels, arrows, unit }) {
  const make = (kind, given, ...content) => {
    const made = document.createElement(kind);
    for (const [key, value] of Object.entries(given)) made.setAttribute(key, value);
    made.append(...content);
    return made;
  };
  const button = (text, given) => make("button", { type: "button", ...given }, text);
  const group = (label, ...buttons) =>
    make("span", { class: "buttons", role: "group", "aria-label": label }, ...buttons);
  const player = [
    button("play", { "data-act": "play", "aria-pressed": "false" }),
    make("input", { type: "range", min: 0, max: steps.length - 1, "aria-label": "Sample shown" }),
  ];
  const views = Object.entries(VIEW_WORDS).map(([view, word]) =>
    button(word, { "data-view": view, title: view }),
  );
  const zoom = [
    button("+", { "data-act": "in", "aria-label": "larger" }),
    button("−", { "data-act": "out", "aria-label": "smaller" }),
  ];
  const forces = arrows.length || "forces" in box.dataset;
  const there = { wheels: wheels.length, centres: wheels.length, forces };
  const off = ["centres", ...(box.dataset.off || "").split(" ")];
  const layers = ["names", "frames", "paths", ...Object.keys(there).filter((name) => there[name])];
  const checks = layers.map((name) => {
    const check = make("input", { type: "checkbox", "data-layer": name });
    check.checked = !off.includes(name);
    const word = name === "forces" && unit !== "N" ? "moves" : name;
    return make("label", {}, check, ` ${word}`);
  });
  const pictures = ["SVG", "PNG", ...(steps.length > 1 ? ["film"] : [])].map((kind) =>
    button(kind, { "data-picture": kind.toLowerCase() }),
  );
  const row = (...content) => make("div", { class: "row" }, ...content);
  return [
    row(...(steps.length > 1 ? player : []), make("output", {})),
    row(group("View", ...views, ...zoom), ...checks, group("Save the picture", ...pictures)),
  ];
}

// The player of the samples, which can pause; none without a button.
function player(box, current, show, last, closed) {
  const button = box.querySelector("[data-act=play]");
  let timer = 0;
  let by = 1;

  function next() {
    if (closed()) return show((current() + 1) % (last() + 1));
    if (current() + by < 0 || current() + by > last()) by = -by;
    show(current() + by);
  }
  function say(text, pressed) {
    button.textContent = text;
    button.setAttribute("aria-pressed", pressed);
  }
  function pause() {
    clearInterval(timer);
    timer = 0;
    if (button) say("play", "false");
  }
  function toggle() {
    if (!button) return;
    if (timer) return pause();
    say("pause", "true");
    timer = setInterval(next, FRAME_MS);
  }
  if (button) button.addEventListener("click", toggle);
  return { toggle, pause };
}

// The scale of the arrows as text, for a round length.
function explainArrows(box, { perMetre, places, unit }) {
  const place = box.querySelector("[data-scale]");
  if (place) place.textContent = "";
  if (!perMetre) return;
  const length = niceStep(span(places.flat()) / 20);
  const [millimetres, size] = [shown(1000 * length), shown(perMetre * length)];
  const scale = `${millimetres} mm of arrow are ${size} ${unit}.`;
  place.textContent = scale;
}

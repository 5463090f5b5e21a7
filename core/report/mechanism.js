"use strict";
// A drawn mechanism that the user can play, turn and enlarge.

const FRAME_MS = 66; // sixty-one samples in four seconds

// Draw a mechanism into a box, and connect its buttons, slider and keys.
// Returns `draw`, which draws it again, and `change`, which shows another drawing in the same view.
function mechanism(box, drawing) {
  let motion = motionOf(drawing);
  const bounds = boundsOf(motion);
  const views = viewsOf(bounds);
  const canvas = box.querySelector("canvas");
  const slider = box.querySelector("input[type=range]");
  const sample = box.querySelector("output");
  const last = () => motion.frames - 1;
  const [azimuth, elevation] = views[firstView(bounds)];
  const camera = { frame: drawing.start, azimuth, elevation, zoom: 1 };

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
    camera.zoom = limited(camera.zoom * factor, 0.3, 20);
    draw();
  }

  function change(next) {
    drawing = next;
    motion = motionOf(next);
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
    ArrowLeft: () => turn(0.1, 0),
    ArrowRight: () => turn(-0.1, 0),
    ArrowUp: () => turn(0, 0.1),
    ArrowDown: () => turn(0, -0.1),
    " ": toggle,
    ",": () => step(-1),
    ".": () => step(1),
    "+": () => enlarge(1.15),
    "=": () => enlarge(1.15),
    "-": () => enlarge(1 / 1.15),
  });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons & 1) turn(-event.movementX / 120, event.movementY / 120);
  });
  if (slider) {
    slider.addEventListener("input", () => {
      pause();
      show(Number(slider.value));
    });
  }
  for (const button of box.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => {
      camera.zoom = 1;
      look(...views[button.dataset.view]);
    });
  }
  box.querySelector("[data-act=in]").addEventListener("click", () => enlarge(1.25));
  box.querySelector("[data-act=out]").addEventListener("click", () => enlarge(0.8));
  for (const check of box.querySelectorAll("[data-layer]")) check.addEventListener("change", draw);
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  explainArrows(box, motion);
  show(camera.frame);
  return { draw, change };
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

// The scale of the arrows as text, for a round force.
function explainArrows(box, { perMetre, places }) {
  if (!perMetre) return;
  const length = niceStep(span(places.flat()) / 20);
  const [millimetres, newtons] = [shown(1000 * length), shown(perMetre * length)];
  const scale = `${millimetres} mm of arrow are ${newtons} N.`;
  box.querySelector("[data-scale]").textContent = scale;
}

"use strict";
// Points in 3D, and a row for each role: a click on a point gives it to the chosen role.

const find = (id) => document.getElementById(id);
const view = { azimuth: 0.7, elevation: 0.35, zoom: 1 };
let data = null;
let chosen = 0;
let spots = [];

function boundsOf(points) {
  const ends = [0, 1, 2].map((k) => points.map(({ at }) => at[k]));
  const low = ends.map((each) => Math.min(...each));
  const high = ends.map((each) => Math.max(...each));
  const half = low.map((a, k) => (high[k] - a) / 2);
  const reach = (axis) => half.reduce((all, h, k) => all + h * Math.abs(axis[k]), 0);
  const middle = low.map((a, k) => (a + high[k]) / 2);
  return { middle, size: 2 * Math.hypot(...half), reach };
}

const placeOf = (role) => {
  const row = data.roles.find(({ name }) => name === role);
  return row && data.points.find(({ name }) => name === row.point);
};

function draw() {
  const canvas = find("scene");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  const pen = cleared(canvas, width, height);
  const style = getComputedStyle(document.body);
  const own = (name) => style.getPropertyValue(name).trim();
  const { seen } = cameraOf(view, boundsOf(data.points), width, height);
  const { line, disc } = brush(pen);
  const write = writer(pen, width, height, style.fontFamily, own("--paper"));
  for (const [a, b] of data.links) {
    const [from, to] = [placeOf(a), placeOf(b)];
    if (from && to) line([seen(from.at), seen(to.at)], own("--axis"), 2);
  }
  const wanted = data.roles[chosen].point;
  const beside = [[1, 0], [-1, 0], [0, -12], [0, 16]];
  spots = data.points.map(({ name, at }) => ({ name, place: seen(at) }));
  for (const { name, place } of spots) {
    const isWanted = name === wanted;
    const isUsed = data.roles.some(({ point }) => point === name);
    const fill = isWanted ? COLOURS[1] : isUsed ? COLOURS[0] : own("--paper");
    disc(place, isWanted ? 8 : 5, fill, own("--ink"));
  }
  for (const { name, place } of spots) {
    const role = data.roles.find(({ point }) => point === name);
    const text = role && role.name !== name ? `${name}: ${role.name}` : name;
    write(place, text, own("--ink"), beside, name === wanted ? "bold" : "");
  }
}

function choose(k) {
  chosen = (k + data.roles.length) % data.roles.length;
  const { name, meaning, point } = data.roles[chosen];
  const now = point ? `Now it is ${point}.` : "No point has it yet.";
  find("asked").textContent = `Which one is ${name}, ${meaning}? ${now}`;
  [...find("roles").rows].forEach((row, n) => {
    row.toggleAttribute("aria-current", n === chosen);
    row.style.fontWeight = n === chosen ? "bold" : "";
  });
  draw();
}

// Give a point to the chosen role; what had it before takes the point that the role had.
function give(name) {
  const role = data.roles[chosen];
  const other = data.roles.find((each) => each.point === name && each !== role);
  if (other && name) other.point = role.point;
  role.point = name;
  fill();
  choose(chosen + (name ? 1 : 0));
}

function fill() {
  const rows = data.roles.map(({ name, meaning, needed, point }, k) => {
    const row = document.createElement("tr");
    const cell = (text) => Object.assign(document.createElement("td"), { textContent: text });
    const select = document.createElement("select");
    select.setAttribute("aria-label", `point of ${name}`);
    for (const each of ["", ...data.points.map((p) => p.name)]) {
      select.add(new Option(each || (needed ? "choose" : "none"), each, false, each === point));
    }
    select.addEventListener("focus", () => chosen === k || choose(k));
    select.addEventListener("change", () => {
      chosen = k;
      give(select.value);
    });
    row.addEventListener("click", () => choose(k));
    const last = cell("");
    last.append(select);
    row.append(cell(name), cell(needed ? meaning : `optional: ${meaning}`), last);
    return row;
  });
  find("roles").replaceChildren(...rows);
}

const say = (text) => (find("state").textContent = text);
const send = answererOf(
  (message) => heard[message.type](message),
  () => say("connection lost; start kincheck serve again"),
);

function save() {
  const roles = Object.fromEntries(data.roles.map(({ name, point }) => [name, point]));
  send({ type: "names", roles });
}

function listen(canvas) {
  let from = null;
  canvas.addEventListener("pointerdown", (event) => {
    from = { x: event.offsetX, y: event.offsetY, moved: 0 };
    canvas.setPointerCapture(event.pointerId);
  });
  canvas.addEventListener("pointermove", (event) => {
    if (!from) return;
    const [dx, dy] = [event.offsetX - from.x, event.offsetY - from.y];
    from = { x: event.offsetX, y: event.offsetY, moved: from.moved + Math.hypot(dx, dy) };
    if (from.moved < 4) return;
    view.azimuth -= 0.01 * dx;
    view.elevation = Math.max(-1.5, Math.min(1.5, view.elevation + 0.01 * dy));
    draw();
  });
  canvas.addEventListener("pointerup", (event) => {
    const still = from && from.moved < 4;
    from = null;
    if (!still) return;
    const far = ({ place: [x, y] }) => Math.hypot(x - event.offsetX, y - event.offsetY);
    const near = spots.reduce((best, each) => (far(each) < far(best) ? each : best));
    if (far(near) < 24) give(near.name);
  });
  const turn = (key, step) => () => {
    view[key] += step;
    draw();
  };
  listenToKeys(canvas, {
    ArrowLeft: turn("azimuth", 0.1),
    ArrowRight: turn("azimuth", -0.1),
    ArrowUp: turn("elevation", 0.1),
    ArrowDown: turn("elevation", -0.1),
  });
}

function open(message) {
  data = message;
  document.title = `${data.file}: which point is which?`;
  const lines = [...data.why, ...data.doubts.map((each) => `Doubtful: ${each}.`)];
  const item = (text) => Object.assign(document.createElement("li"), { textContent: text });
  find("why").replaceChildren(...lines.map(item));
  fill();
  listen(find("scene"));
  find("save").addEventListener("click", save);
  window.addEventListener("resize", draw);
  choose(0);
  document.documentElement.dataset.ready = "";
}

const heard = {
  unnamed: open,
  saved({ name }) {
    say(`saved: ${name}`);
    location.reload(); // the page of the named table
  },
  invalid: ({ message }) => say(message),
  changed: ({ message }) => say(message),
};

"use strict";
// A mechanism on a canvas: bodies where the poses say, seen in parallel projection with z up. No library: lines and text are enough.

const VIEWS = { "y z": [0, 0], "x z": [-Math.PI / 2, 0], "x y": [-Math.PI / 2, Math.PI / 2] }; // azimuth, elevation
const FRAME_MS = 66; // sixty-one samples in four seconds

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const cross = (u, v) => [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
const sum = (a, b, factor = 1) => a.map((value, k) => value + factor * b[k]);
const direction = (a) => a.map((value) => value / Math.hypot(...a));

// A vector of a body with the Euler parameters p, in global axes: a + 2 e0 (e x a) + 2 e x (e x a).
function turned([e0, ...e], a) {
  const once = cross(e, a), twice = cross(e, once);
  return a.map((value, k) => value + 2 * (e0 * once[k] + twice[k]));
}

// The outline of points on the screen, for the skin of a body (Andrew's monotone chain).
function outline(points) {
  const sorted = points.slice().sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (some) => some.reduce((kept, c) => {
    const left = (a, b) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
    while (kept.length > 1 && !left(kept.at(-2), kept.at(-1))) kept.pop();
    return [...kept, c];
  }, []);
  return [...half(sorted).slice(0, -1), ...half(sorted.reverse()).slice(0, -1)];
}

// A tyre as a circle about its axis of rotation, and the road below it: a rectangle through the contact centre.
function wheelShape(center, spin, up, radius) {
  const rise = direction(sum(up, spin, -dot(up, spin))), heading = direction(cross(spin, rise)), aside = cross(up, heading);
  const turn = (k, part = 1) => sum(sum(center, heading, part * radius * Math.cos(k)), rise, part * radius * Math.sin(k));
  const circle = (part) => Array.from({ length: 49 }, (_, k) => turn((k * Math.PI) / 24, part)), contact = turn(-Math.PI / 2);
  const corner = (along, across) => sum(sum(contact, heading, along * radius), aside, across * radius);
  const axis = [sum(center, spin, -0.4 * radius), sum(center, spin, 0.4 * radius)];
  return { tyre: circle(1), rim: circle(0.62), axis, road: [corner(-1.4, -0.8), corner(1.4, -0.8), corner(1.4, 0.8), corner(-1.4, 0.8), corner(-1.4, -0.8)] };
}

function mechanism(box, drawing) {
  const { bodies, nodes, links, rods, marks, labels, paths, steps, arrows } = drawing;
  const canvas = box.querySelector("canvas"), pen = canvas.getContext("2d");
  const play = box.querySelector("[data-act=play]"), slider = box.querySelector("input[type=range]"), said = box.querySelector("output");
  const frames = Math.max(1, steps.length), moving = bodies.flatMap((body, k) => (body.fixed ? [] : [k]));

  const pose = (body, f) => [body.r[f] || body.r[0], body.p[f] || body.p[0]];
  const placed = (b, place, f) => {
    const [r, p] = pose(bodies[b], f), arm = turned(p, place);
    return r.map((value, k) => value + arm[k]);
  };
  const places = Array.from({ length: frames }, (_, f) => nodes.map(([b, ...place]) => placed(b, place, f)));
  const wheels = Array.from({ length: frames }, (_, f) => drawing.wheels.map(([b, center, spin, up, radius]) => wheelShape(placed(b, center, f), turned(pose(bodies[b], f)[1], spin), up, radius)));
  const span = (points) => Math.hypot(...[0, 1, 2].map((k) => Math.max(...points.map((at) => at[k])) - Math.min(...points.map((at) => at[k])))) || 1;
  // the largest force is about a quarter of the mechanism long
  const largest = Math.max(0, ...arrows.flatMap(([, , , forces]) => forces.map((force) => (force ? Math.hypot(...force) : 0))));
  const perMetre = largest && niceStep(largest / (0.25 * span(places.flat())));
  const ends = Array.from({ length: frames }, (_, f) => arrows.map(([b, place, name, forces]) => {
    const from = placed(b, place, f);
    return forces[f] && largest ? { name, from, to: sum(from, forces[f], 1 / perMetre), size: Math.hypot(...forces[f]) } : null;
  }));
  const all = [...places.flat(), ...wheels.flat().flatMap(({ tyre, road }) => [...tyre, ...road]), ...ends.flat().flatMap((arrow) => (arrow ? [arrow.to] : []))];
  const extent = [0, 1, 2].map((k) => all.reduce(([low, high], at) => [Math.min(low, at[k]), Math.max(high, at[k])], [Infinity, -Infinity]));
  const sizes = extent.map(([low, high]) => high - low), size = Math.hypot(...sizes) || 1;
  const middle = extent.map(([low, high]) => (low + high) / 2);
  // a motion that comes back to where it began goes on; another one goes to and fro
  const distance = (f, g) => Math.max(...places[f].map((at, k) => Math.hypot(...at.map((value, i) => value - places[g][k][i]))));
  const closed = frames > 2 && distance(0, frames - 1) < 2 * distance(0, 1);

  // from where the mechanism looks widest
  const width = (a) => Math.max(...all.map((at) => Math.abs(dot([-Math.sin(a), Math.cos(a), 0], at.map((value, k) => value - middle[k])))));
  const views = { ...VIEWS, oblique: [[-2.2, -1.9, -1.2, -0.9, -0.6, -0.3].reduce((best, a) => (width(a) > 1.05 * width(best) ? a : best)), 0.35] };

  let frame = drawing.start, [azimuth, elevation] = views.oblique, zoom = 1, timer = 0, direction = 1;
  // what lies in a plane is looked at squarely
  const flat = ["y z", "x z", "x y"].find((_, k) => sizes[k] < 0.01 * size);
  if (flat) [azimuth, elevation] = VIEWS[flat];

  function draw() {
    const ratio = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
    if (!width) return;
    if (canvas.width !== Math.round(width * ratio)) canvas.width = Math.round(width * ratio);
    if (canvas.height !== Math.round(height * ratio)) canvas.height = Math.round(height * ratio);
    pen.setTransform(ratio, 0, 0, ratio, 0, 0);
    pen.clearRect(0, 0, width, height);
    const style = getComputedStyle(box), colour = (name) => style.getPropertyValue(`--${name}`).trim();
    const own = (b) => (bodies[b].fixed ? colour("soft") : colour(`s${moving.indexOf(b) % 6}`));
    const layer = (name) => (box.querySelector(`[data-layer=${name}]`) || {}).checked;

    const [ca, sa, ce, se] = [Math.cos(azimuth), Math.sin(azimuth), Math.cos(elevation), Math.sin(elevation)];
    const right = [-sa, ca, 0], up = [-se * ca, -se * sa, ce], near = [ce * ca, ce * sa, se];
    const about = (at) => at.map((value, k) => value - middle[k]);
    // every sample fits, so that nothing leaves the picture or changes its size while it moves
    const reach = (axis) => Math.max(...all.map((at) => Math.abs(dot(axis, about(at)))), 0.05 * size);
    const scale = zoom * Math.min((width / 2 - 60) / reach(right), (height / 2 - 34) / reach(up));
    const seen = (at) => [width / 2 + scale * dot(right, about(at)), height / 2 - scale * dot(up, about(at)), dot(near, about(at)) / size];
    const spots = places[frame].map(seen);

    const line = (points, stroke, thick, dash = [], alpha = 1) => {
      pen.beginPath();
      points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
      Object.assign(pen, { strokeStyle: stroke, lineWidth: thick, lineCap: "round", lineJoin: "round", globalAlpha: alpha });
      pen.setLineDash(dash);
      pen.stroke();
      pen.setLineDash([]);
      pen.globalAlpha = 1;
    };
    const dotted = (x, y, radius, fill, edge) => {
      pen.beginPath();
      pen.arc(x, y, radius, 0, 2 * Math.PI);
      Object.assign(pen, { fillStyle: fill, strokeStyle: edge, lineWidth: 1.6 });
      pen.fill();
      pen.stroke();
    };

    if (layer("wheels")) {
      for (const { tyre, rim, axis, road } of wheels[frame]) {
        const fill = (points, shade, alpha) => {
          pen.beginPath();
          points.map(seen).forEach(([x, y]) => pen.lineTo(x, y));
          Object.assign(pen, { fillStyle: shade, globalAlpha: alpha });
          pen.fill();
          pen.globalAlpha = 1;
        };
        fill(road, colour("axis"), 0.25);
        line(road.map(seen), colour("axis"), 1);
        fill(tyre, colour("soft"), 0.12);
        line(tyre.map(seen), colour("soft"), 3.5, [], 0.7);
        line(rim.map(seen), colour("soft"), 1, [], 0.7);
        line(axis.map(seen), colour("soft"), 1.4, [9, 3, 2, 3]);
      }
    }
    if (layer("paths")) for (const k of paths) line(places.map((at) => seen(at[k])), colour("ink"), 2, [1, 5], 0.8);
    for (const b of moving) {
      const skin = outline(spots.filter((_, k) => nodes[k][0] === b));
      if (skin.length < 3) continue;
      pen.beginPath();
      skin.forEach(([x, y]) => pen.lineTo(x, y));
      Object.assign(pen, { fillStyle: own(b), globalAlpha: 0.12 });
      pen.fill();
      pen.globalAlpha = 1;
    }
    const lines = [
      ...links.map(([a, b]) => [a, b, own(nodes[a][0]), 3, []]),
      ...rods.map(([a, b]) => [a, b, colour("ink"), 3, [9, 4]]),
    ];
    const depth = ([a, b]) => spots[a][2] + spots[b][2];
    for (const [a, b, ...look] of lines.sort((one, other) => depth(one) - depth(other))) {
      line([spots[a], spots[b]], ...look, Math.min(1, 0.8 + 0.4 * (spots[a][2] + spots[b][2])));
    }
    for (const [node, kind, axis, onFixed] of marks) {
      const [x, y] = spots[node], edge = colour("ink"), fill = colour("raised");
      if (onFixed) {
        Object.assign(pen, { strokeStyle: colour("soft"), lineWidth: 1.2 });
        pen.strokeRect(x - 9, y - 9, 18, 18);
      }
      const along = axis && turned(pose(bodies[nodes[node][0]], frame)[1], axis), flatly = along && [dot(right, along), -dot(up, along)];
      const at = (s, t = 0) => [x + s * flatly[0] - t * flatly[1], y + s * flatly[1] + t * flatly[0]];
      if (kind === "hinge" && along) line([at(-16), at(16)], edge, 1.6, [7, 2, 2, 2]);
      if (kind === "slide" && along) line([at(-13, -4), at(13, -4), at(13, 4), at(-13, 4), at(-13, -4)], edge, 1.6);
      else if (kind === "cross") { line([[x - 5, y - 5], [x + 5, y + 5]], edge, 2); line([[x + 5, y - 5], [x - 5, y + 5]], edge, 2); }
      else if (kind === "ball") dotted(x, y, 5, edge, fill);
      else if (kind === "hinge") dotted(x, y, 5, fill, edge);
      else if (kind === "end") dotted(x, y, 3, edge, fill);
      else line([[x - 5, y], [x, y - 5], [x + 5, y], [x, y + 5], [x - 5, y]], edge, 1.6);
    }
    for (const k of paths) dotted(spots[k][0], spots[k][1], 4, colour("paper"), colour("ink"));

    const forces = layer("forces") ? ends[frame].filter(Boolean) : [];
    for (const { from, to } of forces) {
      const [[x0, y0], [x, y]] = [from, to].map(seen), length = Math.hypot(x - x0, y - y0);
      if (length < 3) continue;
      const [ux, uy] = [(x - x0) / length, (y - y0) / length], head = (side) => [x - 10 * ux + side * 4 * uy, y - 10 * uy - side * 4 * ux];
      line([[x0, y0], [x, y]], colour("force"), 2.5);
      line([head(1), [x, y], head(-1)], colour("force"), 2.5);
    }
    const written = [];
    const write = (x, y, text, fill, font, offsets) => {
      pen.font = `${font} 12px ${style.fontFamily}`;
      const wide = pen.measureText(text).width;
      for (const [dx, dy] of offsets.map(([sx, dy]) => [sx < 0 ? -10 - wide : sx ? 10 : -wide / 2, dy])) {
        const [left, top] = [x + dx, y + dy - 10];
        const free = written.every(([l, t, w]) => left > l + w + 3 || l > left + wide + 3 || Math.abs(top - t) > 13);
        if (!free || left < 2 || left + wide > width - 2 || top < 0 || top > height - 14) continue;
        written.push([left, top, wide]);
        Object.assign(pen, { strokeStyle: colour("raised"), fillStyle: fill, lineWidth: 3 });
        pen.strokeText(text, x + dx, y + dy);
        pen.fillText(text, x + dx, y + dy);
        return;
      }
    };
    if (layer("frames")) {
      for (const b of moving) {
        const [, p] = pose(bodies[b], frame), origin = seen(placed(b, bodies[b].frame, frame));
        for (const axis of [[1, 0, 0], [0, 1, 0], [0, 0, 1]]) {
          const along = turned(p, axis), tip = [origin[0] + 24 * dot(right, along), origin[1] - 24 * dot(up, along)];
          line([origin, tip], own(b), 1.2);
          pen.font = `10px ${style.fontFamily}`;
          pen.fillStyle = own(b);
          if (moving.length < 7 && Math.hypot(tip[0] - origin[0], tip[1] - origin[1]) > 8) pen.fillText("xyz"[axis.indexOf(1)], tip[0] + 2, tip[1] + 3);
        }
      }
    }
    const corner = [30, height - 30];
    ["x", "y", "z"].forEach((name, k) => {
      const tip = [corner[0] + 20 * right[k], corner[1] - 20 * up[k]];
      line([corner, tip], colour("soft"), 1.4);
      if (Math.hypot(right[k], up[k]) > 0.3) write(tip[0], tip[1], name, colour("soft"), "", [[right[k] < -0.3 ? -1 : 1, 4]]);
    });
    for (const { name, to, size: newtons } of forces) {
      const [x, y] = seen(to);
      write(x, y, `${name} ${shown(newtons, ".3g")} N`, colour("force"), "", [[1, 4], [-1, 4], [0, -8], [0, 18]]);
    }
    if (layer("names")) {
      const around = [[1, -8], [1, 16], [-1, -8], [-1, 16], [0, -16], [0, 26]];
      for (const [a, b, text] of labels) write((spots[a][0] + spots[b][0]) / 2, (spots[a][1] + spots[b][1]) / 2, text, colour("ink"), "", around);
      for (const b of moving) {
        const mine = spots.filter((_, k) => nodes[k][0] === b);
        if (mine.length) write(...[0, 1].map((k) => mine.reduce((sum, at) => sum + at[k], 0) / mine.length), bodies[b].name, own(b), "italic", around);
      }
    }
  }

  function show(next) {
    frame = Math.min(Math.max(next, 0), frames - 1);
    said.textContent = steps[frame] || "design position";
    if (slider) {
      slider.value = frame;
      slider.setAttribute("aria-valuetext", said.textContent);
    }
    draw();
  }
  function pause() {
    clearInterval(timer);
    timer = 0;
    if (!play) return;
    play.textContent = "play";
    play.setAttribute("aria-pressed", "false");
  }
  function toggle() {
    if (!play) return;
    if (timer) return pause();
    play.textContent = "pause";
    play.setAttribute("aria-pressed", "true");
    timer = setInterval(() => {
      if (closed) return show((frame + 1) % frames);
      if (frame + direction < 0 || frame + direction >= frames) direction = -direction;
      show(frame + direction);
    }, FRAME_MS);
  }
  function look(a, e) {
    [azimuth, elevation] = [a, Math.min(Math.max(e, -Math.PI / 2), Math.PI / 2)];
    draw();
  }
  function enlarge(factor) {
    zoom = Math.min(Math.max(zoom * factor, 0.3), 20);
    draw();
  }

  const keys = {
    ArrowLeft: () => look(azimuth + 0.1, elevation), ArrowRight: () => look(azimuth - 0.1, elevation),
    ArrowUp: () => look(azimuth, elevation + 0.1), ArrowDown: () => look(azimuth, elevation - 0.1),
    " ": toggle, ",": () => { pause(); show(frame - 1); }, ".": () => { pause(); show(frame + 1); },
    "+": () => enlarge(1.15), "=": () => enlarge(1.15), "-": () => enlarge(1 / 1.15),
  };
  canvas.addEventListener("keydown", (event) => {
    if (!keys[event.key] || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    keys[event.key]();
  });
  canvas.addEventListener("pointerdown", (event) => canvas.setPointerCapture(event.pointerId));
  canvas.addEventListener("pointermove", (event) => {
    if (event.buttons & 1) look(azimuth - event.movementX / 120, elevation + event.movementY / 120);
  });
  if (play) play.addEventListener("click", toggle);
  if (slider) slider.addEventListener("input", () => { pause(); show(+slider.value); });
  for (const button of box.querySelectorAll("[data-view]")) {
    button.addEventListener("click", () => { zoom = 1; look(...views[button.dataset.view]); });
  }
  box.querySelector("[data-act=in]").addEventListener("click", () => enlarge(1.25));
  box.querySelector("[data-act=out]").addEventListener("click", () => enlarge(0.8));
  for (const check of box.querySelectorAll("[data-layer]")) check.addEventListener("change", draw);
  new ResizeObserver(draw).observe(canvas);
  matchMedia("(prefers-color-scheme: dark)").addEventListener("change", draw);
  if (largest) {
    const length = niceStep(span(places.flat()) / 20);
    box.querySelector("[data-scale]").textContent = `${shown(1000 * length)} mm of arrow are ${shown(perMetre * length)} N.`;
  }
  show(frame);
  return draw;
}

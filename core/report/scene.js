"use strict";
// A mechanism on a canvas, in parallel projection with z up. No library: lines and text are enough.

const ABOVE_BELOW = [
  [1, -8],
  [1, 16],
  [-1, -8],
  [-1, 16],
  [0, -16],
  [0, 26],
];
const BESIDE = [
  [1, 4],
  [-1, 4],
  [0, -8],
  [0, 18],
];

// Draw a mechanism into its box at a sample, seen from a direction, with the layers that its boxes
// to tick ask for, or else the given ones.
function paint(box, drawing, motion, bounds, { frame, azimuth, elevation, zoom, layers = [] }) {
  const canvas = box.querySelector("canvas");
  const [width, height] = [canvas.clientWidth, canvas.clientHeight];
  if (!width) return;
  const pen = cleared(canvas, width, height);
  const style = getComputedStyle(box);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  const isFixed = (b) => drawing.bodies[b].fixed;
  const own = (b) => colour(isFixed(b) ? "soft" : `s${motion.moving.indexOf(b) % 6}`);
  const ticked = (layer) => (box.querySelector(`[data-layer=${layer}]`) || {}).checked;
  const isOn = (layer) => layers.includes(layer) || ticked(layer);

  const camera = cameraOf(azimuth, elevation, zoom, bounds, width, height);
  const spots = motion.places[frame].map(camera.seen);
  const forces = isOn("forces") ? motion.forces[frame] : [];
  const family = style.fontFamily;
  const write = writer(pen, width, height, family, colour("raised"));
  const shown = { drawing, motion, frame, spots, colour, own, family };
  const picture = { ...brush(pen), ...camera, ...shown, write };

  if (isOn("wheels")) motion.wheels[frame].forEach((wheel) => paintWheel(picture, wheel));
  if (isOn("paths")) drawing.paths.forEach((node) => paintPath(picture, node));
  motion.moving.forEach((b) => paintSkin(picture, b));
  paintLinks(picture);
  drawing.marks.forEach((mark) => paintMark(picture, mark));
  for (const node of drawing.paths) picture.disc(spots[node], 4, colour("paper"), colour("ink"));
  forces.forEach((force) => paintForce(picture, force));
  if (isOn("frames")) motion.moving.forEach((b) => paintFrame(picture, b));
  paintAxes(picture, [30, height - 30]);
  forces.forEach((force) => writeForce(picture, force));
  if (isOn("names")) writeNames(picture);
}

function paintWheel({ line, area, seen, colour }, wheel) {
  const road = wheel.road.map(seen);
  const tyre = wheel.tyre.map(seen);
  area(road, colour("axis"), 0.25);
  line(road, colour("axis"), 1);
  area(tyre, colour("soft"), 0.12);
  line(tyre, colour("soft"), 3.5, [], 0.7);
  line(wheel.rim.map(seen), colour("soft"), 1, [], 0.7);
  line(wheel.axis.map(seen), colour("soft"), 1.4, [9, 3, 2, 3]);
}

function paintPath({ line, seen, colour, motion }, node) {
  line(
    motion.places.map((at) => seen(at[node])),
    colour("ink"),
    2,
    [1, 5],
    0.8,
  );
}

function paintSkin({ area, drawing, spots, own }, b) {
  const skin = outline(spots.filter((_, k) => drawing.nodes[k][0] === b));
  if (skin.length > 2) area(skin, own(b), 0.12);
}

// Links and rods, from the farthest to the nearest.
function paintLinks({ line, drawing, spots, colour, own }) {
  const lines = [
    ...drawing.links.map(([a, b]) => [a, b, own(drawing.nodes[a][0]), 3, []]),
    ...drawing.rods.map(([a, b]) => [a, b, colour("ink"), 3, [9, 4]]),
  ];
  const depth = ([a, b]) => spots[a][2] + spots[b][2];
  lines.sort((one, other) => depth(one) - depth(other));
  for (const [a, b, ...look] of lines) {
    line([spots[a], spots[b]], ...look, Math.min(1, 0.8 + 0.4 * depth([a, b])));
  }
}

// The mark of a joint at a node; a square around it where it is on a fixed body.
function paintMark(picture, [node, kind, axis, onFixed]) {
  const { pen, line, disc, drawing, motion, frame, spots, colour, flat } = picture;
  const [x, y] = spots[node];
  const edge = colour("ink");
  const fill = colour("raised");
  if (onFixed) {
    Object.assign(pen, { strokeStyle: colour("soft"), lineWidth: 1.2 });
    pen.strokeRect(x - 9, y - 9, 18, 18);
  }
  const along = axis && flat(motion.rotated(drawing.nodes[node][0], axis, frame));
  const at = (s, t) => [x + s * along[0] - t * along[1], y + s * along[1] + t * along[0]];
  const around = (half, high) => [
    [-half, -high],
    [half, -high],
    [half, high],
    [-half, high],
    [-half, -high],
  ];
  if (kind === "hinge" && along) line([at(-16, 0), at(16, 0)], edge, 1.6, [7, 2, 2, 2]);
  if (kind === "hinge") disc([x, y], 5, fill, edge);
  else if (kind === "ball") disc([x, y], 5, edge, fill);
  else if (kind === "end") disc([x, y], 3, edge, fill);
  else if (kind === "slide" && along)
    line(
      around(13, 4).map(([s, t]) => at(s, t)),
      edge,
      1.6,
    );
  else if (kind === "cross") {
    line(
      [
        [x - 5, y - 5],
        [x + 5, y + 5],
      ],
      edge,
      2,
    );
    line(
      [
        [x + 5, y - 5],
        [x - 5, y + 5],
      ],
      edge,
      2,
    );
  } else
    line(
      [
        [x - 5, y],
        [x, y - 5],
        [x + 5, y],
        [x, y + 5],
        [x - 5, y],
      ],
      edge,
      1.6,
    );
}

function paintForce({ line, seen, colour }, { from, to }) {
  const [[x0, y0], [x, y]] = [seen(from), seen(to)];
  const length = Math.hypot(x - x0, y - y0);
  if (length < 3) return;
  const [ux, uy] = [(x - x0) / length, (y - y0) / length];
  const barb = (side) => [x - 10 * ux + side * 4 * uy, y - 10 * uy - side * 4 * ux];
  line(
    [
      [x0, y0],
      [x, y],
    ],
    colour("force"),
    2.5,
  );
  line([barb(1), [x, y], barb(-1)], colour("force"), 2.5);
}

function writeForce({ seen, colour, write }, { name, to, size }) {
  write(seen(to), `${name} ${shown(size, ".3g")} N`, colour("force"), BESIDE);
}

// The axes of a body's frame; their names where few bodies move.
function paintFrame(picture, b) {
  const { pen, line, drawing, motion, frame, seen, flat, own, family } = picture;
  const [x, y] = seen(motion.placed(b, drawing.bodies[b].frame, frame));
  ["x", "y", "z"].forEach((name, k) => {
    const [dx, dy] = flat(motion.rotated(b, unit(k), frame));
    const tip = [x + 24 * dx, y + 24 * dy];
    line([[x, y], tip], own(b), 1.2);
    Object.assign(pen, { font: `10px ${family}`, fillStyle: own(b) });
    const hasRoom = motion.moving.length < 7 && Math.hypot(tip[0] - x, tip[1] - y) > 8;
    if (hasRoom) pen.fillText(name, tip[0] + 2, tip[1] + 3);
  });
}

// The directions of the global axes, in a corner.
function paintAxes({ line, flat, colour, write }, [x, y]) {
  ["x", "y", "z"].forEach((name, k) => {
    const [dx, dy] = flat(unit(k));
    const tip = [x + 20 * dx, y + 20 * dy];
    line([[x, y], tip], colour("soft"), 1.4);
    if (Math.hypot(dx, dy) > 0.3) write(tip, name, colour("soft"), [[dx < -0.3 ? -1 : 1, 4]]);
  });
}

function writeNames({ drawing, motion, spots, colour, own, write }) {
  const mean = (some) =>
    [0, 1].map((k) => some.reduce((total, at) => total + at[k], 0) / some.length);
  for (const [a, b, text] of drawing.labels) {
    write(mean([spots[a], spots[b]]), text, colour("ink"), ABOVE_BELOW);
  }
  for (const b of motion.moving) {
    const mine = spots.filter((_, k) => drawing.nodes[k][0] === b);
    if (mine.length) write(mean(mine), drawing.bodies[b].name, own(b), ABOVE_BELOW, "italic");
  }
}

"use strict";
// A mechanism on a canvas, in parallel projection with z up. No library: shaded faces, lines and
// text are enough.

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

const BAR = 0.0085; // radius of a bar in sizes of the mechanism
// Half a tyre's section, and a hub: distances along the axis of rotation and from it in radii. No
// file states a width: this is that of an ordinary tyre, two thirds of its radius.
const TYRE = [
  [-0.27, 0.64],
  [-0.33, 0.8],
  [-0.28, 0.96],
  [-0.16, 1],
  [0.16, 1],
  [0.28, 0.96],
  [0.33, 0.8],
  [0.27, 0.64],
];
const HUB = [
  [-0.12, 0],
  [-0.12, 0.16],
  [0.16, 0.16],
  [0.16, 0],
];

// Draw a mechanism into its box at a sample, seen by a camera, with the layers that its boxes to
// tick ask for, or else the given ones.
//   pen, size: of another surface than the canvas of the box.
function paint(box, drawing, motion, bounds, { frame, layers = [], pen, size, ...look }) {
  const canvas = box.querySelector("canvas");
  const [width, height] = size || [canvas.clientWidth, canvas.clientHeight];
  if (!width) return;
  const style = getComputedStyle(box);
  const colour = (name) => style.getPropertyValue(`--${name}`).trim();
  const isFixed = (b) => drawing.bodies[b].fixed;
  const own = (b) => colour(isFixed(b) ? "axis" : `s${motion.moving.indexOf(b) % 6}`);
  const ticked = (layer) => (box.querySelector(`[data-layer=${layer}]`) || {}).checked;
  const isOn = (layer) => layers.includes(layer) || ticked(layer);
  const surface = pen || cleared(canvas, width, height);
  if (pen) {
    pen.fillStyle = colour("raised");
    pen.fillRect(0, 0, width, height);
  }
  const camera = cameraOf(look, bounds, width, height);
  const spots = motion.places[frame].map(camera.seen);
  const forces = isOn("forces") ? motion.forces[frame] : [];
  const family = style.fontFamily;
  const write = writer(surface, width, height, family, colour("raised"));
  const shown = { drawing, motion, frame, spots, colour, own, isFixed, family };
  const strokes = brush(surface);
  const bar = Math.max(1.3, BAR * camera.scale * bounds.size);
  const picture = { ...strokes, ...camera, ...shown, write, bar };
  picture.stage = stageOf(strokes, bar);
  const wheels = isOn("wheels") ? motion.wheels[frame] : [];

  wheels.forEach(({ road }) => paintRoad(picture, road));
  wheels.forEach((wheel) => putWheel(picture, wheel));
  motion.moving.forEach((b) => putBody(picture, b));
  drawing.rods.forEach(([a, b]) => picture.stage.bar(spots[a], spots[b], colour("soft"), 0.8));
  drawing.springs.forEach((spring) => putSpring(picture, spring));
  drawing.tubes.forEach(([a, b]) => {
    const end = sum(spots[a], sum(spots[b], spots[a], -1), 0.55);
    picture.stage.bar(spots[a], end, own(drawing.nodes[a][0]), 1.9, true);
  });
  drawing.marks.forEach((mark) => putMark(picture, mark));
  picture.stage.show();
  if (isOn("paths")) drawing.paths.forEach((node) => paintPath(picture, node));
  if (isOn("centres")) {
    const found = centresOf(drawing, motion, frame);
    found.forEach((each) => each && paintCentres(picture, each, bounds.size));
    new Set(found.map((each) => each && each.center)).forEach((center) => {
      if (center) write(camera.seen(center), "roll centre", colour("good"), BESIDE);
    });
  }
  forces.forEach((force) => paintForce(picture, force));
  if (isOn("frames")) motion.moving.forEach((b) => paintFrame(picture, b));
  paintAxes(picture, [30, height - 30]);
  forces.forEach((force) => writeForce(picture, force));
  if (isOn("names")) writeNames(picture);
}

function paintRoad({ line, area, seen, colour }, corners) {
  const road = corners.map(seen);
  area(road, colour("axis"), 0.25);
  line([...road, road[0]], colour("axis"), 1);
}

function putWheel({ stage, seen, turn, colour, line, scale }, wheel) {
  const axis = direction(turn(wheel.spin));
  const place = seen(wheel.center);
  const radius = scale * wheel.radius;
  const sized = (profile) => profile.map((row) => row.map((value) => radius * value));
  stage.solid(place, axis, sized(TYRE), colour("soft"), { alpha: 0.2, sides: 24 });
  stage.solid(place, axis, sized(HUB), colour("axis"));
  const ring = ([along, far]) => {
    const rays = raysAbout(axis, 40);
    const middle = sum(place, axis, radius * along);
    return [...rays, rays[0]].map((ray) => sum(middle, ray, radius * far));
  };
  for (const k of [0, 2, 5, 7]) stage.thread(ring(TYRE[k]), colour("soft"), 1.1, 0.75);
  const rim = ring([0.2, 0.64]);
  const hub = ring([0.16, 0.16]);
  for (let k = 0; k < 5; k++) {
    const at = 8 * k;
    stage.thread([hub[at], rim[at]], colour("soft"), 2, 0.6);
  }
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

// A body: bars between its hardpoints, and a skin over them.
function putBody({ stage, drawing, spots, own }, b) {
  const isMine = (node) => drawing.nodes[node][0] === b;
  for (const [a, c] of drawing.links) if (isMine(a)) stage.bar(spots[a], spots[c], own(b));
  const skin = outline(spots.filter((_, node) => isMine(node)));
  if (skin.length > 2) stage.plate(skin, own(b), 0.14);
}

// A spring as a coil, a damper as a tube with a piston rod.
function putSpring({ stage, spots, colour }, [a, b, kind]) {
  const [from, to] = [spots[a], spots[b]];
  if (kind !== "damper") stage.coil(from, to, colour("warn"), kind === "both" ? 4.2 : 3.4);
  if (kind === "spring") return;
  const at = (share) => sum(from, sum(to, from, -1), share);
  stage.bar(from, at(0.6), colour("soft"), 2, true);
  stage.bar(at(0.6), to, colour("axis"), 0.7);
}

const cylinder = (half, radius) => [[-half, 0], [-half, radius], [half, radius], [half, 0]];

// The mark of a joint at a node: a sleeve on a hinge's or a slide's axis, a ball, a cross of a
// universal joint; on a block or in a housing where it is on a fixed body.
function putMark(picture, [node, kind, axis, onFixed]) {
  const { stage, bar, line, drawing, motion, frame, spots, colour, turn } = picture;
  const spot = spots[node];
  const dark = colour("soft");
  const light = colour("axis");
  const arrow = axis && turn(motion.rotated(drawing.nodes[node][0], axis, frame));
  const along = arrow && direction(arrow);
  const sleeve = (half, radius, shade) =>
    stage.solid(spot, along, cylinder(half * bar, radius * bar), shade);
  if (kind === "hinge" && along) {
    sleeve(2.6, onFixed ? 1.9 : 1.6, onFixed ? light : dark);
    sleeve(3.2, 0.8, dark);
    line([sum(spot, along, -7 * bar), sum(spot, along, 7 * bar)], dark, 1.2, [7, 2, 2, 2]);
    return;
  }
  if (kind === "slide" && along) return sleeve(onFixed ? 5 : 3, 1.7, onFixed ? light : dark);
  if (onFixed) {
    const upwards = direction(turn([0, 0, 1]));
    stage.solid(spot, upwards, cylinder(1.9 * bar, 2.6 * bar), light, { sides: 4 });
  }
  stage.ball(spot, kind === "cross" ? light : dark, kind === "end" ? 1.35 : 1.9);
  if (kind !== "cross") return;
  const over = (x, y) => sum(spot, [1.5 * bar * x, 1.5 * bar * y, 3 * bar]);
  stage.thread([over(-1, -1), over(1, 1)], colour("ink"), 1.6);
  stage.thread([over(-1, 1), over(1, -1)], colour("ink"), 1.6);
}

// The instant axis of a wheel's carrier, the lines to the instant centres, the roll centre, and the
// steering axis down to the road.
function paintCentres(picture, at, size) {
  const { line, disc, seen, colour, write } = picture;
  const { contact, axis, instant, side, center, kingpin, up, out } = at;
  const [blue, green, red] = ["link", "good", "bad"].map(colour);
  const isNear = (place) => Math.hypot(...sum(place, contact, -1)) < 8 * size;
  const mark = (place, text, shade) => {
    disc(seen(place), 4, colour("paper"), shade);
    write(seen(place), text, shade, BESIDE);
  };
  if (axis && isNear(axis.place)) {
    const ends = [-2, 2].map((far) => seen(sum(axis.place, axis.along, far * size)));
    line(ends, blue, 1.4, [12, 3, 3, 3]);
    write(seen(axis.place), "instant axis", blue, BESIDE);
  }
  const toCentre = (place, text, shade) => {
    if (!place || !isNear(place)) return;
    line([contact, place].map(seen), shade, 1.3, [6, 4]);
    mark(place, text, shade);
  };
  toCentre(instant, "instant centre, front", green);
  toCentre(side, "instant centre, side", red);
  if (center) {
    line([contact, center].map(seen), green, 1.6);
    const post = [-0.12, 0.12].map((far) => seen(sum(center, up, far * size)));
    line(post, green, 1, [6, 2, 1, 2]);
    disc(seen(center), 4, colour("paper"), green);
  }
  if (!kingpin) return;
  const { high, road, ahead } = kingpin;
  const corner = sum(contact, ahead, dot(sum(road, contact, -1), ahead));
  const middle = (a, b) => seen(sum(a, b).map((value) => value / 2));
  line([high, road].map(seen), colour("force"), 1.6, [9, 3, 2, 3]);
  line([contact, corner, road].map(seen), colour("force"), 2);
  disc(seen(road), 3, colour("force"), colour("force"));
  write(middle(contact, corner), "trail", colour("force"), BESIDE);
  write(middle(corner, road), "scrub radius", colour("force"), BESIDE);
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
  write(seen(to), `${name} ${size}`, colour("force"), BESIDE);
}

// The axes of a body's frame; their names where few bodies move.
function paintFrame(picture, b) {
  const { pen, line, drawing, motion, frame, seen, turn, own, family } = picture;
  const [x, y] = seen(motion.placed(b, drawing.bodies[b].frame, frame));
  ["x", "y", "z"].forEach((name, k) => {
    const [dx, dy] = turn(motion.rotated(b, unit(k), frame)).map((value) => value / picture.scale);
    const tip = [x + 24 * dx, y + 24 * dy];
    line([[x, y], tip], own(b), 1.2);
    Object.assign(pen, { font: `10px ${family}`, fillStyle: own(b) });
    const hasRoom = motion.moving.length < 7 && Math.hypot(tip[0] - x, tip[1] - y) > 8;
    if (hasRoom) pen.fillText(name, tip[0] + 2, tip[1] + 3);
  });
}

// The directions of the global axes, in a corner.
function paintAxes({ line, turn, scale, colour, write }, [x, y]) {
  ["x", "y", "z"].forEach((name, k) => {
    const [dx, dy] = turn(unit(k)).map((value) => value / scale);
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

"use strict";
// The motion of a mechanism: where its points, wheels and forces are at each sample.

// Viewing directions: azimuth and elevation [rad].
const PLANES = { "y z": [0, 0], "x z": [-Math.PI / 2, 0], "x y": [-Math.PI / 2, Math.PI / 2] };
const OBLIQUE = [-2.2, -1.9, -1.2, -0.9, -0.6, -0.3]; // azimuths to choose from [rad]

// The motion of a drawing, whose bodies have a position and Euler parameters for each sample.
// Returns, by sample, the `places` of the nodes, the shapes of the `wheels` and the `forces`; and
// `frames`, their number; `moving`, the numbers of the moving bodies; `placed` and `rotated`, which
// bring a point and a vector of a body to a sample.
function motionOf(drawing) {
  const { bodies, nodes, steps } = drawing;
  const frames = Math.max(1, steps.length);
  const eachFrame = (make) => Array.from({ length: frames }, (_, frame) => make(frame));

  const rotated = (b, vector, frame) => turned(bodies[b].p[frame] || bodies[b].p[0], vector);
  const placed = (b, place, frame) =>
    sum(bodies[b].r[frame] || bodies[b].r[0], rotated(b, place, frame));
  const wheel = ([b, center, spin, up, radius], frame) =>
    wheelShape(placed(b, center, frame), rotated(b, spin, frame), up, radius);

  const places = eachFrame((frame) => nodes.map(([b, ...place]) => placed(b, place, frame)));
  const wheels = eachFrame((frame) => drawing.wheels.map((each) => wheel(each, frame)));
  const perMetre = forceScale(drawing.arrows, span(places.flat()));
  const forces = eachFrame((frame) =>
    drawing.arrows.flatMap(([b, place, name, vectors]) => {
      const vector = vectors[frame];
      if (!vector || !perMetre) return [];
      const from = placed(b, place, frame);
      const size = `${shown(Math.hypot(...vector), ".3g")} ${drawing.unit}`;
      return [{ name, from, to: sum(from, vector, 1 / perMetre), size }];
    }),
  );
  const moving = bodies.flatMap((body, b) => (body.fixed ? [] : [b]));
  const { unit } = drawing;
  return { frames, moving, placed, rotated, places, wheels, forces, perMetre, unit };
}

// Newtons per metre of an arrow; 0 without forces. The arrow of the largest force is about a
// quarter of the mechanism long.
function forceScale(arrows, length) {
  const sizes = arrows.flatMap(([, , , vectors]) =>
    vectors.map((vector) => (vector ? Math.hypot(...vector) : 0)),
  );
  const largest = Math.max(0, ...sizes);
  return largest && niceStep(largest / (0.25 * length));
}

// The extent of a picture over all samples, so that the view keeps everything at one size.
// Returns `reach`, the largest distance from the `middle` along an axis, and the `size` of all.
function boundsOf({ places, wheels, forces }) {
  const rounds = wheels.flat().flatMap(({ tyre, road }) => [...tyre, ...road]);
  const all = [...places.flat(), ...rounds, ...forces.flat().map(({ to }) => to)];
  const ends = extent(all);
  const middle = ends.map(([low, high]) => (low + high) / 2);
  const sizes = ends.map(([low, high]) => high - low);
  const reach = (axis) => Math.max(...all.map((at) => Math.abs(dot(axis, sum(at, middle, -1)))));
  return { middle, reach, sizes, size: span(all) };
}

// The viewing directions by name, with the oblique one that shows the mechanism widest.
function viewsOf({ reach }) {
  const width = (azimuth) => reach([-Math.sin(azimuth), Math.cos(azimuth), 0]);
  const widest = OBLIQUE.reduce((best, each) => (width(each) > 1.05 * width(best) ? each : best));
  return { ...PLANES, oblique: [widest, 0.35] };
}

// The name of the first view: perpendicular to the plane of a planar mechanism.
function firstView({ sizes, size }) {
  return Object.keys(PLANES).find((_, k) => sizes[k] < 0.01 * size) || "oblique";
}

// Whether a motion ends where it began, so that it repeats; other motions go to and fro.
function isClosed({ frames, places }) {
  const moved = (f, g) =>
    Math.max(...places[f].map((at, k) => Math.hypot(...sum(at, places[g][k], -1))));
  return frames > 2 && moved(0, frames - 1) < 2 * moved(0, 1);
}

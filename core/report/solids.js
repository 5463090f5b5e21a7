"use strict";
// Solids on the screen: faces in the light, drawn from the farthest to the nearest. Places are
// [px] to the right, down and towards the eye.

const LIGHT = direction([-0.35, -0.75, 0.6]);
const SIDES = 12;

// Red, green and blue of a colour of the style sheet, such as #fa0 or #ffaa00.
function rgbOf(text) {
  const digits = text.length === 4 ? [...text.slice(1)].map((each) => each + each) : null;
  const pairs = digits || [text.slice(1, 3), text.slice(3, 5), text.slice(5, 7)];
  return pairs.map((pair) => parseInt(pair, 16));
}

// The colour of a face in the light: half as bright in the shade, with a sheen where it is bright.
function inLight(rgb, normal) {
  const light = Math.max(0, dot(normal, LIGHT));
  const part = 0.52 + 0.5 * light;
  const sheen = 90 * Math.max(0, light - 0.75);
  return `rgb(${rgb.map((each) => Math.round(Math.min(255, each * part + sheen)))})`;
}

// Two unit vectors perpendicular to an axis and to each other.
function beside(axis) {
  const first = direction(cross(axis, Math.abs(axis[2]) < 0.9 ? [0, 0, 1] : [1, 0, 0]));
  return [first, cross(axis, first)];
}

// Places on a circle about an axis, as unit vectors.
function raysAbout(axis, count, turns = 1) {
  const [u, v] = beside(axis);
  return Array.from({ length: count }, (_, k) => {
    const angle = (2 * Math.PI * turns * k) / count;
    return u.map((value, i) => value * Math.cos(angle) + v[i] * Math.sin(angle));
  });
}

// The faces of a profile turned about an axis through a place.
//   profile: distances along the axis and from it, with the outside to the left.
function turnedFaces(place, axis, profile, sides) {
  const rays = raysAbout(axis, 2 * sides);
  const ring = ([along, radius]) => {
    const middle = sum(place, axis, along);
    const rim = rays.filter((_, k) => k % 2 === 0).map((ray) => sum(middle, ray, radius));
    return [...rim, rim[0]];
  };
  const rings = profile.map(ring);
  return profile.slice(1).flatMap(([along, radius], j) => {
    const [ds, dr] = [along - profile[j][0], radius - profile[j][1]];
    const size = Math.hypot(ds, dr) || 1;
    return Array.from({ length: sides }, (_, k) => ({
      points: [rings[j][k], rings[j][k + 1], rings[j + 1][k + 1], rings[j + 1][k]],
      normal: rays[2 * k + 1].map((value, i) => (ds * value - dr * axis[i]) / size),
    }));
  });
}

// A stage: what is put on it is drawn by `show`, from the farthest to the nearest.
//   r: the radius of a bar [px].
function stageOf({ line, area, disc }, r) {
  const items = [];
  const put = (depth, draw) => items.push([depth, draw]);
  const depthOf = (points) => points.reduce((total, at) => total + at[2], 0) / points.length;

  // What a profile makes about an axis; through it one sees if alpha is below 1.
  function solid(place, axis, profile, colour, { alpha = 1, sides = SIDES } = {}) {
    const rgb = rgbOf(colour);
    for (const { points, normal } of turnedFaces(place, axis, profile, sides)) {
      if (alpha === 1 && normal[2] <= 0) continue;
      put(depthOf(points), () => area(points, inLight(rgb, normal), alpha, alpha === 1));
    }
  }
  function bar(from, to, colour, thick = 1, capped = false) {
    const arm = sum(to, from, -1);
    const length = Math.hypot(...arm);
    if (length < 1e-6) return;
    const [radius, pieces] = [r * thick, Math.max(1, Math.min(12, Math.round(length / (8 * r))))];
    const profile = Array.from({ length: pieces + 1 }, (_, k) => [(length * k) / pieces, radius]);
    const whole = capped ? [[0, 0], ...profile, [length, 0]] : profile;
    solid(from, direction(arm), whole, colour);
  }
  function ball(at, colour, size) {
    const rgb = rgbOf(colour);
    const radius = r * size;
    const sheen = sum(at, LIGHT, 0.4 * radius);
    put(at[2] + radius, () => {
      disc(at, radius, inLight(rgb, [0, 0, 1]), inLight(rgb, [0, 0, -1]));
      disc(sheen, 0.4 * radius, inLight(rgb, LIGHT), inLight(rgb, LIGHT));
    });
  }
  function thread(points, colour, width, alpha = 1) {
    points.slice(1).forEach((to, k) => {
      const piece = [points[k], to];
      put(depthOf(piece), () => line(piece, colour, width, [], alpha));
    });
  }
  function plate(points, colour, alpha) {
    put(depthOf(points), () => area(points, colour, alpha));
  }
  function coil(from, to, colour, size) {
    const arm = sum(to, from, -1);
    const length = Math.hypot(...arm);
    if (length < 1e-6) return;
    const [turns, count] = [8, 96];
    const rays = raysAbout(direction(arm), count, turns);
    const wire = rays.map((ray, k) => sum(sum(from, arm, k / (count - 1)), ray, r * size));
    thread(wire, colour, Math.max(1.2, 0.9 * r));
  }
  function show() {
    items.sort(([one], [other]) => one - other);
    for (const [, draw] of items) draw();
  }
  return { solid, bar, ball, thread, plate, coil, show };
}

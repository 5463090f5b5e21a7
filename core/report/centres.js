"use strict";
// Centres of a wheel's motion: instant axis, instant and roll centre, steering axis on the road.
// They are from differences of drawn poses, to look at; the outputs have the exact numbers.

// The derivatives of values at a frame by a parameter: of the parabola through three frames.
function slopes(values, parameter, frame) {
  const last = values.length - 1;
  const [a, b, c] = [-1, 0, 1].map((k) => Math.min(Math.max(frame, 1), last - 1) + k);
  const [s, ...at] = [frame, a, b, c].map((k) => parameter[k]);
  const weight = (i, j, k) => (2 * s - at[j] - at[k]) / ((at[i] - at[j]) * (at[i] - at[k]));
  const weights = [weight(0, 1, 2), weight(1, 0, 2), weight(2, 0, 1)];
  return values[frame].map((_, i) =>
    [a, b, c].reduce((total, k, j) => total + weights[j] * values[k][i], 0),
  );
}

// The angular velocity of Euler parameters p with their derivatives: 2 (e0 e' - e0' e + e x e').
function angularVelocity([e0, ...e], [d0, ...d]) {
  const turn = cross(e, d);
  return e.map((value, k) => 2 * (e0 * d[k] - d0 * value + turn[k]));
}

// The centres of each wheel at a frame; null while its body rests. Each has the `contact`, the
// `velocity` of the carrier there and a place and direction of the instant `axis`; where they
// exist, the `instant` centre of the front and of the `side` view, the `center` where the line from
// contact to instant centre meets the vehicle's centre plane, and the `kingpin` on the road.
function centresOf(drawing, motion, frame) {
  if (motion.frames < 3) return [];
  const found = drawing.wheels.map((wheel, k) => wheelCentres(drawing, motion, wheel, k, frame));
  const [one, other] = found;
  if (found.length === 2 && one && other && one.center && other.center) meet(one, other);
  return found;
}

function wheelCentres(drawing, motion, [b, center, spin, up, , ends, middle], k, frame) {
  const { p } = drawing.bodies[b];
  if (p.length < 3) return null;
  const frames = p.map((_, each) => each);
  const places = frames.map((each) => motion.placed(b, center, each));
  const mine = frames.map((each) =>
    motion.places[each].filter((_, node) => drawing.nodes[node][0] === b),
  );
  const step = (each) =>
    Math.max(...mine[each].map((at, j) => Math.hypot(...sum(at, mine[each - 1][j], -1))));
  const way = [0];
  for (let each = 1; each < p.length; each++) way.push(way.at(-1) + step(each));
  if (way.some((value, each) => each && value - way[each - 1] < 1e-9)) return null;
  const signed = [p[0]]; // both signs are one attitude
  for (const each of p.slice(1)) {
    const sign = each.reduce((total, value, i) => total + value * signed.at(-1)[i], 0) < 0 ? -1 : 1;
    signed.push(each.map((value) => sign * value));
  }
  const omega = angularVelocity(signed[frame], slopes(signed, way, frame));
  const speed = slopes(places, way, frame);
  const { contact } = motion.wheels[frame][k];
  const velocity = sum(speed, cross(omega, sum(contact, places[frame], -1)));
  const square = dot(omega, omega);
  const axis = square > 1e-6 && {
    place: sum(places[frame], cross(omega, speed), 1 / square),
    along: direction(omega),
  };
  const out = lateral(motion.rotated(b, spin, frame), up);
  const ahead = cross(out, up);
  const at = { contact, velocity, axis, up, out };
  at.instant = planeCentre(contact, velocity, omega, out, up);
  at.side = planeCentre(contact, velocity, omega, ahead, up);
  if (middle.length && Math.abs(dot(velocity, up)) > 1e-6) {
    const far = dot(sum(contact, middle, -1), out) / dot(velocity, up);
    at.center = sum(sum(contact, out, -far * dot(velocity, up)), up, far * dot(velocity, out));
  }
  if (ends.length) {
    const [low, high] = ends.map((node) => motion.places[frame][node]);
    const rise = dot(sum(high, low, -1), up);
    const share = dot(sum(contact, low, -1), up) / rise;
    if (Math.abs(rise) > 1e-6) {
      at.kingpin = { high, road: sum(low, sum(high, low, -1), share), ahead };
    }
  }
  return at;
}

// The global axis beside an upward direction that is nearest to the axis of rotation.
function lateral(spin, up) {
  const level = sum(spin, up, -dot(up, spin));
  const far = level.map(Math.abs);
  const most = far.indexOf(Math.max(...far));
  return unit(most).map((value) => value * Math.sign(level[most]));
}

// The place in the plane of two directions through a point that has no velocity in this plane;
// null if the body does not turn there.
function planeCentre(point, velocity, omega, along, up) {
  const turn = dot(omega, cross(along, up));
  if (Math.abs(turn) < 1e-6) return null;
  const aside = -dot(velocity, up) / turn;
  return sum(sum(point, along, aside), up, dot(velocity, along) / turn);
}

// Put the centre of two wheels where the lines to their instant centres cross; leave out parallel
// lines. A place P of a line satisfies v . P = v . contact.
function meet(one, other) {
  const { out, up } = one;
  const row = ({ velocity, contact }) => {
    const [y, z] = [dot(velocity, out), dot(velocity, up)];
    return [y, z, y * dot(contact, out) + z * dot(contact, up)];
  };
  const [[a, b, c], [d, e, f]] = [row(one), row(other)];
  const whole = a * e - b * d;
  const known = Math.abs(whole) > 1e-6 * Math.hypot(a, b) * Math.hypot(d, e);
  const [y, z] = [(c * e - b * f) / whole, (a * f - c * d) / whole];
  const ahead = cross(out, up);
  const middle = dot(sum(one.contact, other.contact), ahead) / 2;
  const level = ahead.map((value, k) => value * middle + out[k] * y + up[k] * z);
  one.center = other.center = known ? level : null;
}

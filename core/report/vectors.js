"use strict";
// Vectors in space, and outlines of points.

const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
const sum = (a, b, factor = 1) => a.map((value, k) => value + factor * b[k]);
const direction = (a) => a.map((value) => value / Math.hypot(...a));

const unit = (k) => [0, 1, 2].map((each) => Number(each === k));

function cross(u, v) {
  return [u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0]];
}

// A vector of a body with the Euler parameters p, in global axes:
// a + 2 e0 (e x a) + 2 e x (e x a).
function turned([e0, ...e], a) {
  const once = cross(e, a);
  const twice = cross(e, once);
  return a.map((value, k) => value + 2 * (e0 * once[k] + twice[k]));
}

// The least and the largest value of points along each axis.
function extent(points) {
  const wider = ([low, high], value) => [Math.min(low, value), Math.max(high, value)];
  return [0, 1, 2].map((k) =>
    points.reduce((ends, at) => wider(ends, at[k]), [Infinity, -Infinity]),
  );
}

// The diagonal of the box around points; 1 if they coincide.
function span(points) {
  return Math.hypot(...extent(points).map(([low, high]) => high - low)) || 1;
}

// The outline of points on the screen, for the skin of a body (Andrew's monotone chain).
function outline(points) {
  const sorted = points.slice().sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const isLeft = (a, b, c) => (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]) > 0;
  const half = (some) => {
    const kept = [];
    for (const c of some) {
      while (kept.length > 1 && !isLeft(kept.at(-2), kept.at(-1), c)) kept.pop();
      kept.push(c);
    }
    return kept.slice(0, -1);
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

// A wheel about its axis of rotation, and the road below it: a rectangle through the contact.
function wheelShape(center, spin, up, radius) {
  const rise = direction(sum(up, spin, -dot(up, spin)));
  const heading = direction(cross(spin, rise));
  const aside = cross(up, heading);
  const contact = sum(center, rise, -radius);
  const corner = (along, across) =>
    sum(sum(contact, heading, along * radius), aside, across * radius);
  const tyre = Array.from({ length: 24 }, (_, k) => {
    const angle = (k * Math.PI) / 12;
    return sum(sum(center, heading, radius * Math.cos(angle)), rise, radius * Math.sin(angle));
  });
  return {
    center,
    spin,
    radius,
    contact,
    tyre,
    axis: [sum(center, spin, -0.5 * radius), sum(center, spin, 0.5 * radius)],
    road: [corner(-1.4, -0.8), corner(1.4, -0.8), corner(1.4, 0.8), corner(-1.4, 0.8)],
  };
}

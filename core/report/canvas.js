"use strict";
// A canvas: the projection onto it, and functions to draw lines and text.

// The drawing context of an empty canvas at the screen's resolution.
function cleared(canvas, width, height) {
  const pen = canvas.getContext("2d");
  const ratio = window.devicePixelRatio || 1;
  const [wide, high] = [Math.round(width * ratio), Math.round(height * ratio)];
  if (canvas.width !== wide) canvas.width = wide;
  if (canvas.height !== high) canvas.height = high;
  pen.setTransform(ratio, 0, 0, ratio, 0, 0);
  pen.clearRect(0, 0, width, height);
  return pen;
}

// The projection along a viewing direction, enlarged and moved.
// Returns `seen`, the place of a point on the canvas and towards the eye [px], `turn`, the same for
// a vector, and `scale` [px/m].
function cameraOf({ azimuth, elevation, zoom, pan = [0, 0] }, bounds, width, height) {
  const [ca, sa] = [Math.cos(azimuth), Math.sin(azimuth)];
  const [ce, se] = [Math.cos(elevation), Math.sin(elevation)];
  const right = [-sa, ca, 0];
  const up = [-se * ca, -se * sa, ce];
  const near = [ce * ca, ce * sa, se];
  const reach = (axis) => Math.max(bounds.reach(axis), 0.05 * bounds.size);
  const margin = Math.min(60, 0.1 * width); // for names
  const fit = Math.min((width / 2 - margin) / reach(right), (height / 2 - 34) / reach(up));
  const scale = zoom * fit;
  const turn = (vector) => [
    scale * dot(right, vector),
    -scale * dot(up, vector),
    scale * dot(near, vector),
  ];
  const origin = [width / 2 + pan[0], height / 2 + pan[1], 0];
  const seen = (at) => sum(origin, turn(sum(at, bounds.middle, -1)));
  return { seen, turn, scale };
}

// Functions that draw lines and shapes through points on the canvas.
function brush(pen) {
  const line = (points, stroke, thick, dash = [], alpha = 1) => {
    pen.beginPath();
    points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    const round = { lineCap: "round", lineJoin: "round" };
    Object.assign(pen, { strokeStyle: stroke, lineWidth: thick, globalAlpha: alpha, ...round });
    if (dash.length) pen.setLineDash(dash);
    pen.stroke();
    if (dash.length) pen.setLineDash([]);
    pen.globalAlpha = 1;
  };
  // edged: with an edge that closes the seam between two areas
  const area = (points, shade, alpha, edged = false) => {
    pen.beginPath();
    points.forEach(([x, y], k) => (k ? pen.lineTo(x, y) : pen.moveTo(x, y)));
    Object.assign(pen, { fillStyle: shade, globalAlpha: alpha });
    pen.fill();
    if (edged) {
      Object.assign(pen, { strokeStyle: shade, lineWidth: 0.8 });
      pen.stroke();
    }
    pen.globalAlpha = 1;
  };
  const disc = ([x, y], radius, fill, edge) => {
    pen.beginPath();
    pen.arc(x, y, radius, 0, 2 * Math.PI);
    Object.assign(pen, { fillStyle: fill, strokeStyle: edge, lineWidth: 1.2 });
    pen.fill();
    pen.stroke();
  };
  return { pen, line, area, disc };
}

// A function that writes text beside a place without overlap, or omits it without room. It returns
// whether the first of the offsets is free.
//   offsets: places to try: to the left (-1), over (0) or to the right (1), and down [px].
function writer(pen, width, height, family, halo) {
  const written = [];
  return ([x, y], text, fill, offsets, font = "") => {
    pen.font = `${font} 12px ${family}`;
    const wide = pen.measureText(text).width;
    const aside = (side) => (side < 0 ? -10 - wide : side ? 10 : -wide / 2);
    const isFree = ([left, top]) =>
      written.every(
        ([l, t, w]) => left > l + w + 3 || l > left + wide + 3 || Math.abs(top - t) > 13,
      );
    const isInside = ([left, top]) =>
      left >= 2 && left + wide <= width - 2 && top >= 0 && top <= height - 14;
    const corners = offsets.map(([side, down]) => [x + aside(side), y + down - 10]);
    const corner = corners.find((each) => isFree(each) && isInside(each));
    if (!corner) return false;
    const [left, top] = corner;
    written.push([left, top, wide]);
    Object.assign(pen, { strokeStyle: halo, fillStyle: fill, lineWidth: 3 });
    pen.strokeText(text, left, top + 10);
    pen.fillText(text, left, top + 10);
    return corner === corners[0];
  };
}

"use strict";
// Pictures of a canvas to save: SVG, PNG, and a film of the motion.

// A pen with the functions of a canvas's that the scene uses, which writes SVG.
function svgPen(width, height) {
  const whole = { xmlns: SVG, viewBox: `0 0 ${width} ${height}`, width, height };
  const svg = svgElement("svg", whole);
  let path = "";
  let dash = [];
  const add = (name, attributes, ...texts) => {
    const opacity = pen.globalAlpha < 1 ? pen.globalAlpha : "";
    svg.append(svgElement(name, { ...attributes, opacity }, ...texts));
  };
  const edge = () => ({
    fill: "none",
    stroke: pen.strokeStyle,
    "stroke-width": pen.lineWidth,
    "stroke-dasharray": dash.join(" "),
    "stroke-linecap": pen.lineCap,
    "stroke-linejoin": pen.lineJoin,
  });
  const text = (content, x, y, look) => {
    const at = { x: x.toFixed(1), y: y.toFixed(1), style: `font: ${pen.font}` };
    add("text", { ...at, ...look }, content);
  };
  const pen = {
    globalAlpha: 1,
    font: "",
    svg,
    beginPath: () => (path = ""),
    moveTo: (x, y) => (path += `M${pixels([x, y])}`),
    lineTo: (x, y) => (path += `${path ? "L" : "M"}${pixels([x, y])}`),
    arc(x, y, r) {
      const half = (sign) => `a${r} ${r} 0 1 0 ${sign * 2 * r} 0`;
      path += `M${pixels([x - r, y])}${half(1)}${half(-1)}Z`;
    },
    setLineDash: (given) => (dash = given),
    stroke: () => add("path", { d: path, ...edge() }),
    fill: () => add("path", { d: path, fill: pen.fillStyle }),
    fillRect: (x, y, wide, high) =>
      add("rect", { x, y, width: wide, height: high, fill: pen.fillStyle }),
    measureText(content) {
      ruler.font = pen.font;
      return ruler.measureText(content);
    },
    fillText: (content, x, y) => text(content, x, y, { fill: pen.fillStyle }),
    strokeText: (content, x, y) => text(content, x, y, edge()),
  };
  return pen;
}

// Save what a function draws, as a file of a kind.
//   draw: called with a pen, and with a frame for a film; size: width and height [px];
//   frames: those of the film, one after the other.
async function savePicture(kind, draw, [width, height], name, frames) {
  if (kind === "svg") {
    const pen = svgPen(width, height);
    draw(pen);
    return save(pen.svg.outerHTML, "image/svg+xml", `${name}.svg`);
  }
  const canvas = document.createElement("canvas");
  const pen = cleared(canvas, width, height);
  if (kind === "png") {
    draw(pen);
    const blob = await new Promise((done) => canvas.toBlob(done, "image/png"));
    return save(blob, "image/png", `${name}.png`);
  }
  if (!canvas.captureStream || !window.MediaRecorder) {
    throw new Error("This browser records no films; save a picture, or open the page in another.");
  }
  const recorder = new MediaRecorder(canvas.captureStream(), { videoBitsPerSecond: 4e6 });
  const parts = [];
  recorder.addEventListener("dataavailable", ({ data }) => parts.push(data));
  const ended = new Promise((done) => recorder.addEventListener("stop", done));
  draw(pen, frames[0]);
  recorder.start();
  for (const frame of frames) {
    draw(pen, frame);
    await new Promise((done) => setTimeout(done, FRAME_MS));
  }
  recorder.stop();
  await ended;
  const [, ending] = /video\/(\w+)/.exec(recorder.mimeType);
  save(new Blob(parts, { type: recorder.mimeType }), recorder.mimeType, `${name}.${ending}`);
}

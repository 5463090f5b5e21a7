"use strict";
// Elements of the page: those of SVG, with the lines, symbols and colours of Plotly's JSON, and the
// keys that act on them. The style sheet colours them: dark mode and print need no second set.

// The engines' colours; in the style sheet --s0, --s1, ...
const COLOURS = ["#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9"];
const DASHES = { solid: "", dot: "2,3", dash: "8,4" };
const SVG = "http://www.w3.org/2000/svg";

function svgElement(name, attributes, ...children) {
  const made = document.createElementNS(SVG, name);
  for (const [key, value] of Object.entries(attributes)) {
    if (value !== undefined && value !== "") made.setAttribute(key, value);
  }
  made.append(...children);
  return made;
}

const colour = (given) =>
  COLOURS.includes(given) ? `var(--s${COLOURS.indexOf(given)})` : given || "var(--axis)";

// The attributes of a line.
const stroke = ({ color, width, dash } = {}) => ({
  style: `stroke: ${colour(color)}`,
  "stroke-width": width,
  "stroke-dasharray": dash in DASHES ? DASHES[dash] : dash,
});

// A place as text for SVG [px].
const pixels = ([x, y]) => `${x.toFixed(1)} ${y.toFixed(1)}`;

// The outline of a symbol around 0, 0.
function symbol(name, r) {
  const plus = `M0 ${-r}V${r}M${-r} 0H${r}`;
  const x = `M${-r} ${-r}L${r} ${r}M${r} ${-r}L${-r} ${r}`;
  const paths = {
    square: `M${-r} ${-r}H${r}V${r}H${-r}Z`,
    diamond: `M0 ${-1.3 * r}L${1.3 * r} 0L0 ${1.3 * r}L${-1.3 * r} 0Z`,
    "triangle-up": `M0 ${-1.2 * r}L${1.2 * r} ${r}H${-1.2 * r}Z`,
    x,
    cross: plus,
    asterisk: plus + x,
    "line-ns": `M0 ${-r}V${r}`,
  };
  const circle = `M${-r} 0a${r} ${r} 0 1 0 ${2 * r} 0a${r} ${r} 0 1 0 ${-2 * r} 0Z`;
  return paths[name.replace("-open", "").replace("-thin", "")] || circle;
}

// Call the function under a key's name if that key alone is pressed on an element.
function listenToKeys(on, keys) {
  on.addEventListener("keydown", (event) => {
    if (!(event.key in keys) || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    event.stopPropagation();
    keys[event.key](event);
  });
}

// The figure of a box as an SVG file, with its colours on the screen.
function standalone(box) {
  const svg = box.querySelector("svg");
  const copy = svg.cloneNode(true);
  const originals = [...svg.querySelectorAll("*")];
  copy.setAttribute("xmlns", SVG);
  copy.querySelectorAll("*").forEach((each, k) => {
    const style = getComputedStyle(originals[k]);
    for (const name of ["stroke", "fill", "stroke-width", "font-size", "font-family"]) {
      each.style.setProperty(name, style.getPropertyValue(name));
    }
  });
  return copy.outerHTML;
}

// Hand a text or a blob to the user as a file.
function save(text, type, name) {
  const link = document.createElement("a");
  link.href = URL.createObjectURL(new Blob([text], { type }));
  link.download = name;
  link.click();
  URL.revokeObjectURL(link.href);
}

"use strict";
// The page: its packed data, the drawing of its figures, and the actions of its buttons.

const MARGIN = 600; // of the view, within which figures are drawn [px]
const PAPER = [340, 146]; // size of a figure on paper [px]

function trouble(text) {
  Object.assign(document.getElementById("trouble"), { textContent: text, hidden: false });
}

// The JSON or text that an element holds as base64 of its zlib stream.
async function unpacked(id) {
  const text = atob(document.getElementById(id).textContent);
  const bytes = Uint8Array.from(text, (sign) => sign.charCodeAt(0));
  const stream = new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"));
  return new Response(stream).text();
}

function onClick(selector, act) {
  for (const button of document.querySelectorAll(selector)) {
    button.addEventListener("click", () => act(button));
  }
}

(async () => {
  const sections = [...document.querySelectorAll("[data-case]")];
  const hidden = new Map(sections.map((section) => [section, new Set()]));
  const plots = [...document.querySelectorAll(".plot")];
  const drawn = new Map();
  overview();
  if (!window.DecompressionStream) {
    const needed = "Figures and mechanisms need a browser of 2023 or later";
    return trouble(`${needed}; all tables are here without it.`);
  }
  const { drivers, figures, scenes } = JSON.parse(await unpacked("report-data"));
  onClick("[data-curves]", async ({ dataset }) => {
    save(JSON.parse(await unpacked("curves"))[dataset.curves], "text/csv", dataset.file);
  });
  const boxes = [...document.querySelectorAll("[data-scene]")];
  const canvases = boxes.map((box) => {
    const name = box.closest("[data-case]").dataset.case;
    return mechanism(box, scenes[box.dataset.scene], `${name}_scene`, trouble);
  });

  function draw(box) {
    if (drawn.has(box)) return;
    const section = box.closest("[data-case]");
    const { data, layout } = figures[box.dataset.figure];
    // "driver" stands for the driver's values
    const values = (given) => (given === "driver" ? drivers[section.dataset.case] : given);
    const whole = data.map((trace) => ({ ...trace, x: values(trace.x), y: values(trace.y) }));
    try {
      drawn.set(box, plot(box, { data: whole, layout }));
    } catch (error) {
      return trouble(`Figure ${box.dataset.figure} cannot be drawn: ${error.message}.`);
    }
    hidden.get(section).forEach((series) => drawn.get(box).show(series, false));
    box.dataset.drawn = "";
  }

  // Figures in or near view are drawn, so that a report of many cases opens as fast as one of few:
  // at once and when something unfolds; the observer, which a busy browser calls late, when the
  // page scrolls.
  const isFolded = (box) => box.closest("details:not([open])");
  const isNear = (box) => {
    const { top, bottom, height } = box.getBoundingClientRect();
    return height > 0 && bottom > -MARGIN && top < innerHeight + MARGIN && !isFolded(box);
  };
  const drawNear = () => plots.filter(isNear).forEach(draw);
  drawNear();
  document.addEventListener("toggle", drawNear, true);
  const reached = (seen) => {
    for (const { isIntersecting, target } of seen) if (isIntersecting) draw(target);
  };
  const watch = new IntersectionObserver(reached, { rootMargin: `${MARGIN}px` });
  plots.forEach((box) => watch.observe(box));

  const plotOf = (button) => button.closest("figure").querySelector(".plot");
  onClick("[data-save]", (button) => {
    save(standalone(plotOf(button)), "image/svg+xml", `${button.dataset.save}.svg`);
  });
  onClick("[data-reset]", (button) => drawn.get(plotOf(button)).reset());
  onClick("[data-series][aria-pressed]", (button) => {
    const section = button.closest("[data-case]");
    const series = button.dataset.series;
    const show = hidden.get(section).delete(series);
    if (!show) hidden.get(section).add(series);
    press(button, show);
    for (const box of section.querySelectorAll(".plot[data-drawn]")) {
      drawn.get(box).show(series, show);
    }
  });

  // Paper is light and narrower than the screen, and sends no resize event. Hidden cases
  // stay hidden.
  window.addEventListener("beforeprint", () => {
    document.documentElement.dataset.paper = "";
    for (const rest of document.querySelectorAll(".problems details")) rest.open = true;
    canvases.forEach(({ draw }) => draw());
    for (const box of plots.filter((each) => !isFolded(each) && !each.closest("[hidden]"))) {
      draw(box);
      if (drawn.has(box)) drawn.get(box).fit(...PAPER);
    }
  });
  window.addEventListener("afterprint", () => {
    delete document.documentElement.dataset.paper;
    canvases.forEach(({ draw }) => draw());
    drawn.forEach((figure) => figure.fit());
  });
  document.documentElement.dataset.ready = "";
})();

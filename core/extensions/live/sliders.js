"use strict";
// A slider for each driver of a mechanism, with its reach and the distance from singular poses.

const TICKS = 2000;

// The sliders in a box.
//   moved: called with the values of all drivers, and whether the gesture rests; refuse: with the
//   message about what is no number; sweep: called to show the sweep of the file; distance:
//   whether poses tell theirs.
// Returns `show` (a pose) and `reach` (the travel of a driver).
function sliders(box, drivers, { moved, refuse, sweep, distance: isTold }) {
  const values = Object.fromEntries(drivers.map(({ name, design }) => [name, design]));
  const degrees = 180 / Math.PI;
  const scaleOf = ({ unit }) => (unit === "rad" ? degrees : 1000);
  const unitName = ({ unit }) => (unit === "rad" ? "°" : "mm");
  let resting = 0;

  function move(name, value) {
    values[name] = value;
    moved({ ...values }, false);
    clearTimeout(resting);
    resting = setTimeout(() => moved({ ...values }, true), 250);
  }
  const rows = drivers.map((driver) => {
    const { name, low, high } = driver;
    const scale = scaleOf(driver);
    const make = (kind, more) => Object.assign(document.createElement(kind), more);
    const slider = make("input", { type: "range", min: 0, max: TICKS, step: 1 });
    const number = make("input", { type: "text", inputMode: "decimal", autocomplete: "off" });
    slider.setAttribute("aria-label", `${name} [${unitName(driver)}]`);
    number.setAttribute("aria-label", `value of ${name} [${unitName(driver)}]`);
    const place = (value) => Math.round(((value - low) / (high - low)) * TICKS);
    slider.addEventListener("input", () => {
      const value = low + ((high - low) * Number(slider.value)) / TICKS;
      number.value = shown(scale * value, ".5g");
      move(name, value);
    });
    number.addEventListener("change", () => {
      const value = typed(number.value) / scale;
      if (!Number.isFinite(value)) {
        const unit = unitName(driver);
        refuse(`${name}: found “${number.value}”, expected a number of ${unit}, without unit`);
        return set(values[name]);
      }
      slider.value = place(value);
      move(name, value);
    });
    const set = (value) => {
      slider.value = place(value);
      number.value = shown(scale * value, ".5g");
    };
    set(values[name]);
    const note = make("small", { className: "quiet" });
    const travel = make("div", { className: "travel", hidden: true });
    const row = make("div", { className: "slider" });
    const label = make("span", { textContent: name });
    const unit = make("span", { textContent: unitName(driver) });
    row.append(label, slider, number, unit, travel, note);
    return { driver, row, travel, set, note, place };
  });
  const button = (textContent, act) => {
    const made = Object.assign(document.createElement("button"), { type: "button", textContent });
    made.addEventListener("click", act);
    return made;
  };
  const home = button("design position", () => {
    rows.forEach(({ driver, set }) => {
      values[driver.name] = driver.design;
      set(driver.design);
    });
    moved({ ...values }, true);
  });
  const meter = document.createElement("meter");
  Object.assign(meter, { min: 0, max: 1, low: 0.05, high: 0.2, optimum: 1, value: 1 });
  meter.setAttribute("aria-label", "distance from singular poses, against that at design");
  const distance = Object.assign(document.createElement("span"), { className: "quiet" });
  const last = document.createElement("div");
  last.className = "row";
  const file = button("sweep of the file", sweep);
  last.append(home, file);
  if (isTold) last.append("distance from singular poses ", meter, distance);
  box.replaceChildren(...rows.map(({ row }) => row), last);

  return {
    show(pose) {
      if (pose.distance !== null) {
        meter.value = Math.min(1, pose.distance);
        distance.textContent = `${shown(pose.distance, ".3g")} of that at design`;
      }
    },
    reach({ driver: name, low, high, messages }) {
      const found = rows.find(({ driver }) => driver.name === name);
      const { driver, travel, note, place } = found;
      const [from, to] = [low, high].map((value) => (100 * place(value)) / TICKS);
      travel.hidden = false;
      travel.style.setProperty("--from", `${from}%`);
      travel.style.setProperty("--to", `${to}%`);
      const text = [low, high].map((value) => shown(scaleOf(driver) * value, ".4g")).join(" to ");
      note.textContent = messages.some(Boolean)
        ? `reaches ${text} ${unitName(driver)} if the others rest`
        : "";
      note.title = messages.filter(Boolean).join("\n");
    },
  };
}

"use strict";
// The live page: the page owns the design, and a server, or its own solver, answers for numbers.

const METRES = { mm: 0.001, cm: 0.01, m: 1, inch: 0.0254, in: 0.0254, foot: 0.3048, ft: 0.3048 };
const DIRECTIONS = {
  forward: [0, 1],
  rearward: [0, -1],
  left: [1, 1],
  right: [1, -1],
  up: [2, 1],
  down: [2, -1],
};

// A text of this tab, or a new one; a frame in another page may have no memory.
function remembered(key, text) {
  try {
    if (text === undefined) return sessionStorage.getItem(key);
    sessionStorage.setItem(key, text);
  } catch {
    return null;
  }
}

(() => {
  const one = (selector) => document.querySelector(selector);
  const state = { answer: null, ghost: null, limits: new Map(), upwards: 0, latest: 0, times: [] };
  let opening = null;
  let edited = false;
  let parts = null;
  let asked = 0;
  window.kincheckLive = state; // for scripts and tests

  const say = (text) => (one("#state").textContent = text);
  function trouble(text, where = "#trouble") {
    one(where).textContent = text;
    one(where).hidden = !text;
  }
  const link = linkTo({
    opening: (message) => open(message),
    answer: (message) => answered(message),
    pose: (message) => posed(message),
    reached: (message) => reached(message),
    refused(message) {
      trouble(message.message);
      if (parts.table) parts.table.mark(message.point);
      document.body.classList.add("stale");
      say("not assembled: curves and scene are those of the last design that was");
      state.latest += 1;
    },
    ranking: (message) => ranked(message),
    proposal: (message) => parts.tuning.told(message),
    spread: (message) => spread(message),
    verdict: (message) => verdict(message),
    exported: (message) => exported(message),
    saved: (message) => say(`saved as ${message.name}`),
    invalid(message) {
      trouble(message.message);
      if (parts.tuning) parts.tuning.refused();
    },
    changed: (message) => trouble(message.message, "#changed"),
    lost: () => say("connection lost; start kincheck serve again: your numbers stay here"),
  });

  state.isDue = () => link.isDue("solve") || link.isDue("move");

  function open(message) {
    opening = message;
    document.title = `${message.file} · kincheck live`;
    one("#file").textContent = message.file;
    for (const each of document.querySelectorAll("[data-kind]")) {
      each.hidden = each.dataset.kind !== message.kind;
    }
    const isAlone = !message.engines.length; // a saved page
    for (const each of document.querySelectorAll("[data-engines]")) each.hidden = isAlone;
    one("#alone").hidden = !isAlone;
    const groups = [...new Set(message.outputs.map(({ group }) => group))];
    one("#group").replaceChildren(...groups.map((name) => new Option(name, name)));
    one("#engines").replaceChildren(...message.engines.map(engineBox));
    state.upwards = message.axis.up;
    state.reference = message.reference;
    for (const { name, scale } of message.outputs) {
      const ends = message.limits[name];
      if (ends) state.limits.set(name, ends.map((end) => (end === null ? NaN : end * scale)));
    }
    parts = { first: true };
    if (message.kind === "table") openTable();
    else openModel();
  }

  function engineBox(name) {
    const label = document.createElement("label");
    const box = Object.assign(document.createElement("input"), { type: "checkbox", value: name });
    box.checked = name === "native" || name === "mujoco";
    label.append(box, ` ${name}`);
    return label;
  }

  function openTable() {
    const { points, unit, axes } = opening;
    const places = axes.split(",").map((word) => DIRECTIONS[word]);
    const size = METRES[unit];
    const view = {
      step: 1e-4 / size,
      metres(row) {
        const at = [0, 0, 0];
        places.forEach(([axis, sign], i) => (at[axis] = sign * size * row[i]));
        return at;
      },
      file: (at) => places.map(([axis, sign]) => (sign * at[axis]) / size),
    };
    const across = places.findIndex(([axis]) => axis === 1);
    const design = designOf(points, across, solve);
    const choose = (k) => {
      parts.planes.choose(k);
      parts.table.chosen(k);
    };
    parts.design = design;
    state.rows = () => design.rows();
    state.spots = (plane) => parts.planes.spots(plane);
    parts.planes = planes(one("#planes"), points, view, design, choose);
    one("#points caption").textContent =
      `${unit}; x, y, z are ${axes.replaceAll(",", ", ")}.` +
      " Arrow keys: 1, with Shift 10, with Alt 0.1.";
    const refuse = (text) => link.tell({ type: "read", ...text });
    parts.table = pointTable(one("#points"), points, unit, design, { choose, refuse });
    one("#name").value = opening.save;
    one("#ranked").replaceChildren(
      ...opening.outputs
        .filter(({ group }) => group !== "coordinates")
        .map(({ label, name }) => new Option(label, name)),
    );
    one("#ranked").onchange = rank;
    if (opening.tunable) openTuning(METRES[unit]);
    one("#undo").onclick = () => design.undo();
    one("#redo").onclick = () => design.redo();
    one("#reset").onclick = () => design.all(design.start);
    one("#ghost").onclick = () => {
      state.ghost = state.answer;
      parts.planes.ghost(state.ghost.drawing);
      parts.figures.draw();
    };
    one("#saving").onsubmit = (event) => {
      event.preventDefault();
      trouble("");
      link.tell({ type: "save", points: design.rows(), name: one("#name").value });
    };
    addEventListener("keydown", (event) => {
      if (!(event.ctrlKey || event.metaKey) || event.key.toLowerCase() !== "z") return;
      if (event.target.id === "name") return;
      event.preventDefault();
      if (event.shiftKey) design.redo();
      else design.undo();
    });
    parts.table.show();
    if (!kept()) solve();
  }
  function openTuning(metres) {
    let before = null;
    const ask = (wanted) =>
      link.tell({ type: "propose", points: parts.design.rows(), ...wanted });
    function show(proposal) {
      before = proposal ? state.ghost : before;
      state.ghost = proposal || before;
      parts.planes.ghost(state.ghost.drawing);
      parts.figures.draw(true);
    }
    function take(rows) {
      const old = parts.design.rows().map((row) => row.slice());
      parts.design.begin();
      rows.forEach((row, k) => {
        if (row.some((value, i) => value !== old[k][i])) parts.design.set(k, row);
      });
    }
    const told = { ask, show, take };
    parts.tuning = tuning(
      one("#tuning"),
      one("#points"),
      { ...opening, metres },
      parts.design,
      state,
      told,
    );
  }
  // The numbers before the page was loaded again, if the file is the same; undone by one step.
  const numbers = () => `kincheck ${opening.source} ${JSON.stringify(opening.points)}`;
  function kept() {
    const rows = JSON.parse(remembered(numbers()) || "null");
    if (rows) parts.design.all(rows);
    return rows;
  }

  function openModel() {
    Object.assign(one("#scene").dataset, { forces: "", off: "names frames forces" });
    const moved = (drivers, rests) => {
      state.asked = performance.now();
      link.ask("move", { type: "move", drivers, measured: rests });
    };
    const sweep = () => {
      const { drawing } = state.answer;
      parts.scene.change(drawing, motionOf(drawing));
      say(`${state.answer.solved.length} samples`);
    };
    const distance = opening.engines.length > 0;
    const does = { moved, sweep, refuse: trouble, distance };
    parts.sliders = sliders(one("#sliders"), opening.drivers, does);
    state.asked = performance.now();
    link.ask("solve", { type: "solve", points: [] });
  }

  // Ask for the reach of one driver after the other.
  function reached(message) {
    if (message) parts.sliders.reach(message);
    const next = opening.drivers[asked];
    asked += 1;
    if (next) link.tell({ type: "reach", driver: next.name });
  }

  function solve() {
    const [undo, redo] = parts.design.can();
    one("#undo").disabled = !undo;
    one("#redo").disabled = !redo;
    one("#verdicts tbody").replaceChildren();
    edited = true;
    parts.whole = false;
    remembered(numbers(), JSON.stringify(parts.design.rows()));
    trouble("");
    parts.table.show();
    parts.planes.await();
    ask(false);
  }
  // Ask for the motion: at once for what one solution gives, and for the rest when a gesture rests.
  function ask(whole) {
    state.asked = performance.now();
    link.ask("solve", { type: "solve", points: parts.design.rows(), whole });
  }

  function answered(message) {
    state.fresh = new Set(Object.keys(message.outputs));
    const before = state.answer ? state.answer.outputs : {};
    state.answer = { ...message, outputs: { ...before, ...message.outputs } };
    state.ghost = state.ghost || state.answer;
    document.body.classList.remove("stale");
    // the reason is looked for when the gesture rests
    trouble(parts.whole === false ? "" : message.message);
    if (parts.table) parts.table.mark("");
    if (!message.drawing.bodies.length) return;
    if (parts.first) start(message);
    else {
      const motion = motionOf(message.drawing);
      parts.scene.change(message.drawing, motion);
      parts.figures.draw();
      if (parts.planes) parts.planes.change(message.drawing, motion);
    }
    parts.numbers.show();
    markUnreached(message);
    const lost = message.solved.filter((each) => !each).length;
    const count = message.solved.length;
    say(lost ? `${count - lost} of ${count} samples reached` : `${count} samples`);
    measure(message.milliseconds);
    clearTimeout(parts.settling);
    if (parts.design) parts.settling = setTimeout(settled, 250);
  }
  // What the sweep does not reach, below the scene.
  function markUnreached({ solved }) {
    const { title, values, scale } = opening.axis;
    const ends = unreached(solved, values.map((value) => value * scale));
    const text = ends.map((range) => range.map((value) => shown(value, ".4g")).join(" to "));
    one("#unreached").textContent = `${title} is not reached: ${text.join(", ")}`;
    one("#unreached").hidden = !text.length;
  }
  function settled() {
    if (link.isDue("solve")) return;
    parts.figures.draw(true);
    if (!state.answer.solved.every(Boolean) && !parts.whole) {
      parts.whole = true;
      return ask(true);
    }
    rank();
  }

  function start(message) {
    parts.first = false;
    const { outputs, axis } = opening;
    const stem = opening.file.replace(/\.[^.]*$/, "");
    parts.scene = mechanism(one("#scene"), message.drawing, `${stem}_scene`, trouble);
    if (parts.planes) {
      parts.planes.change(message.drawing, motionOf(message.drawing));
      parts.planes.ghost(message.drawing);
    }
    parts.figures = figures(one("#figures"), outputs, axis, state);
    parts.numbers = keyNumbers(one("#numbers"), outputs, columns(), state);
    state.limited = () => {
      parts.figures.draw(true);
      parts.numbers.show();
      if (parts.tuning) parts.tuning.goals();
    };
    parts.figures.group(one("#group").value);
    one("#group").onchange = () => parts.figures.group(one("#group").value);
    document.documentElement.dataset.ready = "";
    const count = Number(new URLSearchParams(location.search).get("measure"));
    if (count && parts.design) measureEdits(count);
    if (parts.sliders && message.solved.some(Boolean)) reached(null);
  }

  // The words of the key samples.
  function words() {
    return state.upwards ? ["rebound", "design", "jounce"] : ["first", "design", "last"];
  }

  // The poses of the key numbers: the key samples, or the pose of the sliders.
  function columns() {
    const sizes = opening.axis.values.map(Math.abs);
    const design = sizes.indexOf(Math.min(...sizes));
    const solved = (from) => Math.max(0, state.answer.solved[from](true));
    const at = (find) => (name) => (state.answer.outputs[name] || [])[find()];
    const ofPose = (name) => (state.pose ? state.pose[name] : at(() => design)(name));
    if (!parts.planes) return [{ word: "pose", valueOf: ofPose }];
    const samples = [() => solved("indexOf"), () => design, () => solved("lastIndexOf")];
    return words().map((word, k) => ({ word, valueOf: at(samples[k]) }));
  }

  // The time from an edit to its picture.
  function measure(steps) {
    requestAnimationFrame(() => {
      state.latest += 1;
      const whole = performance.now() - state.asked;
      state.times.push(whole);
      const answer = Object.values(steps).reduce((total, each) => total + each, 0);
      const text = `answer ${answer.toFixed(0)} ms, edit to screen ${whole.toFixed(0)} ms`;
      one("#cost").textContent = text;
    });
  }

  // Make edits one after the other, tell the server their times, and end.
  async function measureEdits(count) {
    const pause = (wait) => new Promise((done) => setTimeout(done, wait));
    async function edited(change) {
      while (link.isDue("solve")) await pause(20);
      const before = state.latest;
      change();
      while (state.latest === before) await pause(1);
      return state.times.at(-1);
    }
    await pause(1000); // what follows an opening is over
    const { design } = parts;
    const by = 1e-4 / METRES[opening.unit];
    const milliseconds = [];
    for (let k = 0; k < count; k++) {
      const at = k % opening.points.length;
      const moved = design.rows()[at].map((value) => value + by);
      milliseconds.push(await edited(() => design.set(at, moved)));
      await edited(() => design.all(design.start));
    }
    link.tell({ type: "measured", milliseconds });
  }

  function rank() {
    if (!one("#ranked").value || link.isDue("solve")) return;
    const wanted = { points: parts.design.rows(), output: one("#ranked").value };
    link.ask("rank", { type: "rank", ...wanted });
    if (opening.varied) link.ask("vary", { type: "vary", ...wanted });
  }
  function spread(message) {
    const output = opening.outputs.find(({ name }) => name === message.output);
    one("#spread").hidden = false;
    showSpread(one("#spread"), message, output, words(), state.limits.get(output.name));
  }
  function ranked(message) {
    const output = opening.outputs.find(({ name }) => name === message.output);
    const unit = { name: opening.unit, metres: METRES[opening.unit] };
    showRanking(one("#ranking"), { ...message, output: output.label }, output, unit, words());
  }

  function posed(message) {
    if (!parts.scene) return; // the sweep is still being solved
    const { drawing } = state.answer;
    state.pose = { ...state.pose, ...message.outputs };
    state.fresh = new Set(Object.keys(message.outputs));
    const bodies = drawing.bodies.map((body) => {
      const pose = message.bodies[body.name];
      return pose ? { ...body, r: [pose.slice(0, 3)], p: [pose.slice(3)] } : body;
    });
    const whole = message.share === 1;
    const far = `${shown(100 * message.share, ".3g")} % of the way`;
    const steps = [whole ? "pose of the sliders" : `the way ends at ${far}`];
    const { labels, nodes } = drawing;
    const arrows = labels.flatMap(([, node, text]) =>
      text
        .split(" · ")
        .filter((name) => message.reactions[name])
        .map((name) => [nodes[node][0], nodes[node].slice(1), name, [message.reactions[name]]]),
    );
    parts.scene.change({ ...drawing, bodies, steps, start: 0, paths: [], arrows });
    parts.sliders.show(message);
    parts.numbers.show();
    trouble(message.message);
    say(whole ? "all loops closed" : `not reached: ${far}`);
    measure(message.milliseconds);
  }

  const ticked = () =>
    [...document.querySelectorAll("#engines input:checked")].map(({ value }) => value);
  const rows = () => (parts.design ? { points: parts.design.rows() } : {});
  one("#check").onclick = () => {
    const engines = ticked();
    if (!engines.length) return trouble("check: tick an engine");
    one("#verdicts tbody").replaceChildren();
    edited = false;
    say("the engines are solving");
    link.tell({ type: "check", engines, ...rows() });
  };
  function verdict({ engine, outcome, worst, output, message, last }) {
    if (edited) return; // it is of numbers that are no more
    const row = document.createElement("tr");
    const cell = (kind, textContent, className = "") =>
      Object.assign(document.createElement(kind), { textContent, className });
    const far = worst === null ? "" : `${shown(worst, ".3g")} × tolerance (${output})`;
    row.append(
      Object.assign(cell("th", engine), { scope: "row" }),
      cell("td", outcome, `outcome ${outcome}`),
      cell("td", [far, message].filter(Boolean).join("; ")),
    );
    one("#verdicts tbody").append(row);
    if (last) say("checked");
  }

  for (const button of document.querySelectorAll("[data-export]")) {
    button.onclick = () => {
      const kind = button.dataset.export;
      say("the engines are solving");
      // curves are those of the native engine; a report compares the ticked ones
      const engines = kind === "report" ? ticked() : [];
      const named = engines.length ? engines : ["native"];
      link.tell({ type: "export", kind, engines: named, ...rows() });
    };
  }
  function exported({ name, content }) {
    const bytes = Uint8Array.from(atob(content), (sign) => sign.charCodeAt(0));
    save(bytes, "application/octet-stream", name);
    say(`${name} is in the folder of your downloads`);
  }
})();

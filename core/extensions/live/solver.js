"use strict";
// The solver of a saved page as the one who answers. `solver` has the compiled case, `SAVED` what
// else the server would know.

const MOST_FRAMES = 41; // as many samples as a hand can tell apart on the slider
const SMALL_MOVE = 1e-5; // of differences [m]: their error is far below three digits

function answererOf(hear) {
  const { opening, coordinates, metres, poses, changes } = SAVED;
  const driver = opening.axis.values;
  const start = opening.points.map(({ position }) => position);
  const far = driver.map((value) => Math.abs(value - solver.DESIGN));
  const design = far.indexOf(Math.min(...far));
  const outwards = driver.map((_, k) => k).sort((j, k) => far[j] - far[k]);
  const sides = [true, false].map((up) =>
    outwards.filter((k) => driver[k] >= solver.DESIGN === up),
  );
  const mechanism = new solver.Mechanism();
  const other = new solver.Mechanism(); // of derivatives, whose answer may wait
  const out = new Float64Array(3 * mechanism.outputs());
  let newest = 0;

  const movesOf = (points) =>
    coordinates.map(([k, axis]) => (points[k][axis] - start[k][axis]) * metres);

  // Put a mechanism at the design position of a geometry; return whether it closes there.
  function stand(who, moves) {
    moves.forEach((by, k) => (who.values[k] = who.nominal(k) + by));
    who.stand();
    return who.values[who.parameters()] > 0;
  }
  // Follow the travel outwards, both ways, and visit each sample that is reached.
  function follow(who, halvings, samples, visit) {
    const stands = who.lanes[0].slice();
    for (const side of samples) {
      who.lanes[0].set(stands);
      for (const k of side) {
        if (who.move(driver[k], 1, out, halvings)) break;
        visit(k);
      }
    }
  }

  function motion(points, whole) {
    const moves = movesOf(points);
    if (!stand(mechanism, moves)) return null;
    const solved = driver.map(() => false);
    const values = SAVED.outputs.map(() => driver.map(() => null));
    const bodies = driver.map(() => null);
    follow(mechanism, whole ? solver.HALVINGS : 0, sides, (k) => {
      solved[k] = true;
      values.forEach((series, j) => (series[k] = Number.isFinite(out[3 * j]) ? out[3 * j] : null));
      bodies[k] = poses.map(([, slots]) => slots.map((slot) => mechanism.lanes[0][slot]));
    });
    const outputs = Object.fromEntries(SAVED.outputs.map((name, j) => [name, values[j]]));
    return { moves, solved, outputs, bodies };
  }

  // The samples of rebound, design and jounce.
  const keys = (solved) => [solved.indexOf(true), design, solved.lastIndexOf(true)];
  function framesOf(solved) {
    const count = Math.min(MOST_FRAMES, solved.length);
    const evenly = Array.from({ length: count }, (_, k) =>
      Math.round((k * (solved.length - 1)) / Math.max(1, count - 1)),
    );
    const all = [...new Set([...evenly, ...keys(solved)])].sort((j, k) => j - k);
    return all.filter((k) => solved[k]);
  }
  // The scene of the nominal design, moved: places exactly, directions and radii to first order.
  function drawingOf({ moves, bodies }, frames) {
    const made = structuredClone(SAVED.drawing);
    for (const [path, slopes] of changes) {
      const last = path.at(-1);
      const at = path.slice(0, -1).reduce((part, key) => part[key], made);
      for (const [k, slope] of slopes) at[last] += slope * moves[k];
    }
    for (const mark of made.marks) if (mark[2]) mark[2] = direction(mark[2]);
    poses.forEach(([b], j) => {
      made.bodies[b].r = frames.map((k) => bodies[k][j].slice(0, 3));
      made.bodies[b].p = frames.map((k) => bodies[k][j].slice(3));
    });
    made.steps = frames.map((k) => SAVED.steps[k]);
    made.start = Math.max(0, frames.indexOf(design));
    return made;
  }

  function solve({ points, whole }) {
    const began = performance.now();
    newest += 1;
    const found = motion(points, whole);
    if (!found) {
      const message = "the mechanism does not close at the design position with these numbers";
      return { type: "refused", message, point: "" };
    }
    const { solved, outputs } = found;
    const solving = performance.now();
    const frames = framesOf(solved);
    const drawing = drawingOf(found, frames);
    const steps = { solve: solving - began, drawing: performance.now() - solving };
    const lost = solved.filter((each) => !each).length;
    const message = lost
      ? `${lost} samples are not reached: a lock-up, or another branch, lies before them`
      : "";
    const rest = { drawing, frames, message, milliseconds: steps };
    return { type: "answer", outputs, solved, ...rest };
  }

  // Derivatives of an output at the key samples, by differences, unless the numbers change.
  async function rank({ points, output }) {
    const asked = newest;
    const which = SAVED.outputs.indexOf(output);
    const found = motion(points, false);
    const samples = found ? keys(found.solved) : [];
    const ways = [samples.slice(1).reverse(), samples.slice(0, 1)].map((side) => side.reverse());
    const valuesAt = (moves) => {
      const values = samples.map(() => NaN);
      if (!stand(other, moves)) return values;
      follow(other, solver.HALVINGS, ways, (k) => (values[samples.indexOf(k)] = out[3 * which]));
      return values;
    };
    const effects = [];
    for (const [k, [point, axis]] of coordinates.entries()) {
      await new Promise((done) => setTimeout(done));
      if (asked !== newest) return { type: "ranking", output, samples, effects: [] };
      const [more, less] = [1, -1].map((sign) =>
        valuesAt(found.moves.map((by, j) => by + (j === k ? sign * SMALL_MOVE : 0))),
      );
      const slopes = more.map((value, j) => (value - less[j]) / (2 * SMALL_MOVE));
      const known = slopes.map((each) => (Number.isFinite(each) ? each : null));
      effects.push({ point: opening.points[point].name, axis: "xyz"[axis], slopes: known });
    }
    const size = ({ slopes }) => Math.max(...slopes.map(Math.abs));
    effects.sort((one, two) => size(two) - size(one));
    return { type: "ranking", output, samples, effects };
  }

  const quoted = (text) => (/[",\n]/.test(text) ? `"${text.replaceAll('"', '""')}"` : text);
  const lines = (rows) => rows.map((row) => `${row.join(",")}\n`).join("");

  function tableText(points) {
    const rows = opening.points.map(({ name }, k) => [quoted(name), ...points[k]]);
    return SAVED.head + lines(rows);
  }
  // The curves as `kincheck run --csv` writes them.
  function curvesText(points) {
    const found = motion(points, true);
    const columns = SAVED.columns.map(({ name, size, values }) => {
      const series = values || (found ? found.outputs[name] : driver.map(() => null));
      return series.map((value) => (value === null ? "" : value / size));
    });
    const rows = driver.map((_, k) => columns.map((column) => column[k]));
    return lines([SAVED.columns.map(({ head }) => quoted(head)), ...rows]);
  }

  const answers = {
    solve,
    rank,
    read: ({ point, axis, text }) => ({
      type: "invalid",
      message: `${point}: ${axis}: found '${text}', expected a coordinate`,
    }),
    save({ points, name }) {
      save(tableText(points), "text/csv", name);
      return { type: "saved", name };
    },
    export({ points }) {
      const bytes = new TextEncoder().encode(curvesText(points));
      const content = btoa(Array.from(bytes, (byte) => String.fromCharCode(byte)).join(""));
      return { type: "exported", name: `${opening.file.replace(/\.[^.]*$/, "")}.csv`, content };
    },
  };
  setTimeout(() => hear({ ...opening, type: "opening" }));
  return async (message) => {
    await new Promise((done) => setTimeout(done));
    hear({ ...(await answers[message.type](message)), id: message.id });
  };
}

"use strict";
// The solver of a saved page of a mechanism as the one who answers. `solver` moves the drivers; the
// motion over the sweep, the reach of each driver and the file of curves are known, in `SAVED`.

const WAY = 32; // parts of the way from the design to a pose, as the server's

function answererOf(hear) {
  const { opening, answer, reaches, outputs, reactions, poses, csv, slow } = SAVED;
  const mechanism = new solver.Mechanism();
  const out = new Float64Array(3 * mechanism.outputs());
  const known = (which) => (Number.isFinite(out[3 * which]) ? out[3 * which] : null);

  // Move straight from the design, up to the last part of the way that is reached.
  function move({ drivers, measured }) {
    const began = performance.now();
    const design = opening.drivers.map((driver) => driver.design);
    const change = opening.drivers.map(({ name }, k) => (drivers[name] ?? design[k]) - design[k]);
    const at = (share) => design.map((value, k) => value + share * change[k]);
    // forces are those at rest; what is per travel is along the way
    const rates = change.map((by) => by / slow);
    mechanism.start();
    if (mechanism.moveAll(design, rates, out)) {
      return { type: "invalid", message: "the design position is not reached" };
    }
    let part = 0;
    while (part < WAY && !mechanism.moveAll(at((part + 1) / WAY), rates, out)) part += 1;
    const lane = mechanism.lanes[0];
    const reached = at(part / WAY);
    return {
      type: "pose",
      drivers: Object.fromEntries(opening.drivers.map(({ name }, k) => [name, reached[k]])),
      share: part / WAY,
      bodies: Object.fromEntries(
        poses.map(([name, slots]) => [name, slots.map((slot) => lane[slot])]),
      ),
      outputs: Object.fromEntries(outputs.map(([name, which]) => [name, known(which)])),
      distance: null,
      reactions: measured
        ? Object.fromEntries(
            reactions.map(([name, axes]) => [name, axes.map((which) => known(which) ?? 0)]),
          )
        : {},
      message: part < WAY ? "a lock-up, or another branch, lies before these values" : "",
      milliseconds: { solve: performance.now() - began },
    };
  }

  const answers = {
    move,
    solve: () => answer,
    reach: ({ driver }) => reaches.find((each) => each.driver === driver),
    export: () => ({ type: "exported", name: csv.name, content: csv.content }),
  };
  setTimeout(() => hear({ ...opening, type: "opening" }));
  return async (message) => {
    await new Promise((done) => setTimeout(done));
    hear({ ...answers[message.type](message), id: message.id });
  };
}

"use strict";
// The link to who answers: questions of which one is on its way, and the newest waits.

// Connect by `answererOf` (of a server, or of the solver in a saved page), and call `on[type]` for
// each message, `on.lost` at the end.
// Returns `ask`, which sends a message under a kind: while an answer to the kind is due, only the
// newest message of it waits; and `tell`, which sends at once.
function linkTo(on) {
  const due = new Map(); // kind: number of the message on its way
  const next = new Map(); // kind: message that waits
  let count = 0;
  const hear = (message) => {
    settle(message.id);
    on[message.type](message);
  };
  const send = answererOf(hear, () => on.lost());

  function tell(message) {
    count += 1;
    send({ ...message, id: count });
    return count;
  }
  function ask(kind, message) {
    if (due.has(kind)) return next.set(kind, message);
    due.set(kind, tell(message));
  }
  function settle(number) {
    for (const [kind, sent] of due) {
      if (sent !== number) continue;
      due.delete(kind);
      const message = next.get(kind);
      next.delete(kind);
      if (message) ask(kind, message);
    }
  }
  return { ask, tell, isDue: (kind) => due.has(kind) };
}

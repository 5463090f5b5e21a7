"use strict";
// The server as the one who answers.

function answererOf(hear, lost) {
  const token = new URLSearchParams(location.search).get("token") || "";
  const socket = new WebSocket(`ws://${location.host}/socket?token=${encodeURIComponent(token)}`);
  socket.addEventListener("message", ({ data }) => hear(JSON.parse(data)));
  socket.addEventListener("close", lost);
  return (message) => socket.send(JSON.stringify(message));
}

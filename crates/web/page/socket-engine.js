// The engine behind a socket: `sitl serve --web`.
export class SocketEngine {
  start(onMessage, onLink) {
    const scheme = location.protocol === "https:" ? "wss:" : "ws:";
    this.socket = new WebSocket(`${scheme}//${location.host}/socket${location.search}`);
    this.socket.addEventListener("open", () => onLink("connected", true));
    this.socket.addEventListener("message", ({ data }) => onMessage(JSON.parse(data)));
    this.socket.addEventListener("close", ({ code, reason }) => {
      // Another page has taken the place of this one: two that take it from each other would go on for ever.
      if (code === 4000) {
        onLink(`not connected: ${reason}`, false);
        return;
      }
      onLink(`not connected${reason ? `: ${reason}` : ""}; trying again`, false);
      setTimeout(() => this.start(onMessage, onLink), 1000);
    });
  }

  send(command) {
    if (this.socket.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(command));
  }

  values() {
    this.send({ do: "values" });
  }
}

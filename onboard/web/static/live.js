// The connection to the service: snapshots as they come, reconnecting when they stop.

const FIRST_DELAY_MS = 500;
const LONGEST_DELAY_MS = 8000;
const SILENCE_MS = 8000; // the service speaks once a second: so much silence is a dead connection

/** Calls `onSnapshot(object)` for each and `onState("live" | "lost", since)` on changes. */
export class Live {
  constructor(url, { onSnapshot, onState }) {
    this.url = url;
    this.onSnapshot = onSnapshot;
    this.onState = onState;
    this.failures = 0;
    this.socket = null;
    this.retry = null;
    this.watch = null;
    document.addEventListener("visibilitychange", () => {
      if (!document.hidden && this.retry !== null) this.connect();
    });
    window.addEventListener("online", () => {
      if (this.retry !== null) this.connect();
    });
  }

  connect() {
    clearTimeout(this.retry);
    this.retry = null;
    const socket = new WebSocket(this.url);
    this.socket = socket;
    this.listen();
    socket.addEventListener("message", (event) => {
      if (socket !== this.socket) return;
      let snapshot;
      try {
        snapshot = JSON.parse(event.data);
      } catch {
        return this.lost(); // half a message: ask for a whole one
      }
      this.failures = 0;
      this.listen();
      this.onState("live");
      this.onSnapshot(snapshot);
    });
    socket.addEventListener("close", () => socket === this.socket && this.lost());
  }

  listen() {
    clearTimeout(this.watch);
    this.watch = setTimeout(() => this.lost(), SILENCE_MS);
  }

  lost() {
    clearTimeout(this.watch);
    const socket = this.socket;
    this.socket = null;
    socket?.close();
    this.onState("lost");
    const longest = Math.min(LONGEST_DELAY_MS, FIRST_DELAY_MS * 2 ** this.failures);
    this.failures = Math.min(this.failures + 1, 10);
    clearTimeout(this.retry);
    // Jitter, so that several viewers do not fall upon a service that has just started.
    this.retry = setTimeout(() => this.connect(), longest * (0.5 + Math.random() / 2));
  }
}

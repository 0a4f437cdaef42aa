// The engine in the page itself: the simulator as WebAssembly.
const STEPS_MAX = 400;
const FRAME_MS = 33;
const PAUSED_MS = 250;

export class WasmEngine {
  /** `Vehicle` is the class that WebAssembly exports; it is made anew by `restart`. */
  constructor(Vehicle, { scenario = "outdoor", vehicle = "", seed = 1 } = {}) {
    this.Vehicle = Vehicle;
    this.choice = { scenario, vehicle, seed };
    [this.speed, this.paused] = [1, false];
  }

  start(onMessage, onLink) {
    this.onMessage = onMessage;
    this.onLink = onLink;
    this.restart(this.choice);
    let [last, owed, shown] = [performance.now(), 0, 0];
    const turn = (now) => {
      // What a hidden page has missed is not caught up with.
      const passed = Math.min(now - last, 100);
      last = now;
      if (this.core && !this.paused) {
        owed = this.speed > 0 ? owed + passed * this.speed : STEPS_MAX;
        const begun = performance.now();
        while (owed >= 1 && performance.now() - begun < 25) {
          const steps = Math.min(Math.floor(owed), 20);
          this.carryOut(this.core.advance(steps));
          owed -= steps;
        }
        // A slow machine runs slower rather than later.
        owed = Math.min(owed, 50);
      }
      if (this.core && now - shown >= (this.paused ? PAUSED_MS : FRAME_MS - 4)) {
        shown = now;
        this.show();
      }
      requestAnimationFrame(turn);
    };
    requestAnimationFrame(turn);
  }

  /** Begins again with this scenario, vehicle and seed. */
  restart(choice) {
    let core;
    try {
      core = new this.Vehicle(choice.scenario, choice.vehicle, choice.seed);
    } catch (error) {
      this.onMessage({ kind: "reply", text: `error ${error.message ?? error}` });
      return;
    }
    this.core?.free();
    [this.core, this.choice] = [core, choice];
    this.onLink("runs in this page", true);
    this.onMessage(JSON.parse(core.hello()));
    this.values();
    this.show();
  }

  show() {
    this.onMessage(JSON.parse(this.core.frame(this.speed, this.paused)));
  }

  send(command) {
    const { messages, then } = JSON.parse(this.core.command(JSON.stringify(command)));
    messages.forEach((message) => this.onMessage(JSON.parse(message)));
    this.carryOut(then);
    this.show();
  }

  /** Does what is left: "", "pause", "resume" or "speed N". */
  carryOut(then) {
    const [what, number] = then.split(" ");
    if (what === "speed") this.speed = Number(number);
    if (what === "pause") this.paused = true;
    if (what === "resume") this.paused = false;
  }

  values() {
    this.onMessage(JSON.parse(this.core.values()));
  }
}

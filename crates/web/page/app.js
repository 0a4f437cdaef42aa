// The page around an engine: something that flies the vehicle, here or behind a socket.
//
// An engine has `start(onMessage, onLink)`, which calls `onMessage` with objects whose `kind` is hello, values, frame
// or reply, and `onLink` with a text on the connection and whether it works; and `send(command)`. The objects are those
// of afbc-serve's module page.
import { Charts } from "./charts.js";
import { Parameters } from "./parameters.js";
import { VehicleScene } from "./scene.js";

const at = (id) => document.getElementById(id);
const value = (id) => Number(at(id).value);
const option = (text, choice) => new Option(text, choice);

export function run(engine) {
  const draft = { waypoints: [], corners: [] };
  let [frame, seen, changes, paused] = [null, -1, -1, false];
  const send = (command) => engine.send(command);
  const line = (text) => send({ do: "line", text });
  const charts = new Charts(at("charts"));
  const parameters = new Parameters(at("parameters"), at("filter"), (name, to) =>
    send({ do: "parameter", name, value: to }),
  );
  const scene = new VehicleScene(at("scene"), ([x, y]) => {
    const height = Math.max(value("go-z"), 0.5);
    const mode = at("click").value;
    if (mode === "go") {
      [at("go-x").value, at("go-y").value] = [x.toFixed(1), y.toFixed(1)];
      send({ do: "go_to", position_m: [x, y, height] });
    }
    if (mode === "waypoint") draft.waypoints.push([x, y, height]);
    if (mode === "corner") draft.corners.push([x, y]);
    showDraft();
  }, (number) => {
    at("sigmas").textContent = number;
  });

  const showDraft = () => {
    const { waypoints, corners } = draft;
    at("send-plan").disabled = !waypoints.length && corners.length < 3;
    at("draft").textContent =
      waypoints.length || corners.length ? `${waypoints.length} waypoints, ${corners.length} corners drawn` : "";
    if (frame) scene.show(frame, draft);
  };
  const plan = (waypoints, corners) => {
    send({ do: "plan", waypoints_m: waypoints, fence_m: corners.length > 2 ? corners : [] });
    [draft.waypoints, draft.corners] = [[], []];
    showDraft();
  };
  /** Shows a text; `severity` is MAVLink's, 0 to 7. */
  const say = (text, severity, time) => {
    const item = document.createElement("li");
    item.textContent = time === undefined ? text : `${time.toFixed(1)} s  ${text}`;
    item.className = severity <= 3 ? "error" : severity === 4 ? "warning" : "";
    const list = at("texts");
    list.append(item);
    while (list.children.length > 200) list.firstChild.remove();
    list.scrollTop = list.scrollHeight;
  };

  // Buttons.
  document.querySelectorAll("[data-command]").forEach((button) => {
    button.addEventListener("click", () => send(JSON.parse(button.dataset.command)));
  });
  document.addEventListener("click", ({ target }) => target.dataset?.line && line(target.dataset.line));
  const on = (id, act, event = "click") => at(id).addEventListener(event, act);
  on("take-off", () => send({ do: "take_off", height_m: value("take-off-height") }));
  on("go", () => send({ do: "go_to", position_m: [value("go-x"), value("go-y"), value("go-z")] }));
  on("square", () => {
    const here = frame?.truth.position_m ?? [0, 0, 0];
    const [x, y] = frame?.home_m ?? here;
    const height = Math.max(value("go-z"), 0.5);
    const side = 3;
    // Around the square and where the vehicle is.
    const [west, east, south, north] = [
      Math.max(y + side, here[1]) + side,
      Math.min(y, here[1]) - side,
      Math.min(x, here[0]) - side,
      Math.max(x + side, here[0]) + side,
    ];
    const corners = [
      [south, east],
      [north, east],
      [north, west],
      [south, west],
    ];
    const square = [
      [x + side, y],
      [x + side, y + side],
      [x, y + side],
      [x, y],
    ];
    plan(
      square.map(([u, v]) => [u, v, height]),
      engine.fences === false ? [] : corners,
    );
  });
  on("send-plan", () => plan(draft.waypoints, draft.corners));
  on("clear-plan", () => plan([], []));
  on("pause", () => line(paused ? "resume" : "pause"));
  on("speed", () => line(`speed ${at("speed").value}`), "change");
  on("laws", () => line(`law ${at("laws").value}`), "change");
  const towards = () =>
    at("gust-to")
      .value.split(" ")
      .map((sign) => Number(sign) * value("gust-size"));
  on("gust", () => line(`gust ${towards().join(" ")} 0 0.5 1`));
  on("wind-set", () => line(`wind ${towards().join(" ")} 0`));
  on("turbulence", () => line(`turbulence ${at("turbulence").value}`), "change");
  on("payload-take", () => line(`payload ${value("payload")} 0.05`));
  on("rotor-fault", () => line(`rotor ${at("rotor").value} ${value("rotor-share")}`));
  on(
    "follow",
    () => {
      scene.setFollow(at("follow").checked);
    },
    "change",
  );
  on("home-view", () => {
    at("follow").checked = false;
    scene.wholeView();
  });
  on(
    "line-form",
    (event) => {
      event.preventDefault();
      if (at("line").value.trim()) line(at("line").value.trim());
      at("line").value = "";
    },
    "submit",
  );
  document
    .querySelectorAll("form")
    .forEach((form) => form.addEventListener("submit", (event) => event.preventDefault()));

  // Keys, unless something is typed.
  const keys = [...document.querySelectorAll("[data-key]")];
  at("keys").append(
    ...keys.flatMap((button) => {
      const key = document.createElement("kbd");
      key.textContent = button.dataset.key === " " ? "space" : button.dataset.key;
      return [key, ` ${button.textContent}  `];
    }),
  );
  document.addEventListener("keydown", (event) => {
    const typed = event.target.closest?.("input, select, textarea");
    const pressed = event.key === " " && event.target.closest?.("button");
    if (typed || pressed || event.ctrlKey || event.metaKey || event.altKey) return;
    const button = keys.find(({ dataset }) => dataset.key === event.key.toLowerCase());
    if (button) {
      event.preventDefault();
      button.click();
    }
  });

  const show = {
    hello(hello) {
      at("name").textContent = `AFBC: ${hello.vehicle}, ${hello.scenario}`;
      at("laws").replaceChildren(...hello.laws.map(({ name, title }) => option(title, name)));
      at("rotor").replaceChildren(...hello.rotors.map((_, i) => option(i + 1, i + 1)));
      at("line-names").replaceChildren(...hello.lines.map(([name]) => option(name, `${name} `)));
      const outages = [
        ["gnss", "lost 5"],
        ["gnss", "jumped 5 0 0 5"],
        ["tracker", "lost 3"],
        ["barometer", "lost 5"],
        ["magnetometer", "disturbed 30 0 0 5"],
        ["imu", "stuck 1"],
      ];
      at("outages").replaceChildren(
        ...outages
          .filter(([name]) => hello.instruments.includes(name))
          .map(([name, how]) => {
            const button = document.createElement("button");
            button.type = "button";
            button.dataset.line = `fault ${name} ${how}`;
            button.textContent = `${name} ${how.split(" ")[0]}, ${how.split(" ").at(-1)} s`;
            return button;
          }),
      );
      engine.fences = hello.instruments.includes("gnss");
      [seen, changes] = [-1, -1];
      scene.at = null;
      scene.build(hello);
      charts.hello(hello);
      parameters.hello(hello);
    },
    values({ values }) {
      parameters.values(values);
    },
    reply({ text }) {
      say(text, text.startsWith("error") ? 3 : 6);
    },
    // Of the frames that come between two pictures, the newest is drawn: a slow browser does not fall behind.
    frame(now) {
      if (!frame || frame.shown) requestAnimationFrame(() => this.picture(frame));
      frame = now;
      paused = now.paused;
      if (now.parameter_changes !== changes) {
        changes = now.parameter_changes;
        engine.values();
      }
      now.texts
        .filter(({ number }) => number > seen)
        .forEach(({ number, time_s: time, severity, text }) => {
          seen = number;
          say(text, severity, time);
        });
    },
    picture(now) {
      now.shown = true;
      scene.show(now, draft);
      charts.show(now);
      const put = (id, text, alarm = false) => {
        if (at(id).textContent !== text) at(id).textContent = text;
        at(id).classList.toggle("alarm", alarm);
      };
      put("time", `${now.time_s.toFixed(1)} s${paused ? ", paused" : ""}`);
      put(
        "state",
        now.failsafe ? "failsafe" : !now.armed ? "disarmed" : now.airborne ? now.core : "armed",
        now.failsafe || now.core === "descending",
      );
      put("mode", now.mode || "–");
      put("law", now.fallback ? `fallback: ${now.fallback}` : now.law, Boolean(now.fallback));
      put("height", `${now.truth.position_m[2].toFixed(2)} m`);
      put("wind", `${Math.hypot(...now.wind_m_s).toFixed(1)} m/s`);
      put(
        "battery",
        now.battery ? `${now.battery.voltage_v.toFixed(1)} V, ${Math.round(100 * now.battery.charge)} %` : "–",
        Boolean(now.battery && now.battery.charge < 0.2),
      );
      put(
        "suffers",
        [...now.faults, ...(now.payload_kg > 0 ? [`payload ${now.payload_kg.toFixed(2)} kg`] : [])].join(", "),
      );
      if (document.activeElement !== at("laws")) at("laws").value = now.law;
      const speed = String(now.speed ?? "");
      if (document.activeElement !== at("speed") && [...at("speed").options].some((it) => it.value === speed)) {
        at("speed").value = speed;
      }
      at("pause").setAttribute("aria-pressed", String(paused));
      at("pause").textContent = paused ? "go on" : "pause";
    },
  };
  globalThis.page = {
    engine,
    scene,
    charts,
    get frame() {
      return frame;
    },
  };
  engine.start(
    (message) => show[message.kind]?.(message),
    (text, works) => {
      at("link").textContent = text;
      at("link").classList.toggle("lost", !works);
    },
  );
}

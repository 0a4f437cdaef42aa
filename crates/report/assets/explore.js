// Draws the figures of a page anew, to be explored: charts by uPlot, flights in space by three.js, both packed in the
// page. Without it, or if anything here fails, the pictures of the page stay.
"use strict";
(() => {
  const PANEL_PX = 150, LEFT_PX = 66, KEY_STEP = 1 / 200;
  // Share of a view that flights in space fill: vehicles and labels are larger than their places.
  const FRAMED = 0.86;
  const SPEEDS = [0.25, 0.5, 1, 2, 5, 10];
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const shade = (colors) => colors[dark.matches ? 1 : 0];
  const ink = (name) => getComputedStyle(document.documentElement).getPropertyValue(name);

  /** Text that is packed as Base64 of zlib. */
  async function unpacked(packed) {
    const bytes = Uint8Array.from(atob(packed.trim()), (letter) => letter.charCodeAt(0));
    return new Response(new Blob([bytes]).stream().pipeThrough(new DecompressionStream("deflate"))).text();
  }

  const libraries = {};
  /** A library of the page, which defines a global of its name. */
  function library(name) {
    libraries[name] ??= unpacked(document.querySelector(`[data-library=${name}]`).textContent)
      .then((text) => new Function(`${text}\nreturn ${name};`)());
    return libraries[name];
  }

  /** Values of differences on a grid. */
  function summed(deltas, low, step) {
    let sum = 0;
    return Float64Array.from(deltas, (delta) => low + (sum += delta) * step);
  }

  /** Index of the last of the increasing `times` that is at most `time`. */
  function before(times, time) {
    let low = 0, high = times.length - 1;
    while (low < high) {
      const middle = (low + high + 1) >> 1;
      if (times[middle] <= time) low = middle; else high = middle - 1;
    }
    return low;
  }

  /** A value between its neighbours in time; null beyond the ends. */
  function between(times, values, time) {
    if (!times.length || time < times[0] || time > times[times.length - 1]) return null;
    const i = before(times, time), next = Math.min(i + 1, times.length - 1);
    const span = times[next] - times[i];
    return span > 0 ? values[i] + (values[next] - values[i]) * (time - times[i]) / span : values[i];
  }

  const minus = (text) => text.replace("-", "−");
  const seconds = (time) => `${minus(time.toFixed(2))} s`;

  function element(tag, attributes = {}, ...children) {
    const made = document.createElement(tag);
    for (const [name, value] of Object.entries(attributes)) {
      if (name.startsWith("on")) made.addEventListener(name.slice(2), value); else made.setAttribute(name, value);
    }
    made.append(...children);
    return made;
  }

  /** Nodes of a text in which ⟨d⟩ is a subscript. */
  const lowered = (text) => text.split(/[⟨⟩]/).map((part, i) => i % 2 ? element("sub", {}, part) : part);
  const plain = (text) => text.replace(/[⟨⟩]/g, "");

  /** What the figures of one section share: time under the cursor, the interval that is seen, who is hidden. */
  class Shared {
    constructor() {
      Object.assign(this, { views: [], end: 0, time: null, from: 0, to: 0, hidden: new Set() });
    }
    add(view, end) {
      this.views.push(view);
      if (end > this.end) { this.end = end; this.to = end; }
    }
    setTime(time, source) {
      this.time = time === null ? null : Math.min(Math.max(time, 0), this.end);
      for (const view of this.views) if (view !== source) view.showTime(this.time);
    }
    setWindow(from, to) {
      const span = Math.min(Math.max(to - from, this.end * 1e-4), this.end);
      from = Math.min(Math.max(from, 0), this.end - span);
      if (from === this.from && from + span === this.to) return;
      [this.from, this.to] = [from, from + span];
      for (const view of this.views) view.showWindow();
    }
    zoom(factor, at = this.time ?? (this.from + this.to) / 2) {
      at = Math.min(Math.max(at, this.from), this.to);
      this.setWindow(at - (at - this.from) * factor, at + (this.to - at) * factor);
    }
    pan(part) {
      const by = (this.to - this.from) * part;
      const from = Math.min(Math.max(this.from + by, 0), this.end - (this.to - this.from));
      this.setWindow(from, from + this.to - this.from);
    }
    toggle(name) {
      if (!this.hidden.delete(name)) this.hidden.add(name);
      for (const view of this.views) view.showHidden();
    }
  }

  /** Buttons that hide what is in the legend. */
  function legend(entries, shared) {
    const buttons = entries.map((entry) => {
      const swatch = element("span", { class: "swatch" });
      const button = element("button", { type: "button", "aria-pressed": "true", title: "show or hide",
        onclick: () => shared.toggle(entry.name) }, swatch, ...lowered(entry.name));
      return { entry, swatch, button };
    });
    const show = () => {
      for (const { entry, swatch, button } of buttons) {
        button.setAttribute("aria-pressed", String(!shared.hidden.has(entry.name)));
        swatch.style.borderTopColor = shade(entry.colors);
        swatch.style.opacity = entry.opacity;
        swatch.style.borderTopStyle = entry.dash_px.length ? "dashed" : "solid";
      }
    };
    show();
    return { nodes: buttons.map(({ button }) => button), show };
  }

  /** Panels above each other with a common time axis. */
  class Chart {
    constructor(data, host, shared, uPlot) {
      Object.assign(this, { data, host, shared, uPlot });
      const button = (label, title, act) => element("button", { type: "button", title, "aria-label": title,
        onclick: act }, label);
      this.legend = legend(data.legend, shared);
      host.append(
        element("div", { class: "bar" }, element("strong", {}, data.title),
          button("−", "zoom out", () => shared.zoom(2)), button("+", "zoom in", () => shared.zoom(0.5)),
          button("←", "earlier", () => shared.pan(-0.25)), button("→", "later", () => shared.pan(0.25)),
          button("all", "all of the time", () => shared.setWindow(0, shared.end))),
        element("div", { class: "bar" }, ...this.legend.nodes));
      this.panels = data.panels.map((panel, index) => this.panel(panel, index));
      new ResizeObserver(() => this.resize()).observe(host);
      this.showHidden();
      this.showWindow();
    }

    panel(panel, index) {
      const { data, shared } = this;
      const last = index === data.panels.length - 1;
      const step = (panel.high - panel.low) / 16384;
      const traces = panel.traces.map((trace) => ({ ...trace, name: data.legend[trace.entry]?.name,
        times: summed(trace.times, 0, data.end_s / 1e6), values: summed(trace.values, panel.low, step) }));
      const box = element("div", { class: "panel", tabindex: "0", role: "img",
        "aria-label": `${plain(panel.label)}: arrow keys move along time, plus and minus zoom` });
      const values = element("div", { class: "values", hidden: "" });
      box.append(values);
      this.host.append(box);
      const digits = Math.max(0, 4 - Math.ceil(Math.log10(panel.high - panel.low)));
      const made = { traces, box, values, panel, digits };
      // Lines have times of their own: one table with all of them, where a line has no value between.
      const table = this.uPlot.join(traces.map(({ times, values }) => [times, values]));
      const axis = { stroke: () => ink("--quiet"), grid: { stroke: () => ink("--faint"), width: 0.5 },
        ticks: { stroke: () => ink("--faint"), width: 0.5 }, font: "11px system-ui, sans-serif" };
      made.plot = new this.uPlot({
        width: this.width(), height: PANEL_PX + (last ? 34 : 8),
        legend: { show: false }, padding: [6, 12, 0, 0],
        scales: {
          x: { time: false, auto: false, range: (_plot, from, to) => [from ?? 0, to ?? shared.end] },
          y: { auto: false, range: (_plot, low, high) => [low ?? panel.low, high ?? panel.high] },
        },
        cursor: { drag: { x: true, y: false, setScale: false }, points: { show: false },
          bind: { dblclick: () => () => { shared.setWindow(0, shared.end); } } },
        series: [{}, ...traces.map((trace) => ({ stroke: () => shade(trace.colors), width: trace.width_px,
          alpha: trace.opacity, dash: trace.dash_px, points: { show: false } }))],
        axes: [
          { ...axis, ...ticked(60, "width"), show: true, size: last ? 40 : 8, label: last ? "t [s]" : undefined,
            labelSize: 16, labelFont: axis.font, ...(last ? {} : { values: () => [] }) },
          { ...axis, ...ticked(26, "height"), size: LEFT_PX - 20, label: plain(panel.label), labelSize: 20,
            labelFont: axis.font },
        ],
        hooks: {
          drawClear: [(plot) => this.shadeSpans(plot, index === 0)],
          setCursor: [(plot) => this.pointed(made, plot)],
          setSelect: [(plot) => {
            const { left, width } = plot.select;
            if (width > 3) shared.setWindow(plot.posToVal(left, "x"), plot.posToVal(left + width, "x"));
            plot.setSelect({ left: 0, width: 0, top: 0, height: 0 }, false);
          }],
        },
      }, table, box);
      box.addEventListener("keydown", (event) => this.key(event));
      box.addEventListener("blur", () => { values.hidden = true; });
      box.addEventListener("wheel", (event) => {
        if (!event.ctrlKey && !event.shiftKey) return;
        event.preventDefault();
        if (event.shiftKey) shared.pan(Math.sign(event.deltaY || event.deltaX) * 0.1);
        else shared.zoom(event.deltaY > 0 ? 1.25 : 0.8);
      }, { passive: false });
      return made;
    }

    width() { return Math.max(260, this.host.clientWidth - 16); }

    resize() {
      for (const [i, { plot }] of this.panels.entries()) {
        plot.setSize({ width: this.width(), height: PANEL_PX + (i === this.panels.length - 1 ? 34 : 8) });
      }
    }

    /** Range of a panel: as drawn while all of the time is seen, else of what is seen. */
    range({ panel, traces }) {
      const { from, to, end, hidden } = this.shared;
      if (from <= 0 && to >= end && !traces.some((trace) => hidden.has(trace.name))) return [panel.low, panel.high];
      let low = Infinity, high = -Infinity;
      for (const { times, values, name } of traces) {
        if (hidden.has(name) || !times.length) continue;
        for (let i = before(times, from); i < times.length && times[i] <= to; i++) {
          if (times[i] < from) continue;
          low = Math.min(low, values[i]);
          high = Math.max(high, values[i]);
        }
      }
      if (!(low <= high)) return [panel.low, panel.high];
      return roomy(low, high, 1e-3 * (panel.high - panel.low));
    }

    shadeSpans(plot, labelled) {
      const { ctx, bbox } = plot;
      ctx.save();
      ctx.beginPath();
      ctx.rect(bbox.left, bbox.top, bbox.width, bbox.height);
      ctx.clip();
      ctx.font = `${11 * devicePixelRatio}px system-ui, sans-serif`;
      [ctx.textAlign, ctx.textBaseline] = ["left", "alphabetic"];
      const rows = []; // right ends of the labels in each row
      for (const span of this.data.spans) {
        const [from, to] = [span.start_s, span.end_s].map((time) => plot.valToPos(time, "x", true));
        ctx.fillStyle = shade(span.colors);
        ctx.globalAlpha = 0.6;
        if (to > from) ctx.fillRect(from, bbox.top, to - from, bbox.height);
        ctx.globalAlpha = 1;
        ctx.fillStyle = ink("--rule");
        ctx.fillRect(from, bbox.top, devicePixelRatio, bbox.height);
        ctx.fillStyle = ink("--quiet");
        if (!labelled) continue;
        const label = plain(span.label), left = from + 4 * devicePixelRatio;
        const free = rows.findIndex((right) => right < from), row = free < 0 ? rows.length : free;
        rows[row] = left + ctx.measureText(label).width;
        ctx.fillText(label, left, bbox.top + (12 + 13 * row) * devicePixelRatio);
      }
      ctx.restore();
    }

    pointed(made, plot) {
      if (this.placing) return;
      const { left, top } = plot.cursor;
      if (left < 0 || top < 0) { made.values.hidden = true; return; }
      const time = plot.posToVal(left, "x");
      this.describe(made, time, left);
      this.placing = true;
      this.shared.setTime(time, null);
      this.placing = false;
    }

    /** Shows the values of a panel at a time. */
    describe(made, time, left) {
      const { values, traces, digits } = made;
      const rows = [];
      for (const trace of traces) {
        const value = this.shared.hidden.has(trace.name) ? null : between(trace.times, trace.values, time);
        if (value === null) continue;
        const pale = trace.opacity < 1 && !(this.data.legend[trace.entry]?.opacity < 1);
        const swatch = element("span", { class: "swatch" });
        swatch.style.borderTopColor = shade(trace.colors);
        swatch.style.opacity = trace.opacity;
        rows.push(element("div", {}, element("span", {}, swatch, ...lowered((trace.name ?? "") + (pale ? " ±" : ""))),
          element("span", {}, minus(value.toFixed(digits)))));
      }
      values.replaceChildren(element("div", {}, element("strong", {}, seconds(time))), ...rows);
      values.hidden = rows.length === 0;
      const right = left > this.width() / 2;
      values.style.left = right ? "" : `${LEFT_PX + left + 12}px`;
      values.style.right = right ? `${this.width() - LEFT_PX - left + 12}px` : "";
      values.style.top = "4px";
    }

    key(event) {
      const { shared } = this;
      const step = (shared.to - shared.from) * KEY_STEP * (event.shiftKey ? 10 : 1);
      const move = (by) => {
        const time = Math.min(Math.max((shared.time ?? shared.from) + by, shared.from), shared.to);
        shared.setTime(time, null);
        const made = this.panels.find(({ box }) => box === event.currentTarget);
        if (made) this.describe(made, time, made.plot.valToPos(time, "x"));
      };
      const acts = { ArrowLeft: () => move(-step), ArrowRight: () => move(step), "+": () => shared.zoom(0.5),
        "=": () => shared.zoom(0.5), "-": () => shared.zoom(2), Home: () => shared.setWindow(0, shared.end),
        Escape: () => { for (const { values } of this.panels) values.hidden = true; } };
      if (!acts[event.key]) return;
      event.preventDefault();
      acts[event.key]();
    }

    showTime(time) {
      const placing = this.placing;
      this.placing = true;
      for (const { plot } of this.panels) {
        plot.setCursor({ left: time === null ? -10 : plot.valToPos(time, "x"), top: plot.cursor.top ?? -10 }, false);
      }
      this.placing = placing;
    }

    showWindow() {
      for (const made of this.panels) {
        const [low, high] = this.range(made);
        made.plot.batch(() => {
          made.plot.setScale("x", { min: this.shared.from, max: this.shared.to });
          made.plot.setScale("y", { min: low, max: high });
        });
      }
    }

    showHidden() {
      this.legend.show();
      for (const made of this.panels) {
        made.traces.forEach((trace, i) => made.plot.setSeries(i + 1, { show: !this.shared.hidden.has(trace.name) }));
      }
      this.showWindow();
    }

    recolour() {
      this.legend.show();
      for (const { plot } of this.panels) plot.redraw(false, true);
    }
  }

  /** Flights in space, again and again. */
  class Space {
    constructor(data, host, shared, THREE) {
      Object.assign(this, { data, host, shared, THREE });
      const { low_m: low, high_m: high } = data;
      this.tracks = data.tracks.map((track) => ({ ...track, times: summed(track.times, 0, data.end_s / 1e6),
        position: track.position.map((deltas, i) => summed(deltas, low[i], (high[i] - low[i]) / 65536)),
        attitude: track.attitude?.map((deltas) => summed(deltas, 0, 2 * Math.PI / 65536)) }));
      this.legend = legend(data.tracks, shared);
      this.slider = element("input", { type: "range", min: "0", max: String(data.end_s), step: "any", value: "0",
        "aria-label": "time", oninput: () => { this.stop(); shared.setTime(Number(this.slider.value), null); } });
      this.slider.value = 0;
      this.output = element("output", {}, seconds(0));
      const play = () => this.running ? this.stop() : this.start();
      this.play = element("button", { type: "button", onclick: play }, "▶ play");
      this.speed = element("select", { "aria-label": "speed" },
        ...SPEEDS.map((speed) => element("option", { value: speed }, `${speed}×`)));
      this.speed.value = 1;
      this.space = element("div", { class: "space" });
      host.append(element("div", { class: "bar" }, element("strong", {}, data.title), ...this.legend.nodes), this.space,
        element("div", { class: "bar" }, this.play, this.speed, this.slider, this.output));
      this.build();
      new ResizeObserver(() => this.resize()).observe(this.space);
      this.time = 0;
      this.showHidden();
    }

    build() {
      const { THREE, data } = this;
      const { low_m: low, high_m: high, rotors_m: rotors } = data;
      const size = high.map((value, i) => value - low[i]);
      const extent = this.extent = Math.max(...size);
      // One for all scenes of a page, of which a browser draws some sixteen at once; each has its picture.
      Space.renderer ??= new THREE.WebGLRenderer({ antialias: true });
      const canvas = element("canvas", { role: "img",
        "aria-label": "the flights in space; drag to turn, control and wheel to zoom" });
      this.canvas = canvas;
      this.space.append(canvas);
      this.scene = new THREE.Scene();
      this.scene.add(new THREE.HemisphereLight(0xffffff, 0x888888, 3));
      this.camera = new THREE.PerspectiveCamera(40, 1, extent / 1000, extent * 50);
      this.camera.up.set(0, 0, 1);
      this.controls = new THREE.OrbitControls(this.camera, canvas);
      this.controls.addEventListener("start", () => { this.moved = true; });
      this.controls.addEventListener("change", () => this.draw());
      // A page scrolls by the wheel; with the control key the wheel zooms.
      canvas.addEventListener("wheel", (event) => { if (!event.ctrlKey) event.stopImmediatePropagation(); },
        { capture: true, passive: true });
      // Floor: lines of 1, 2 or 5 times a power of ten metres.
      const step = [1, 2, 5, 10].map((n) => n * 10 ** Math.floor(Math.log10(extent / 8)))
        .find((s) => extent / s <= 16);
      const floor = [];
      const [x0, x1, y0, y1] = [[low[0], Math.floor], [high[0], Math.ceil], [low[1], Math.floor], [high[1], Math.ceil]]
        .map(([value, round]) => round(value / step) * step);
      for (let x = x0; x <= x1 + step / 2; x += step) floor.push(x, y0, low[2], x, y1, low[2]);
      for (let y = y0; y <= y1 + step / 2; y += step) floor.push(x0, y, low[2], x1, y, low[2]);
      this.floor = this.lines(floor, new THREE.LineBasicMaterial());
      this.scene.add(this.floor);
      this.labels = [];
      const label = (text, at) => {
        const sprite = new THREE.Sprite(new THREE.SpriteMaterial({ depthTest: false }));
        sprite.position.set(...at);
        sprite.scale.set(extent * 0.24, extent * 0.06, 1);
        this.labels.push({ sprite, text });
        this.scene.add(sprite);
      };
      this.floorCorners = [x0, x1].flatMap((x) => [y0, y1].map((y) => [x, y, low[2]]));
      this.ways = [];
      label(`x ${minus(x1.toPrecision(3))} m`, [x1 + extent * 0.1, y0, low[2]]);
      label(`y ${minus(y1.toPrecision(3))} m`, [x0, y1 + extent * 0.05, low[2]]);
      label(`${step} m grid, z ${minus(low[2].toFixed(1))} m`, [(x0 + x1) / 2, y0 - extent * 0.08, low[2]]);
      const arm = Math.max(...rotors.map(([x, y]) => Math.hypot(x, y)), 1e-3);
      const scale = Math.max(1, extent * 0.03 / arm);
      for (const track of this.tracks) {
        const points = [];
        for (let i = 0; i < track.times.length; i++) {
          const at = track.position.map((values) => values[i]);
          points.push(...at);
          this.ways.push(at);
        }
        const geometry = new THREE.BufferGeometry();
        geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
        track.material = new THREE.LineBasicMaterial({ transparent: true, opacity: track.attitude ? 0.9 : 0.8 });
        track.group = new THREE.Group();
        track.group.add(new THREE.Line(geometry, track.material));
        track.paint = new THREE.MeshLambertMaterial();
        track.vehicle = this.vehicle(track, rotors, arm, scale);
        track.group.add(track.vehicle);
        this.scene.add(track.group);
      }
      this.recolour();
    }

    lines(points, material) {
      const { THREE } = this;
      const geometry = new THREE.BufferGeometry();
      geometry.setAttribute("position", new THREE.BufferAttribute(new Float32Array(points), 3));
      return new THREE.LineSegments(geometry, material);
    }

    /** A vehicle with its arms and rotors, and a cone to its nose; of a reference a ball. */
    vehicle(track, rotors, arm, scale) {
      const { THREE } = this;
      const group = new THREE.Group();
      if (!track.attitude) {
        group.add(new THREE.Mesh(new THREE.SphereGeometry(0.25 * arm), track.paint));
      } else {
        const apart = rotors.slice(1).map(([x, y]) => Math.hypot(x - rotors[0][0], y - rotors[0][1]));
        const rotor = 0.45 * Math.min(arm, ...apart);
        for (const [x, y] of rotors) {
          const length = Math.hypot(x, y);
          const beam = new THREE.Mesh(new THREE.BoxGeometry(length, 0.07 * arm, 0.07 * arm), track.paint);
          beam.position.set(x / 2, y / 2, 0);
          beam.rotation.z = Math.atan2(y, x);
          const ring = new THREE.Mesh(new THREE.TorusGeometry(rotor, 0.05 * arm, 6, 24), track.paint);
          ring.position.set(x, y, 0.08 * arm);
          group.add(beam, ring);
        }
        const nose = new THREE.Mesh(new THREE.ConeGeometry(0.16 * arm, 0.5 * arm, 12), track.paint);
        nose.rotation.z = -Math.PI / 2;
        nose.position.set(0.45 * arm, 0, 0);
        group.add(nose);
      }
      group.scale.setScalar(scale);
      return group;
    }

    recolour() {
      const { THREE } = this;
      this.legend.show();
      this.scene.background = new THREE.Color(ink("--paper"));
      this.floor.material.color.set(ink("--faint"));
      for (const { sprite, text } of this.labels) {
        const canvas = element("canvas", { width: "512", height: "128" });
        const context = canvas.getContext("2d");
        context.font = "64px system-ui, sans-serif";
        context.fillStyle = ink("--quiet");
        context.textAlign = "center";
        context.fillText(text, 256, 88, 512);
        sprite.material.map?.dispose();
        sprite.material.map = new THREE.CanvasTexture(canvas);
        sprite.material.needsUpdate = true;
      }
      for (const track of this.tracks) {
        track.material.color.set(shade(track.colors));
        track.paint.color.set(shade(track.colors));
      }
      this.draw();
    }

    resize() {
      const { clientWidth: width, clientHeight: height } = this.space;
      if (!width || !height) return;
      const ratio = Math.min(devicePixelRatio, 2);
      Object.assign(this.canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
      this.camera.aspect = width / height;
      this.camera.updateProjectionMatrix();
      // Until a reader turns the view.
      if (!this.moved) this.frame();
      this.draw();
    }

    /** Moves the camera to where all is seen as large as it fits. */
    frame() {
      const { camera, controls, floorCorners, ways, extent } = this;
      const along = FRAMED * Math.tan(Math.PI / 360 * camera.fov);
      const { position, middle } = bestSide(ways, floorCorners, [along * camera.aspect, along], extent / 4);
      camera.position.set(...position);
      controls.target.set(...middle);
      controls.update();
    }

    draw() {
      const { canvas: { width, height }, scene, camera } = this;
      Space.renderer.setSize(width, height, false);
      Space.renderer.render(scene, camera);
      this.canvas.getContext("2d").drawImage(Space.renderer.domElement, 0, 0);
    }

    /** Moves every vehicle to where it was. */
    place(time) {
      const { THREE } = this;
      for (const track of this.tracks) {
        const { times, position, attitude, vehicle } = track;
        const at = Math.min(Math.max(time, times[0] ?? 0), times[times.length - 1] ?? 0);
        vehicle.position.set(...position.map((values) => between(times, values, at) ?? 0));
        if (!attitude || !times.length) continue;
        const i = before(times, at), next = Math.min(i + 1, times.length - 1);
        const angles = (k) => new THREE.Euler(...attitude.map((values) => values[k]), "ZYX");
        const turn = (k) => new THREE.Quaternion().setFromEuler(angles(k));
        const span = times[next] - times[i];
        vehicle.quaternion.copy(turn(i)).slerp(turn(next), span > 0 ? (at - times[i]) / span : 0);
      }
      this.time = time;
      this.slider.value = time;
      this.output.textContent = seconds(time);
      this.draw();
    }

    start() {
      const { shared, data } = this;
      this.running = true;
      this.play.textContent = "⏸ pause";
      let time = this.time >= data.end_s ? 0 : this.time, last = performance.now();
      const step = (now) => {
        if (!this.running) return;
        time = Math.min(time + (now - last) / 1000 * Number(this.speed.value), data.end_s);
        last = now;
        shared.setTime(time, null);
        if (time >= data.end_s) this.stop(); else requestAnimationFrame(step);
      };
      requestAnimationFrame(step);
    }

    stop() {
      this.running = false;
      this.play.textContent = "▶ play";
    }

    showTime(time) { if (time !== null) this.place(Math.min(time, this.data.end_s)); }
    showWindow() {}
    showHidden() {
      this.legend.show();
      for (const track of this.tracks) track.group.visible = !this.shared.hidden.has(track.name);
      this.place(this.time);
    }
  }

  const kinds = { chart: [Chart, "uPlot"], scene: [Space, "THREE"] };

  /** Draws a figure anew; its picture stays if that fails. */
  async function explore(node, shared) {
    const [Kind, name] = kinds[node.dataset.explore];
    const figure = node.closest("figure");
    const host = element("div", { class: "explored" });
    try {
      const [library_, data] = await Promise.all([library(name), unpacked(node.textContent).then(JSON.parse)]);
      figure.classList.add("explorable");
      node.after(host);
      if (data.end_s > shared.end) { shared.end = shared.to = data.end_s; }
      const view = new Kind(data, host, shared, library_);
      shared.add(view, data.end_s);
      dark.addEventListener("change", () => view.recolour());
      figure.dataset.explored = "";
    } catch (error) {
      host.remove();
      figure.classList.remove("explorable");
      console.error(`a figure stays a picture: ${error.stack ?? error}`);
    }
  }

  // Figures under one heading belong together; each is drawn when it comes near.
  let shared = new Shared();
  const waiting = new Map();
  const seen = new IntersectionObserver((entries) => {
    for (const { target, isIntersecting } of entries) {
      if (!isIntersecting || !waiting.has(target)) continue;
      seen.unobserve(target);
      explore(...waiting.get(target));
      waiting.delete(target);
    }
  }, { rootMargin: "600px" });
  for (const node of document.querySelectorAll("h2, [data-explore]")) {
    if (node.tagName === "H2") { shared = new Shared(); continue; }
    const figure = node.closest("figure");
    waiting.set(figure, [node, shared]);
    seen.observe(figure);
  }
})();

// Charts over time, with one cursor for all.
import { label, roomy, ticked } from "./fit.js";
const { uPlot } = globalThis;

const WINDOW_S = 60;
const EVERY_S = 0.1;
/** Least time between the ends of a chart, and the height of all of it. */
const LEAST_S = 1;
const HEIGHT_PX = 150;
const style = (name) => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
const minus = (a, b) => a.map((value, i) => value - b[i]);
const three = (of) => ["x", "y", "z"].map((name, i) => [name, (frame) => of(frame)?.[i] ?? null]);
const sigmas = (estimate) => estimate?.valid && estimate.position_sigma_m.map((sigma) => 3 * sigma);
const angles = (of) => ["roll", "pitch", "yaw"].map((name, i) => [name, (frame) => of(frame)?.[i] ?? null]);
const axes = (of) =>
  ["roll", "pitch", "yaw", "z", "x", "y"].map((name, i) => [
    name,
    (frame) => of(frame.adaptation.axes[i] ?? {}) ?? null,
  ]);

/** A number of three digits. */
const short = (number) => {
  const rounded = Number(number.toPrecision(3));
  return label(rounded, rounded === 0 ? 2 : Math.max(2 - Math.floor(Math.log10(Math.abs(rounded))), 0));
};
/** Title, unit, least range of values, and series, each a name and what it shows of a frame. */
const charts = (hello) => [
  ["Position error", "m", 0.01, three((f) => f.reference && minus(f.reference.position_m, f.truth.position_m))],
  ["Attitude error e1", "rad", 0.01, axes((axis) => axis.e1).slice(0, 3)],
  ["Attitude", "rad", 0.01, angles((f) => f.truth.attitude_rad)],
  ["Velocity", "m/s", 0.01, three((f) => f.truth.velocity_m_s)],
  ["Estimate's error", "m", 0.01, three((f) => f.estimate?.valid && minus(f.truth.position_m, f.estimate.position_m))],
  ["3 sigma of the estimate", "m", 0.01, three((f) => sigmas(f.estimate))],
  ["Rotor speeds", "rad/s", 10, hello.rotors.map((_, i) => [`${i + 1}`, (f) => f.rotors[i]?.speed_rad_s ?? null])],
  ["Battery", "V", 0.1, [["voltage", (f) => f.battery?.voltage_v ?? null]]],
  ["|Theta_hat|", "input's unit", 0.01, axes((axis) => axis.theta_norm)],
  ["V", "", 0.001, [["sum", (f) => f.adaptation.lyapunov], ...axes((axis) => axis.lyapunov)]],
];

export class Charts {
  constructor(parent) {
    this.parent = parent;
    this.last = -Infinity;
    matchMedia("(prefers-color-scheme: dark)").addEventListener("change", () => this.draw());
    let width = 0;
    new ResizeObserver(() => {
      if (parent.clientWidth !== width) {
        width = parent.clientWidth;
        this.resize();
      }
    }).observe(parent);
  }

  hello(hello) {
    this.shown = charts(hello).map(([title, unit, least, series]) => ({
      title,
      unit,
      least,
      series,
      data: [[], ...series.map(() => [])],
    }));
    this.last = -Infinity;
    this.draw();
  }

  draw() {
    if (!this.shown) return;
    this.parent.replaceChildren();
    for (const chart of this.shown) {
      const box = document.createElement("div");
      box.className = "chart";
      const title = document.createElement("h3");
      title.textContent = `${chart.title} `;
      const unit = document.createElement("span");
      unit.textContent = chart.unit && `[${chart.unit}]`;
      title.append(unit);
      box.append(title);
      this.parent.append(box);
      const axis = {
        stroke: style("quiet"),
        grid: { stroke: style("line"), width: 1 },
        ticks: { stroke: style("line"), width: 1 },
      };
      const value = (_, number) => (number === null || number === undefined ? "–" : short(number));
      chart.box = box;
      chart.plot = new uPlot(
        {
          width: Math.max(box.clientWidth - 8, 200),
          height: HEIGHT_PX,
          scales: {
            x: { time: false, range: (_, from, to) => [from ?? 0, Math.max(to ?? 0, (from ?? 0) + LEAST_S)] },
            y: { range: (_, low, high) => roomy(low ?? 0, high ?? 0, chart.least) },
          },
          cursor: { sync: { key: "time" }, drag: { x: false, y: false } },
          legend: { live: true },
          axes: [
            { ...axis, ...ticked(50, "width"), size: 26 },
            { ...axis, ...ticked(28, "height"), size: 58 },
          ],
          series: [
            { label: "t", value: (_, t) => (t === null ? "–" : `${t.toFixed(1)} s`) },
            ...chart.series.map(([label], i) => ({
              label,
              stroke: style(`s${i + 1}`),
              width: 1.4,
              points: { show: false },
              value,
            })),
          ],
        },
        chart.data,
        box,
      );
    }
  }

  resize() {
    for (const { plot, box } of this.shown ?? []) {
      plot?.setSize({ width: Math.max(box.clientWidth - 8, 200), height: HEIGHT_PX });
    }
  }

  show(frame) {
    if (!this.shown || frame.time_s - this.last < EVERY_S) return;
    this.last = frame.time_s;
    for (const chart of this.shown) {
      const [times, ...columns] = chart.data;
      times.push(frame.time_s);
      columns.forEach((column, i) => column.push(chart.series[i][1](frame)));
      while (times[0] < frame.time_s - WINDOW_S) chart.data.forEach((column) => column.shift());
      chart.plot.setData(chart.data);
      // What is newest, unless something is pointed at.
      if (!(chart.plot.cursor.left >= 0)) chart.plot.setLegend({ idx: times.length - 1 }, false);
    }
  }
}

// How much is seen: the range and the ticks of an axis, and where a camera stands. Modules import these functions; the
// plain script of a report takes the text before the last line.

/** Range of an axis around values from `low` to `high`: with room on both sides, and never narrower than `least`. */
function roomy(low, high, least) {
  const [span, size] = [high - low, Math.max(Math.abs(low), Math.abs(high))];
  const room = Math.max(0.06 * span, 0.5 * (least - span), 1e-3 * size);
  return [low - room, high + room];
}

/** Ticks of an axis from `low` to `high`: multiples of 1, 2 or 5 times a power of ten, about `apart` of the axis from
 * each other, but two at least; and the decimals that tell them from each other. */
function ticks(low, high, apart) {
  const span = high - low;
  if (!(span > 0) || !Number.isFinite(span)) return { at: [], decimals: 0 };
  const step = (n) => [1, 2, 5][((n % 3) + 3) % 3] * 10 ** Math.floor(n / 3);
  let n = 3 * Math.floor(Math.log10(apart * span));
  while (step(n) < apart * span) n += 1;
  // An end that is a multiple itself counts in spite of rounding.
  const multiples = () => [Math.ceil(low / step(n) - 1e-9), Math.floor(high / step(n) + 1e-9)];
  let [first, last] = multiples();
  while (last - first < 1) {
    n -= 1;
    [first, last] = multiples();
  }
  const decimals = Math.min(Math.max(-Math.floor(n / 3), 0), 100);
  const tick = (_, i) => Number(((first + i) * step(n)).toFixed(decimals));
  return { at: Array.from({ length: last - first + 1 }, tick), decimals };
}

/** A number with so many decimals as text: with a minus sign, and a power of ten where it would be long. */
function label(number, decimals) {
  const isLong = number !== 0 && (Math.abs(number) >= 1e5 || decimals > 5);
  const text = isLong
    ? Number(number.toPrecision(12)).toExponential().replace("e+", "e")
    : number.toFixed(Math.min(decimals, 5));
  return /[1-9]/.test(text) ? text.replaceAll("-", "−") : text.replace("-", "");
}

/** Where a camera that looks along `forward` stands to see all `points` ([x, y, z]) as large as they fit: its position,
 * and the middle of what it sees, straight before it. `right` and `up` are its other axes; the tangents are those of
 * half of its angles of view, less the margin that is to stay free. It stays `nearest` away from every point. */
function stand(points, { right, up, forward }, [across, along], nearest) {
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const extremes = { right: [-Infinity, Infinity], up: [-Infinity, Infinity], near: Infinity, far: -Infinity };
  for (const point of points) {
    const depth = dot(point, forward);
    // The four planes of the view, moved until they touch the outermost point.
    for (const [name, axis, tangent] of [["right", right, across], ["up", up, along]]) {
      const side = dot(point, axis);
      extremes[name][0] = Math.max(extremes[name][0], side - tangent * depth);
      extremes[name][1] = Math.min(extremes[name][1], side + tangent * depth);
    }
    extremes.near = Math.min(extremes.near, depth);
    extremes.far = Math.max(extremes.far, depth);
  }
  const depth = Math.min(
    (extremes.right[1] - extremes.right[0]) / (2 * across),
    (extremes.up[1] - extremes.up[0]) / (2 * along),
    extremes.near - nearest,
  );
  const place = (sides) => 0.5 * (sides[0] + sides[1]);
  const at = (distance) =>
    [0, 1, 2].map((i) => place(extremes.right) * right[i] + place(extremes.up) * up[i] + distance * forward[i]);
  return { position: at(depth), middle: at(0.5 * (extremes.near + extremes.far)) };
}

/** Axes of a camera that looks at the middle from an azimuth and an elevation [rad]; z is up. */
function looking(azimuth, elevation) {
  const [sin, cos, rise, level] = [Math.sin(azimuth), Math.cos(azimuth), Math.sin(elevation), Math.cos(elevation)];
  return {
    forward: [-cos * level, -sin * level, -rise],
    right: [-sin, cos, 0],
    up: [-cos * rise, -sin * rise, level],
  };
}

/** Share of a view, across and along, that `points` take; the view as for `stand`, from `position`. */
function filled(points, position, { right, up, forward }, tangents) {
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  const ends = [right, up].map(() => [Infinity, -Infinity]);
  for (const point of points) {
    const off = [0, 1, 2].map((i) => point[i] - position[i]);
    const depth = dot(off, forward);
    [right, up].forEach((axis, i) => {
      const share = dot(off, axis) / (2 * tangents[i] * depth);
      ends[i] = [Math.min(ends[i][0], share), Math.max(ends[i][1], share)];
    });
  }
  return ends.map(([low, high]) => high - low);
}

/** Sides from which a view is tried, and its height [rad]. */
const SIDES = 12;
const ELEVATION = 0.41;

/** Where a camera stands as by `stand` to see `ways` and what is `beside` them, on that side from which the ways fill
 * most of the view; on the front right side where that is as good as any. */
function bestSide(ways, beside, tangents, nearest) {
  let [best, most] = [null, 0];
  for (let i = 0; i < SIDES; i += 1) {
    const axes = looking(-0.9 + (2 * Math.PI * i) / SIDES, ELEVATION);
    const stood = stand([...beside, ...ways], axes, tangents, nearest);
    const [across, along] = filled(ways, stood.position, axes, tangents);
    if (!best || across * along > 1.1 * most) [best, most] = [stood, across * along];
  }
  return best;
}

/** Ticks of an axis of uPlot's, about `apart` pixels from each other along its width or height. */
function ticked(apart, along) {
  const of = (plot, low, high) => ticks(low, high, (apart * devicePixelRatio) / plot.bbox[along]);
  return {
    splits: (plot, _, low, high) => of(plot, low, high).at,
    values: (plot, at, axis) => {
      const { min, max } = plot.scales[axis ? "y" : "x"];
      const { decimals } = of(plot, min, max);
      return at.map((number) => label(number, decimals));
    },
  };
}

export { bestSide, filled, label, looking, roomy, stand, ticked, ticks };

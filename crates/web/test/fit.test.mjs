// Properties of the page's ranges, ticks and cameras: node --test crates/web/test/fit.test.mjs
import assert from "node:assert/strict";
import { test } from "node:test";
import { filled, label, looking, roomy, stand, ticks } from "../page/fit.js";

/** Numbers from 0 to 1, the same in each run (mulberry32). */
const random = ((state) => () => {
  state = (state + 0x6d2b79f5) | 0;
  let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
  mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
  return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
})(25);
const between = (low, high) => low + (high - low) * random();
const times = (count, act) => Array.from({ length: count }, act);

test("every axis has two ticks or more, within it, with labels of their own", () => {
  times(50_000, () => {
    const span = 10 ** between(-9, 9);
    const low = between(-1, 1) * span * 10 ** between(-2, 6) * (random() < 0.2 ? 0 : 1);
    const apart = between(0.05, 0.95);
    const { at, decimals } = ticks(low, low + span, apart);
    const told = JSON.stringify([low, span, apart, at]);
    assert.ok(at.length >= 2 && at.length <= Math.max(1 / apart + 1.001, 5), told);
    assert.ok(at.every((tick) => tick >= low - 1e-6 * span && tick <= low + 1.000001 * span), told);
    assert.equal(new Set(at.map((tick) => label(tick, decimals))).size, at.length, told);
  });
  for (const [low, high] of [[1, 1], [NaN, 1], [0, Infinity]]) assert.deepEqual(ticks(low, high, 0.2).at, []);
});

test("an axis has room around its values, and around a constant a range of its size", () => {
  times(10_000, () => {
    const low = between(-1, 1) * 10 ** between(-6, 6);
    const span = random() < 0.5 ? 0 : 10 ** between(-6, 6);
    const least = 10 ** between(-4, 1);
    const [from, to] = roomy(low, low + span, least);
    assert.ok(from < low && to > low + span && to - from >= 0.999 * least);
    assert.ok(to - from <= 1.2 * Math.max(span, least) + 2.1e-3 * Math.max(Math.abs(low), Math.abs(low + span)));
  });
});

test("numbers are typeset", () => {
  const numbers = [[-0.5, 1], [-0.001, 1], [2e6, 0], [1.5e-7, 8], [0, 9], [12, 0]];
  const labels = numbers.map(([number, decimals]) => label(number, decimals));
  assert.deepEqual(labels, ["−0.5", "0.0", "2e6", "1.5e−7", "0.00000", "12"]);
});

test("a camera sees any path whole, and as large as fits", () => {
  const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
  times(3_000, () => {
    const axes = looking(between(-Math.PI, Math.PI), between(-1.5, 1.5));
    const tangents = [between(0.1, 2), between(0.1, 2)];
    const sizes = times(3, () => (random() < 0.2 ? 0 : 10 ** between(-2, 4)));
    const from = times(3, () => between(-1e4, 1e4));
    const place = () => from.map((value, i) => value + sizes[i] * between(-1, 1));
    const points = times(2 + Math.floor(between(0, 40)), place);
    const size = Math.max(...sizes, 1e-3);
    const nearest = between(0, 1) * size;
    const { position, middle } = stand(points, axes, tangents, nearest);
    let near = Infinity;
    const seen = points.map((point) => {
      const off = point.map((value, i) => value - position[i]);
      const depth = dot(off, axes.forward);
      near = Math.min(near, depth);
      return [dot(off, axes.right) / (tangents[0] * depth), dot(off, axes.up) / (tangents[1] * depth)];
    });
    assert.ok(near > nearest - 1e-6 * size, `${near} m away, ${nearest} asked for`);
    if (near > 1e-3 * size) assert.ok(seen.flat().every((at) => Math.abs(at) <= 1 + 1e-5), JSON.stringify(seen));
    // Closer it may not come, or it fills the view from edge to edge.
    const fill = Math.max(...filled(points, position, axes, tangents));
    assert.ok(near < nearest + 1e-6 * size || fill > 1 - 1e-4, `it fills ${fill} of the view`);
    // It looks along its axis.
    const aim = middle.map((value, i) => value - position[i]);
    assert.ok(Math.abs(dot(aim, axes.right)) + Math.abs(dot(aim, axes.up)) < 1e-6 * (1 + 1e4));
  });
});

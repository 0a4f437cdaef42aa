// Explores reports in a real browser:
//
//   node report.mjs SHOTS FLOWN SUITE RANDOM COMPARED
//
// with the reports (report.html) of `sitl fly`, of `sitl compare --suite`, of the suite `random`, and of `sitl compare`
// with six seeds or more.
//
// Screenshots go to SHOTS.
import assert from "node:assert/strict";
import { statSync } from "node:fs";
import { pathToFileURL } from "node:url";
import puppeteer from "puppeteer-core";

const [shots, flown, suite, random, compared] = process.argv.slice(2);
const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-sandbox"],
});
const page = await browser.newPage();
const errors = [], asked = [];
page.on("console", (message) => ["error", "warn"].includes(message.type()) && errors.push(message.text()));
page.on("pageerror", (error) => errors.push(String(error)));
page.on("request", (request) => asked.push(request.url()));

let passed = 0;
const step = async (name, act) => {
  try {
    await act();
  } catch (error) {
    await page.screenshot({ path: `${shots}/report-failed.png` });
    console.error(`${name}: ${error.stack}\n${errors.join("\n")}`);
    console.log(`${passed} passed, 1 failed`);
    await browser.close();
    process.exit(1);
  }
  passed += 1;
  console.log(`ok ${name}`);
};
const media = (scheme) => page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
/** Waits until a figure is drawn anew, and returns it. */
const figure = async (index) => {
  const figures = await page.$$("figure:has([data-explore])");
  const one = figures.at(index);
  await one.evaluate((node) => node.scrollIntoView({ block: "start" }));
  await page.waitForFunction((node) => node.dataset.explored !== undefined, { timeout: 20000 }, one);
  await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  return one;
};
const pixels = (one) => one.$eval("canvas", (canvas) => canvas.toDataURL());
const titled = (one, title) => one.$(`button[title='${title}']`);
const shown = (one) => one.$$eval(".values", (all) => all.filter((node) => !node.hidden).map((node) => node.innerText));
const open = (file) => page.goto(pathToFileURL(file).href);
const FLIGHTS = 0, OUTPUTS = 1, ERRORS = 3;

await page.setViewport({ width: 1100, height: 900 });
await media("light");
await step("a minute's flight of eight laws is under 2 MB, and asks for nothing", async () => {
  assert.ok(statSync(flown).size < 2e6, `${statSync(flown).size} bytes`);
  await open(flown);
  for (let index = 0; index < await page.$$eval("[data-explore]", (all) => all.length); index++) await figure(index);
  assert.deepEqual(asked.filter((url) => !url.startsWith("file:") && !url.startsWith("blob:")), []);
});

await step("charts zoom and pan together, and show all again", async () => {
  const [outputs, wrong] = [await figure(OUTPUTS), await figure(ERRORS)];
  const before = await Promise.all([pixels(outputs), pixels(wrong)]);
  await (await titled(wrong, "zoom in")).click();
  const zoomed = await Promise.all([pixels(outputs), pixels(wrong)]);
  assert.ok(before.every((picture, i) => picture !== zoomed[i]), "both zoom");
  await (await titled(wrong, "later")).click();
  assert.ok(await pixels(outputs) !== zoomed[0], "both pan");
  await (await titled(outputs, "all of the time")).click();
  const after = await Promise.all([pixels(outputs), pixels(wrong)]);
  assert.ok(before.every((picture, i) => picture === after[i]), "all is seen again");
});

await step("a drag zooms into an interval", async () => {
  const wrong = await figure(ERRORS);
  const before = await pixels(wrong);
  const { x, y } = await (await wrong.$(".u-over")).boundingBox();
  await page.mouse.move(x + 200, y + 40);
  await page.mouse.down();
  await page.mouse.move(x + 300, y + 40, { steps: 4 });
  await page.mouse.up();
  assert.ok(await pixels(wrong) !== before, "zoomed");
  await (await titled(wrong, "all of the time")).click();
  assert.ok(await pixels(wrong) === before, "all is seen again");
});

await step("values show under the cursor and by arrow keys, and the vehicles move along", async () => {
  const [wrong, flights] = [await figure(ERRORS), await figure(FLIGHTS)];
  const slider = () => flights.$eval("input[type=range]", (node) => Number(node.value));
  await wrong.evaluate((node) => node.scrollIntoView({ block: "start" }));
  const { x, y, width } = await (await wrong.$(".u-over")).boundingBox();
  await page.mouse.move(x + width / 2, y + 40);
  const [values] = await shown(wrong);
  const rows = values.split("\n").length;
  assert.ok(rows >= 9 && /\b(29|30)\.\d\d s/.test(values), values);
  assert.ok(Math.abs(await slider() - 30) < 1.5, "the slider follows the cursor");
  await page.mouse.move(x, y - 60);
  await (await wrong.$(".panel")).focus();
  const at = await slider();
  for (let press = 0; press < 10; press++) await page.keyboard.press("ArrowRight");
  assert.ok(Math.abs(await slider() - at - 60 / 20) < 0.1, `${at} ${await slider()}`);
  assert.ok((await shown(wrong))[0].includes("AFBC"));
});

await step("a contender that is hidden is hidden everywhere", async () => {
  const [outputs, wrong] = [await figure(OUTPUTS), await figure(ERRORS)];
  const press = (one) => one.evaluate((node) => [...node.querySelectorAll("button[aria-pressed]")]
    .find((button) => button.innerText.includes("backstepping")).click());
  const before = await pixels(outputs);
  await press(wrong);
  assert.ok(await pixels(outputs) !== before, "hidden");
  await press(outputs);
  assert.ok(await pixels(outputs) === before, "shown again");
});

await step("flights in space fill their frame, in every shape of it", async () => {
  for (const [width, height] of [[1100, 900], [390, 844], [2000, 500]]) {
    await page.setViewport({ width, height });
    const flights = await figure(FLIGHTS);
    const seen = () => flights.$eval(".space canvas", (canvas) => {
      // Of a copy: a canvas that is read again and again makes the browser warn.
      const { width, height } = canvas;
      const context = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d");
      context.drawImage(canvas, 0, 0);
      // What differs from the paper in the corner: ways, floor, vehicles.
      const pixels = new Uint32Array(context.getImageData(0, 0, width, height).data.buffer);
      const [across, along] = [new Set(), new Set()];
      pixels.forEach((pixel, i) => {
        if (pixel === pixels[0]) return;
        across.add(i % canvas.width);
        along.add(Math.floor(i / canvas.width));
      });
      const extent = (all) => Math.max(...all) - Math.min(...all);
      return [extent(across) / canvas.width, extent(along) / canvas.height];
    });
    await page.waitForFunction((node, wide) => innerWidth === wide && node.querySelector("canvas").width > 0, {},
      flights, width);
    const [across, along] = await seen();
    assert.ok(Math.max(across, along) > 0.8, `${width} by ${height}: ${across} across, ${along} along`);
    assert.ok(Math.max(across, along) <= 1);
  }
  await page.setViewport({ width: 1100, height: 900 });
});

await step("flights are flown again in space", async () => {
  const flights = await figure(FLIGHTS);
  const colours = await flights.$eval("canvas", (canvas) => {
    const copy = Object.assign(document.createElement("canvas"), { width: 300, height: 200 });
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0, 300, 200);
    return new Set(new Uint32Array(context.getImageData(0, 0, 300, 200).data.buffer)).size;
  });
  assert.ok(colours > 20, `${colours} colours`);
  const place = (time) => flights.$eval("input[type=range]", (node, to) => {
    node.value = to;
    node.dispatchEvent(new Event("input"));
  }, time);
  await place(5);
  const early = await pixels(flights);
  await place(25);
  assert.ok(await pixels(flights) !== early, "moved");
  await place(0);
  await flights.$eval("button:not([aria-pressed])", (button) => button.click());
  await page.waitForFunction((node) => Number(node.querySelector("input[type=range]").value) > 0.3, {}, flights);
  await flights.$eval("button:not([aria-pressed])", (button) => button.click());
  await page.screenshot({ path: `${shots}/report-space.png` });
});

await step("in the dark it is dark, and on a phone nothing is cut off", async () => {
  const wrong = await figure(ERRORS);
  const before = await pixels(wrong);
  await media("dark");
  await page.waitForFunction((node, light) => node.querySelector("canvas").toDataURL() !== light, {}, wrong, before);
  await page.screenshot({ path: `${shots}/report-dark.png` });
  await page.setViewport({ width: 390, height: 800 });
  await page.waitForFunction(() => document.documentElement.scrollWidth <= innerWidth);
  await page.screenshot({ path: `${shots}/report-phone.png` });
  await page.setViewport({ width: 1100, height: 900 });
  await media("light");
});

await step("on paper, and without JavaScript, there are the pictures", async () => {
  const visible = () => page.$$eval("figure:has([data-explore])", (figures) => figures.map((one) =>
    [one.querySelector("svg").getBoundingClientRect().height > 50,
      (one.querySelector(".explored")?.getBoundingClientRect().height ?? 0) > 0]));
  await page.emulateMediaType("print");
  assert.ok((await visible()).every(([picture, explored]) => picture && !explored), JSON.stringify(await visible()));
  await page.emulateMediaType("screen");
  assert.ok((await visible()).every(([picture, explored]) => !picture && explored));
  await page.setJavaScriptEnabled(false);
  await open(flown);
  assert.ok((await visible()).every(([picture, explored]) => picture && !explored));
  await page.setJavaScriptEnabled(true);
});

await step("the page of a suite shows where every law stands", async () => {
  await open(suite);
  const cells = await page.$$eval(".heat tbody:first-of-type td", (all) => all.map((cell) => cell.innerText));
  assert.ok(cells.length >= 80 && cells.filter((cell) => cell === "1").length >= 20, `${cells.length}`);
  await page.screenshot({ path: `${shots}/report-suite.png` });
  await page.click(".heat a");
  await figure(0);
});

/** Colours in the picture of a scene; of a copy, since a canvas that is read again makes the browser warn. */
const colours = (canvas) => {
  const { width, height } = canvas;
  const context = Object.assign(document.createElement("canvas"), { width, height }).getContext("2d");
  context.drawImage(canvas, 0, 0);
  return new Set(new Uint32Array(context.getImageData(0, 0, width, height).data.buffer)).size;
};

await step("a suite's flights are flown again in space, more than a browser has contexts", async () => {
  const count = await page.$$eval("[data-explore]", (all) => all.length);
  for (let index = 0; index < count; index++) await figure(index);
  const seen = await page.$$eval(".space canvas", (all, colours) => all.map(eval(colours)), `(${colours})`);
  assert.ok(seen.length > 20 && seen.every((colours) => colours > 20), `${seen}`);
  const scene = await page.$("figure:has(.space)");
  await scene.evaluate((node) => node.scrollIntoView({ block: "center" }));
  const start = await pixels(scene);
  await scene.$eval("input[type=range]", (slider) => {
    slider.value = slider.max / 2;
    slider.dispatchEvent(new Event("input"));
  });
  assert.notEqual(await pixels(scene), start);
  await page.screenshot({ path: `${shots}/report-suite-space.png` });
});

await step("of drawn flights those that tell most are flown again", async () => {
  await open(random);
  const count = await page.$$eval("[data-explore]", (all) => all.length);
  for (let index = 0; index < count; index++) await figure(index);
  const seen = await page.$$eval(".space canvas", (all, colours) => all.map(eval(colours)), `(${colours})`);
  assert.ok(seen.length === 6 && seen.every((colours) => colours > 20), `${seen}`);
  await page.screenshot({ path: `${shots}/report-random.png` });
});

await step("a comparison's tables are as wide as their page, intervals and all", async () => {
  await open(compared);
  const tables = await page.$$eval(".scroll:has(td small)", (all) =>
    all.map(({ scrollWidth, clientWidth }) => [scrollWidth, clientWidth]));
  assert.ok(tables.length >= 2 && tables.every(([wide, room]) => wide <= room), JSON.stringify(tables));
  await page.screenshot({ path: `${shots}/report-compare.png` });
});

assert.deepEqual(errors, []);
console.log(`${passed} passed, 0 failed`);
await browser.close();

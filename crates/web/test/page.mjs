// Flies the vehicle in a real browser, by the page, with either engine:
//
//   node page.mjs SHOTS playground FILE CSV     the page as one file; its flight of CSV, bit for bit
//   node page.mjs SHOTS server URL              the page of `sitl serve --web`
//
// CSV is what `sitl fly outdoor --controller afbc` has written. Screenshots go to SHOTS.
import assert from "node:assert/strict";
import { readFile } from "node:fs/promises";
import { pathToFileURL } from "node:url";
import puppeteer from "puppeteer-core";

const [shots, engine, address, csv] = process.argv.slice(2);
const browser = await puppeteer.launch({
  executablePath: process.env.CHROMIUM ?? "/usr/bin/chromium",
  // Each message of a socket would come here, too.
  networkEnabled: false,
  args: ["--no-sandbox", "--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--disable-gpu-sandbox"],
});
const page = await browser.newPage();
const errors = [];
page.on("console", (message) => ["error", "warn"].includes(message.type()) && errors.push(message.text()));
page.on("pageerror", (error) => errors.push(String(error)));

let passed = 0;
const begun = Date.now();
const step = async (name, act) => {
  try {
    await act();
  } catch (error) {
    await page.screenshot({ path: `${shots}/${engine}-failed.png` });
    const texts = await page.evaluate(() => document.getElementById("texts")?.innerText ?? "");
    console.error(`${name}: ${error.message}\n${texts}\n${errors.join("\n")}`);
    console.log(`${passed} passed, 1 failed`);
    await browser.close();
    process.exit(1);
  }
  passed += 1;
  console.log(`ok ${name} (${((Date.now() - begun) / 1000).toFixed(1)} s)`);
};
const until = (condition, what, ...given) =>
  page
    .waitForFunction(condition, { timeout: 40000, polling: 50 }, ...given)
    .catch(() => assert.fail(`waited in vain: ${what}`));
const frame = () => page.evaluate(() => globalThis.page.frame);
const media = (scheme) => page.emulateMediaFeatures([{ name: "prefers-color-scheme", value: scheme }]);
const later = async (seconds) => {
  const { time_s: now } = await frame();
  await until((then) => globalThis.page.frame.time_s > then, `${seconds} s`, now + seconds);
};
const put = (id, value) =>
  page.$eval(
    `#${id}`,
    (field, to) => {
      field.value = to;
      field.dispatchEvent(new Event("input", { bubbles: true }));
      field.dispatchEvent(new Event("change", { bubbles: true }));
    },
    String(value),
  );
const click = (selector) => page.$eval(selector, (button) => button.click());
/** Number of colours of the canvas. */
const colours = () =>
  page.$eval("#scene", (canvas) => {
    const copy = Object.assign(document.createElement("canvas"), { width: 200, height: 120 });
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0, 200, 120);
    return new Set(new Uint32Array(context.getImageData(0, 0, 200, 120).data.buffer)).size;
  });

/** Corners of what a whole view shows, on the screen: -1 to 1 across and along what is seen. */
const inView = () =>
  page.evaluate(() => {
    const { scene } = globalThis.page;
    const { Box3, Vector3 } = globalThis.THREE;
    const boxes = [scene.vehicle, scene.plan, scene.home].map((object) => new Box3().setFromObject(object));
    scene.camera.updateMatrixWorld();
    const corners = ({ min, max }) =>
      [min.x, max.x].flatMap((x) => [min.y, max.y].flatMap((y) => [min.z, max.z].map((z) => new Vector3(x, y, z))));
    return [...boxes, scene.trail.box]
      .filter((box) => !box.isEmpty())
      .flatMap(corners)
      .map((corner) => corner.project(scene.camera).toArray());
  });
/** Lines of the ground within this part of the canvas: how often neighbouring pixels differ, with the ground alone. */
const groundLines = (left, top, right, bottom) =>
  page.evaluate((...part) => {
    const { scene, canvas } = globalThis.page.scene;
    const others = scene.children.filter((object) => object !== globalThis.page.scene.ground && object.visible);
    for (const object of others) object.visible = false;
    globalThis.page.scene.draw();
    const copy = Object.assign(document.createElement("canvas"), { width: 400, height: 240 });
    const context = copy.getContext("2d");
    context.drawImage(canvas, 0, 0, 400, 240);
    for (const object of others) object.visible = true;
    const [x, y, u, v] = part.map((share, i) => Math.round(share * (i % 2 ? 240 : 400)));
    const { data } = context.getImageData(x, y, u - x, v - y);
    const pixels = new Uint32Array(data.buffer);
    return pixels.filter((pixel, i) => i > 0 && pixel !== pixels[i - 1]).length / pixels.length;
  }, left, top, right, bottom);

await media("light");
await page.setViewport({ width: 1280, height: 800 });
await step("the page opens and shows a vehicle", async () => {
  await page.goto(engine === "playground" ? pathToFileURL(address).href : address);
  await until(() => globalThis.page?.frame?.time_s > 0.2, "the first frame");
  assert.ok((await colours()) > 20, "the canvas is empty");
  assert.ok((await page.$$eval(".uplot canvas", (all) => all.length)) >= 8);
});
await step("the ground has lines near the vehicle, wherever that is", async () => {
  for (const [x, y, z, away] of [[0, 0, 1, 5], [300, -80, 2, 5], [0, 40, 60, 80], [0, 0, 0.5, 2]]) {
    await page.evaluate((place, far) => {
      const { camera, controls } = globalThis.page.scene;
      controls.target.set(...place);
      camera.position.set(place[0] - 0.7 * far, place[1] - 0.6 * far, place[2] + 0.4 * far);
      controls.update();
    }, [x, y, z], away);
    const share = await groundLines(0.2, 0.6, 0.8, 1);
    assert.ok(share > 0.02, `around ${[x, y, z]} from ${away} m: ${share}`);
  }
});
await step("the ellipsoid leaves a view of the vehicle, however large the uncertainty", async () => {
  for (const sigma of [1e-4, 0.02, 0.4, 3, 80]) {
    const [share, number] = await page.evaluate((size) => {
      const { scene } = globalThis.page;
      scene.setFollow(true);
      scene.showSigma({ position_m: scene.at, position_sigma_m: [size, size, 1.5 * size] });
      const radius = Math.max(...scene.estimate.scale.toArray());
      const distance = scene.camera.position.distanceTo(scene.controls.target);
      const half = Math.tan((scene.camera.fov * Math.PI) / 360) * Math.min(scene.camera.aspect, 1);
      return [radius / (half * distance), Number(document.getElementById("sigmas").textContent)];
    }, sigma);
    assert.ok(share < 0.65, `${sigma} m: ${share} of the view`);
    assert.ok(number <= 3 && (number === 3 || share > 0.1), `${sigma} m: ${number} sigma, ${share} of the view`);
  }
});
await step("every axis has two ticks or more, and what is constant lies within a narrow range", async () => {
  const axes = await page.evaluate(() =>
    globalThis.page.charts.shown.map(({ title, least, plot, data }) => {
      const values = data.slice(1).flat().filter((value) => value !== null);
      const { min, max } = plot.scales.y;
      const wide = Math.max(...values, 0) - Math.min(...values, 0);
      return { title, ticks: plot.axes.map(({ _splits }) => _splits?.length), span: max - min, least, wide };
    }),
  );
  for (const { title, ticks, span, least, wide } of axes) {
    assert.ok(ticks.every((count) => count >= 2), `${title}: ${ticks} ticks`);
    assert.ok(span <= Math.max(2 * least, 2 * wide), `${title}: from end to end ${span}, for values over ${wide}`);
  }
});
await step("it asks nobody but its own place", async () => {
  const own = engine === "playground" ? "file:" : new URL(address).origin;
  const asked = await page.evaluate(() => performance.getEntriesByType("resource").map(({ name }) => name));
  assert.deepEqual(
    asked.filter((url) => !url.startsWith("data:") && !url.startsWith(own)),
    [],
  );
});
if (csv) {
  await step("a whole flight of the command line, bit for bit", async () => {
    const { names, bits } = await page.evaluate(() => {
      const log = globalThis.fly("outdoor", "afbc");
      return { names: log.names(), bits: [...new BigUint64Array(log.rows().buffer)].map(String) };
    });
    const rows = new Float64Array(BigUint64Array.from(bits, BigInt).buffer);
    const [head, ...lines] = (await readFile(csv, "utf8"))
      .trim()
      .split("\n")
      .map((line) => line.split(","));
    assert.equal(rows.length, names.length * lines.length, "another number of rows");
    // The CSV writes single precision with the fewest digits that restore it.
    const single = (name) => /^omega|estimate/.test(name);
    let compared = 0;
    names.forEach((name, column) => {
      const place = head.indexOf(name);
      assert.ok(place >= 0, `${name} is no column`);
      lines.forEach((line, row) => {
        const [here, there] = [rows[row * names.length + column], Number(line[place])];
        assert.ok(
          Object.is(here, single(name) ? Math.fround(there) : there),
          `${name}, row ${row}: ${here}, ${there}`,
        );
        compared += 1;
      });
    });
    console.log(`   ${compared} numbers of ${lines.length} rows are the same to the last bit`);
  });
}
await step("it takes off by the keyboard", async () => {
  await put("speed", 5);
  await until(() => globalThis.page.frame.time_s > 14, "the estimate");
  await page.focus("#scene");
  await page.keyboard.press("t");
  await until(
    () => globalThis.page.frame.airborne && globalThis.page.frame.truth.position_m[2] > 3.5,
    "the take-off",
  );
  assert.ok((await colours()) > 20, "the canvas is empty");
});
await step("it flies where it is told", async () => {
  const {
    truth: {
      position_m: [x],
    },
  } = await frame();
  await put("go-x", x + 3);
  await click("#go");
  await until((to) => Math.abs(globalThis.page.frame.truth.position_m[0] - to) < 0.8, "the way north", x + 3);
});
await step("it flies where somebody clicks", async () => {
  const before = await frame();
  await put("click", "go");
  const canvas = await page.$("#scene");
  await canvas.scrollIntoView();
  const box = await canvas.boundingBox();
  await page.mouse.click(box.x + 0.25 * box.width, box.y + 0.62 * box.height);
  await until(
    ([x, y]) => {
      const [u, v] = globalThis.page.frame.truth.position_m;
      return Math.hypot(u - x, v - y) > 0.8;
    },
    "a move",
    before.truth.position_m,
  );
  await put("click", "look");
  await click('[data-command*="hold"]');
});
await step("a gust shows and pushes", async () => {
  await later(4);
  const before = await frame();
  await click("#gust");
  await until(
    (wind) => Math.hypot(...globalThis.page.frame.wind_m_s) > wind + 3,
    "the gust",
    Math.hypot(...before.wind_m_s),
  );
  await page.screenshot({ path: `${shots}/${engine}-light.png` });
  await until(
    ([x, y]) => {
      const [u, v] = globalThis.page.frame.truth.position_m;
      return Math.hypot(u - x, v - y) > 0.03;
    },
    "the push",
    before.truth.position_m,
  );
});
await step("every law takes over in mid-flight and holds", async () => {
  const laws = await page.$$eval("#laws option", (all) => all.map(({ value }) => value));
  assert.ok(laws.length >= 8);
  for (const law of [...laws.slice(1), "afbc"]) {
    await put("laws", law);
    await until((name) => globalThis.page.frame.law === name, law, law);
    await later(2);
    const {
      airborne,
      truth: {
        position_m: [, , z],
      },
    } = await frame();
    assert.ok(airborne && z > 0.8, `${law}: at ${z} m`);
  }
});
await step("payload, rotor fault and outage show, and are cleared", async () => {
  await click("#payload-take");
  await put("rotor-share", 0.85);
  await click("#rotor-fault");
  await click("#outages button");
  await until(
    () =>
      globalThis.page.frame.payload_kg > 0 &&
      globalThis.page.frame.faults.length === 2 &&
      /rotor/.test(document.getElementById("suffers").textContent),
    "its faults",
  );
  await click('[data-line="clear"]');
  await until(() => globalThis.page.frame.faults.length === 0, "a sound vehicle");
});
await step("time stands still and goes on", async () => {
  await page.focus("#scene");
  await page.keyboard.press("Space");
  await until(() => globalThis.page.frame.paused, "the pause");
  const { time_s: then } = await frame();
  await new Promise((done) => setTimeout(done, 300));
  assert.equal((await frame()).time_s, then);
  await page.keyboard.press("Space");
  await until((now) => globalThis.page.frame.time_s > now, "time", then);
});
await step("a whole view shows all, in every shape of the page", async () => {
  await click("#square");
  await until(() => globalThis.page.frame.fence.length === 1, "the plan");
  await click("#home-view");
  for (const [width, height] of [[1280, 800], [390, 844], [1900, 500], [900, 1200]]) {
    await page.setViewport({ width, height });
    await later(1);
    const corners = await inView();
    assert.ok(corners.length >= 24 && corners.every(([x, y, z]) => Math.abs(x) < 0.99 && Math.abs(y) < 0.99 && z < 1));
    const fill = Math.max(...corners.flatMap(([x, y]) => [Math.abs(x), Math.abs(y)]));
    assert.ok(fill > 0.6, `${width} by ${height}: it fills ${fill} of the view`);
  }
  await page.setViewport({ width: 1280, height: 800 });
  await click("#follow");
});
await step("a mission within a fence", async () => {
  await click("#square");
  await until(
    () => globalThis.page.frame.mission.length === 6 && globalThis.page.frame.fence.length === 1,
    "the plan",
  );
  await click('[data-command*="start_mission"]');
  await until(() => globalThis.page.frame.mode === "mission" && globalThis.page.frame.item > 1, "the mission");
  await media("dark");
  await later(2);
  await page.screenshot({ path: `${shots}/${engine}-dark.png` });
});
await step("lines are answered, and quit is not for pages", async () => {
  await page.focus("#line");
  await page.keyboard.type("quit\n");
  await until(() => /error quit/.test(document.getElementById("texts").innerText), "a refusal");
  await page.keyboard.type("nonsense\n");
  await until(() => /no such command/.test(document.getElementById("texts").innerText), "an error");
});
await step("what is done is not in red", async () => {
  await page.focus("#line");
  for (const text of ["fault barometer lost 1", "clear", "nonsense"]) await page.keyboard.type(`${text}\n`);
  await until(() => /no such command.*\s*$/.test(document.getElementById("texts").innerText), "the answers");
  const lines = await page.$$eval("#texts li", (all) => all.map(({ innerText, className }) => [innerText, className]));
  const said = (start) => lines.filter(([text]) => text.startsWith(start)).map(([, name]) => name);
  assert.deepEqual([...new Set(said("ok"))], [""]);
  assert.deepEqual([...new Set(said("error"))], ["error"]);
});
await step("it lands", async () => {
  await page.evaluate(() => document.activeElement.blur());
  await page.keyboard.press("l");
  await until(() => !globalThis.page.frame.armed, "the landing");
});
await step("no number and no choice is cut off", async () => {
  for (const [width, height] of [[1280, 800], [390, 844]]) {
    await page.setViewport({ width, height });
    const cut = await page.$$eval("main :is(input[type=number], select)", (fields) => {
      const pen = document.createElement("canvas").getContext("2d");
      return fields
        .filter((field) => {
          const style = getComputedStyle(field);
          pen.font = style.font;
          const texts = field.options ? [...field.options].map(({ text }) => text) : [field.value, field.max, "-12.5"];
          const inside = field.clientWidth - parseFloat(style.paddingLeft) - parseFloat(style.paddingRight);
          return Math.max(...texts.map((text) => pen.measureText(text).width)) > inside + 0.5;
        })
        .map((field) => `${field.id || field.ariaLabel}: ${field.value}`);
    });
    assert.deepEqual(cut, []);
  }
  await page.setViewport({ width: 1280, height: 800 });
});
await step("a parameter is filtered, changed and shown", async () => {
  await put("filter", "A_ROLL_GAMMA");
  const name = "A_ROLL_GAMMA";
  const before = await page.$eval(`[aria-label="${name}"]`, ({ value }) => Number(value));
  await put("speed", 1);
  await page.$eval(
    `[aria-label="${name}"]`,
    (field, to) => {
      field.value = to;
      field.dispatchEvent(new Event("change"));
    },
    before * 1.1,
  );
  await until(
    (label, from) => {
      const { value } = document.querySelector(`[aria-label="${label}"]`);
      return (
        Number(value) > from && document.querySelector(`[aria-label="${label}"]`).parentElement.matches(".changed")
      );
    },
    "the change",
    name,
    before,
  );
  assert.equal(await page.$$eval("#parameters tr:not([hidden])", (all) => all.length), 1);
  await put("filter", "");
});
// The page is the same behind a socket.
if (engine === "playground") {
  await step("the keyboard reaches every control, and one sees where", async () => {
    await click("#pause");
    await until(() => globalThis.page.frame.paused, "the pause");
    await page.focus("#click");
    await page.keyboard.down("Shift");
    await page.keyboard.press("Tab");
    await page.keyboard.up("Shift");
    const reached = new Set([await page.evaluate(() => document.activeElement.id)]);
    for (let i = 0; i < 60; i += 1) {
      await page.keyboard.press("Tab");
      reached.add(await page.evaluate(() => document.activeElement.id || document.activeElement.textContent));
    }
    for (const id of ["scene", "take-off", "go", "pause", "laws", "gust", "rotor-fault", "line"]) {
      assert.ok(reached.has(id), `${id} is not reached by Tab`);
    }
    assert.notEqual(await page.evaluate(() => getComputedStyle(document.activeElement).outlineStyle), "none");
  });
  for (const scheme of ["light", "dark"]) {
    await step(`a phone's width, ${scheme}`, async () => {
      await media(scheme);
      await page.setViewport({ width: 390, height: 844, isMobile: true, hasTouch: true, deviceScaleFactor: 2 });
      await new Promise((done) => setTimeout(done, 500));
      assert.ok(
        (await page.evaluate(() => document.documentElement.scrollWidth)) <= 390,
        "it is wider than the phone",
      );
      assert.ok((await colours()) > 20, "the canvas is empty");
      await page.screenshot({
        path: `${shots}/${engine}-phone-${scheme}.png`,
        clip: { x: 0, y: 0, width: 390, height: 1900 },
      });
    });
  }
}
await step("no errors on the console", () => assert.deepEqual(errors, []));
console.log(`${passed} passed, 0 failed`);
await browser.close();
